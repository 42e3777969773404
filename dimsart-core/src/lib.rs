//! DIMSART's core.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

mod command;
mod data;
mod data_base;
mod data_type;
mod device;
mod dimsart;
mod engine;
mod explain;
mod frame;
mod handle;
pub mod limits;
mod mailbox;
mod matching;
pub mod math;
mod module;
pub mod modules;
mod names;
mod packet;
pub mod parameter;
mod port;
mod schedule;
pub mod scheme;
mod storage;
pub mod types;
mod unit;
mod word;

pub use command::{Command, CommandError, ModuleRef, PORT, Target, Verb};
pub use data::Data;
pub use data_base::{DataBase, Entry};
pub use data_type::{DataType, Shape, TypeRef};
pub use device::{DescriptorError, DeviceDescriptor};
pub use dimsart::{Dimsart, Tick};
pub use engine::{Engine, Step, Usage};
pub use explain::Explanation;
pub use frame::{Frame, FrameError, MAX_DEVICE_TYPES};
pub use handle::{Input, Matrix, Memory, Output, Signal, Single, Vector};
pub use mailbox::{LinkPort, Mailbox, is_newer};
pub use matching::{Difference, Finding, Party, Report};
pub use module::{Kind, Module, ModuleList};
pub use names::Name;
pub use packet::{MAX_PACKET_BYTES, PACKET_OVERHEAD, PACKET_VERSION, Packet, PacketError};
pub use parameter::{Accepts, Choice, Parameter, ParameterError, Parameters, PerAxis, TypeList, Value};
pub use port::{Direction, PortSpec, Ports, Stage};
pub use storage::StorageError;
pub use unit::{AxisKind, Unit};
pub use word::{Format, Scalar, Word};
