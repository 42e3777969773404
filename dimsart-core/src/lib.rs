//! Core of DIMSART, a modular real-time controller for robots: `no_std`, no allocator, no `unsafe`, no panic.
//!
//! Control laws are [modules](Module) that exchange [signals](DataType) through the [Data Base](DataBase). A
//! [`scheme`] lists the modules, their parameters and the bindings of their ports. The [engine](Engine) checks a
//! scheme, runs its modules in every tick, and applies changes between two ticks.
//!
//! ```text
//!   sensors, received packets
//!         │  Frame::write   (device outputs -> Data Base)
//!         ▼
//!    ┌──────────┐   read    ┌────────┐
//!    │ Data Base│──────────▶│ Module │   Engine::step: every module of the scheme, in order
//!    │  (slots) │◀──────────│        │
//!    └──────────┘   write   └────────┘
//!         │  Frame::read    (Data Base -> device inputs)
//!         ▼
//!      Safety       outputs the command within its limits, or a safe value
//!         ▼
//!   actuators, packets to send
//! ```
//!
//! [`Dimsart::tick`] runs this sequence, in firmware and in the simulator.
//!
//! # Where to start
//!
//! - Write a control law: [`Module`], with a complete example.
//! - Run a controller: [`Dimsart`].
//! - Build a scheme from the module library: [`scheme`] and the crate `dimsart-modules`.
//!
//! # Layers
//!
//! A folder uses only the folders above it in this table.
//!
//! | Folder | Contents |
//! |---|---|
//! | `signal` | words, formats, units, data types |
//! | `math` | functions with identical results on every target |
//! | `device` | [Device Descriptor](DeviceDescriptor), limits of inputs and outputs, tick timing |
//! | `packet` | [packets](Packet) between two controllers: layout, error protection, mailboxes |
//! | [`online`] | programs: control laws that are uploaded at run time |
//! | [`parameter`] | parameters, their ranges and values |
//! | `data_base` | [Data Base](DataBase): slots, handles, [frame](Frame) |
//! | `module` | [module](Module) template, module kinds, ports, costs |
//! | `vocabulary` | names and descriptions of modules, parameters, ports and types |
//! | [`scheme`] | running and pending scheme: commands, order of calls, matching check |
//! | `engine` | [Module Engine](Engine): step, commands, transactions, fault containment |
//! | `safety` | [safety stage](Safety), numbered faults, drive states |
//! | `dimsart` | a complete [controller](Dimsart) and its tick; `coupling` connects two |
//! | `rows`, `explain` | schemes as text; findings and refusals as messages |
//!
//! # Rules
//!
//! 1. Memory is allocated when a module is plugged in and freed when it is unplugged, from [memory](memory!) of a fixed
//!    size that the application provides. A tick allocates nothing and looks nothing up.
//! 2. A scheme with a fault does not start, and a change that would break the running scheme is refused. A refused
//!    command changes nothing.
//! 3. `step` cannot fail. A fault in a tick is data: the [safety stage](Safety) gives the device a finite value within
//!    its limits, or its safe value.
//! 4. The core reads no clock: time is an argument. All arithmetic is plain `f32`, so the same inputs give identical
//!    results on every target.
//! 5. All interfaces use SI units.
//! 6. Images are optimised for size. Large values are filled in place instead of returned, and `inline` attributes keep
//!    the tick fast and the commands small; both are measured.
//!
//! # Terms of the paper
//!
//! This is an implementation of *DIMSART: A Real Time - Device Independent Modular Software Architecture for Robotic
//! and Telerobotic Applications* (Artigas, Reintsema, Preusche, Hirzinger, ICINCO 2004).
//!
//! | Paper | Here |
//! |---|---|
//! | Data Base, data type | [`DataBase`]; a [`DataType`] has id, name, [`Unit`], [`Format`] and [`Shape`] |
//! | Device Descriptor | [`DeviceDescriptor`]: degrees of freedom, sample period, types of inputs and outputs |
//! | Module: init, activate, compute, command, reset | [`Module`] |
//! | Module Engine, `Module_Step`, `ModuleCmd` | [`Engine`], [`Engine::step`], [`Engine::command`] |
//! | `DB_ext_write`, `DB_ext_read` | [`Frame::write`], [`Frame::read`] |
//! | Types matching check | [`Engine::check`], its [`CheckReport`] and [`Finding`]s |
//! | `COMM_RX`, `COMM_TX` | the modules `COMM_RXMOD` and `COMM_TXMOD`, which exchange [`Packet`]s over a link |
//! | multi-thread architectures | two [`Dimsart`]s and a [`Coupling`]; modules that do not run in every tick |
//! | Table 1 | a [`scheme`]: rows of `dest module command value` |
#![no_std]
#![forbid(unsafe_code)]

