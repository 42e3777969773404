//! DIMSART's core: Data Base, modules, Module Engine, frame. No allocator, no `unsafe`, no panic.
//!
//! An implementation of *DIMSART: A Real Time - Device Independent Modular Software Architecture for
//! Robotic and Telerobotic Applications* (Artigas, Reintsema, Preusche, Hirzinger, ICINCO 2004).
//!
//! # One tick
//!
//! ```text
//!   sensors, received packets
//!         │  Frame::write   (device outputs -> Data Base)
//!         ▼
//!    ┌──────────┐   read    ┌────────┐
//!    │ Data Base│──────────▶│ Module │   Engine::step: every module that is plugged in, in order
//!    │  (slots) │◀──────────│        │
//!    └──────────┘   write   └────────┘
//!         │  Frame::read    (Data Base -> device inputs)
//!         ▼
//!      Safety       decides what the device gets: the command within its limits, or a safe value
//!         ▼
//!   actuators, packets to send
//! ```
//!
//! [`Dimsart::tick`] is the only place that knows this order; firmware and simulator both call it.
//!
//! # Words
//!
//! | The paper's | Here |
//! |---|---|
//! | Data Base, data type | [`DataBase`]; a [`DataType`] has id, name, [`Unit`], [`Format`] and [`Shape`] |
//! | Device Descriptor | [`DeviceDescriptor`]: degrees of freedom, sample period, types given and taken |
//! | Module: init, activate, compute, command, reset | [`Module`], with the same verbs |
//! | Module Engine, `Module_Step`, `ModuleCmd` | [`Engine`], [`Engine::step`], [`Engine::command`] |
//! | `DB_ext_write`, `DB_ext_read` | [`Frame::write`], [`Frame::read`] |
//! | Types matching check | [`Engine::check`], its [`CheckReport`] and [`Finding`]s |
//! | `COMM_RX`, `COMM_TX` | the modules of that name; a link carries their [`Packet`]s |
//! | multi-thread architectures | two [`Dimsart`]s and a [`Coupling`]; modules that do not run in every tick |
//! | Table 1 | a [`scheme`]: rows of `dest module command value` |
//!
//! # Rules
//!
//! 1. Memory is taken when a module is plugged in and given back when it is unplugged, from [memory](memory!) of a
//!    fixed size that the controller's creator provides. Nothing is allocated or searched for in a tick.
//! 2. A scheme that does not match does not run; a change that would break a running one is refused.
//!    Whatever is refused, nothing has changed.
//! 3. `step` cannot fail. Trouble in a tick is data, and one [safety stage](Safety) decides what
//!    the device gets: a finite number within its limits, or its safe value.
//! 4. Time is an argument: nothing here reads a clock. All arithmetic is plain `f32`, so the same inputs
//!    give the same bits on every target.
//! 5. SI units at every surface.
//!
//! # Where to start
//!
//! To write a control law: [`Module`], with a whole one as its example. To run one: [`Dimsart`]. To
//! build a scheme out of the library: [`scheme`] and the crate `dimsart-modules`.
#![no_std]
#![forbid(unsafe_code)]

// For what only hosts have.
#[cfg(feature = "summaries")]
extern crate alloc;
#[cfg(test)]
extern crate std;

#[cfg(feature = "summaries")]
mod bench;
mod binding;
pub mod checksum;
mod command;
mod content;
mod context;
mod cost;
mod counter;
mod coupling;
mod data;
mod data_base;
mod data_type;
mod declare;
mod description;
mod device;
mod dimsart;
mod engine;
pub mod envelope;
mod explain;
mod frame;
mod handle;
mod input_limits;
mod kind;
mod kind_id;
pub mod limits;
pub mod mailbox;
mod matching;
pub mod math;
mod memory;
mod module;
pub mod names;
pub mod online;
mod output_limits;
mod packet;
pub mod parameter;
mod port;
mod rate;
mod safety;
mod schedule;
pub mod scheme;
pub mod stamp;
mod storage;
mod summary;
mod timing;
pub mod types;
mod unit;
mod unit_tie;
mod vocabulary;
mod wiring;
mod word;
pub mod words;

#[cfg(feature = "summaries")]
pub use bench::{Bench, BenchError};
pub use command::{Command, CommandError, EngineCommand, ModuleRef};
pub use content::Content;
pub use context::{Context, Lane};
pub use cost::{BoundReport, Cost, Costs};
pub use counter::Counter;
pub use coupling::{Coupling, Snapshot, SnapshotReader, SnapshotWriter, TIMEOUT_TICKS};
pub use data::{Data, Inputs, Outputs};
pub use data_base::{DataBase, Entry};
pub use data_type::{DataType, Shape, TypeRef};
pub use declare::Declare;
pub use description::{Accepted, DataTypeText, MAX_CHOICES, ParameterText, PortText, TooManyChoices};
pub use device::{DescriptorError, DeviceDescriptor};
pub use dimsart::Dimsart;
pub use engine::{Calls, Cursor, Engine, FaultCause, ModuleFault, Observer, Step, Usage, type_at};
pub use explain::Explanation;
pub use frame::{Frame, FrameError, MAX_DEVICE_TYPES};
pub use handle::{Grid, Input, Matrix, Memory, Output, Signal, Single, Square, Untyped, Vector};
pub use input_limits::{InputLimits, LimitsFault, SafeValue};
pub use kind::{Kind, Kinds};
pub use kind_id::KindId;
pub use mailbox::{LinkPort, LinkState, Mailbox, START_COUNTERS, counters_ahead, is_newer, next_number};
pub use matching::{CheckReport, Finding, Party};
pub use memory::{ControllerMemory, ProvidedMemory};
pub use module::Module;
pub use names::Name;
pub use output_limits::OutputLimits;
pub use packet::{MAX_PACKET_BYTES, PACKET_OVERHEAD, Packet, PacketError};
pub use parameter::{Accepts, Choice, Entries, Parameter, ParameterError, Parameters, TypeList, Value};
pub use port::{Difference, Direction, PortSpec, Stage};
pub use rate::{EVERY_TICKS, Rate};
pub use safety::{DriveEvent, DriveFault, DriveState, Reason, ReasonCounts, Safety, Tick};
pub use storage::StorageError;
pub use summary::Summary;
pub use timing::{Duration, Timing};
pub use unit::{AxisKind, Unit};
pub use unit_tie::{UnitRelation, UnitTie};
pub use vocabulary::{UnitOn, Vocabulary};
pub use word::{Format, Scalar, Word};
pub use words::Words;