// Hosts only.
#[cfg(feature = "summaries")]
extern crate alloc;
#[cfg(test)]
extern crate std;

#[cfg(feature = "summaries")]
mod bench;
mod coupling;
mod data_base;
mod device;
mod dimsart;
mod engine;
mod explain;
pub mod limits;
pub mod math;
mod memory;
mod module;
pub mod online;
mod packet;
pub mod parameter;
mod rows;
mod safety;
pub mod scheme;
mod signal;
pub mod stamp;
mod vocabulary;

#[cfg(feature = "summaries")]
pub use bench::{Bench, BenchError};
pub use coupling::{Coupling, Snapshot, SnapshotReader, SnapshotWriter, TIMEOUT_TICKS};
pub use data_base::data::{Data, Inputs, Outputs};
pub use data_base::frame::{Frame, FrameError};
pub use data_base::handle::{
    Input, Matrix, MatrixSignal, Memory, Output, ScalarSignal, Signal, Square, Untyped, Vector,
};
pub use data_base::storage::StorageError;
pub use data_base::{DataBase, Entry};
pub use device::counter::Counter;
pub use device::descriptor::{DescriptorError, DeviceDescriptor};
pub use device::input_limits::{InputLimits, LimitsError, SafeValue};
pub use device::output_limits::OutputLimits;
pub use device::timing::{Duration, Timing};
pub use dimsart::Dimsart;
pub use engine::{
    Calls, CommandCursor, Engine, FaultCause, ModuleFault, ModuleKinds, Observer, Step, Usage, type_at,
};
pub use explain::Explanation;
pub use limits::MAX_DEVICE_TYPES;
pub use memory::{ControllerMemory, ProvidedMemory};
pub use module::Module;
pub use module::context::{AxisContext, Context};
pub use module::cost::{BoundReport, Cost, Costs};
pub use module::declare::Declarations;
pub use module::kind::ModuleKind;
pub use module::kind_id::KindId;
pub use module::module_ref::ModuleRef;
pub use module::port::{Direction, PortSpec, Stage, TypeMismatch};
pub use module::port_set::PortSet;
pub use module::rate::{EVERY_TICKS, Rate};
pub use packet::content::Content;
pub use packet::mailbox::{
    LinkPort, LinkState, Mailbox, START_COUNTERS, counter_distance, is_newer, next_packet_number,
};
pub use packet::{MAX_PACKET_BYTES, PACKET_OVERHEAD, Packet, PacketError, checksum, envelope, mailbox};
pub use parameter::{
    Choice, Parameter, ParameterError, ParameterSet, ParameterShape, ParameterType, Parameters, TypeList,
    Value,
};
pub use safety::{DriveEvent, DriveFault, DriveState, ReasonCounts, Safety, SafetyReason, TickResult};
pub use scheme::command::{Command, CommandError, EngineCommand};
pub use scheme::finding::{Endpoint, Finding};
pub use scheme::matching::CheckReport;
pub use signal::data_type::{DataType, Shape, TypeRef};
pub use signal::summary::Summary;
pub use signal::unit::{AxisKind, Unit};
pub use signal::unit_constraint::{UnitConstraint, UnitRelation};
pub use signal::word::{Format, Scalar, Word};
pub use signal::words::Words;
pub use signal::{types, words};
pub use vocabulary::description::{
    DataTypeDescription, MAX_CHOICES, ParameterDescription, ParameterTypeDescription, PortDescription,
    TooManyChoices,
};
pub use vocabulary::names::Name;
pub use vocabulary::{AxisUnit, Vocabulary, names};
