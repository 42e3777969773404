//! DIMSART's core: a modular real-time controller. No allocator, no `unsafe`, no panic.
//!
//! An implementation of *DIMSART: A Real Time - Device Independent Modular Software Architecture for
//! Robotic and Telerobotic Applications* (Artigas, Reintsema, Preusche, Hirzinger, ICINCO 2004).
//!
//! # Layers
//!
//! A folder uses only the folders above it in this table.
//!
//! | Folder | Contents |
//! |---|---|
//! | `signal` | words, formats, units, data types |
//! | `math` | functions with the same bits on every target |
//! | `device` | the [Device Descriptor](DeviceDescriptor), limits of inputs and outputs, timing |
//! | `packet` | [packets](Packet) between two controllers: layout, error protection, mailboxes |
//! | [`online`] | programs: control laws that are loaded at run time |
//! | [`parameter`] | parameters, their ranges and values |
//! | `data_base` | the [Data Base](DataBase): slots, handles, the [frame](Frame) |
//! | `module` | the [module](Module) template, module kinds, ports, costs |
//! | `vocabulary` | names and descriptions of modules, parameters, ports and types |
//! | [`scheme`] | running and pending scheme: commands, order of calls, matching check |
//! | `engine` | the [Module Engine](Engine): step, commands, transactions, fault containment |
//! | `safety` | the [safety stage](Safety), faults by number, states of a drive |
//! | `dimsart` | a whole [controller](Dimsart) and the order of its tick; two of them: `coupling` |
//! | `rows`, `explain` | schemes as text; findings and refusals as sentences |
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
pub use data_base::handle::{Grid, Input, Matrix, Memory, Output, Signal, Single, Square, Untyped, Vector};
pub use data_base::storage::StorageError;
pub use data_base::{DataBase, Entry};
pub use device::counter::Counter;
pub use device::descriptor::{DescriptorError, DeviceDescriptor};
pub use device::input_limits::{InputLimits, LimitsFault, SafeValue};
pub use device::output_limits::OutputLimits;
pub use device::timing::{Duration, Timing};
pub use dimsart::Dimsart;
pub use engine::{Calls, Cursor, Engine, FaultCause, Kinds, ModuleFault, Observer, Step, Usage, type_at};
pub use explain::Explanation;
pub use limits::MAX_DEVICE_TYPES;
pub use memory::{ControllerMemory, ProvidedMemory};
pub use module::Module;
pub use module::context::{Context, Lane};
pub use module::cost::{BoundReport, Cost, Costs};
pub use module::declare::Declare;
pub use module::kind::Kind;
pub use module::kind_id::KindId;
pub use module::module_ref::ModuleRef;
pub use module::port::{Difference, Direction, PortSpec, Stage};
pub use module::port_set::PortSet;
pub use module::rate::{EVERY_TICKS, Rate};
pub use packet::content::Content;
pub use packet::mailbox::{
    LinkPort, LinkState, Mailbox, START_COUNTERS, counters_ahead, is_newer, next_number,
};
pub use packet::{MAX_PACKET_BYTES, PACKET_OVERHEAD, Packet, PacketError, checksum, envelope, mailbox};
pub use parameter::{
    Accepts, Choice, Entries, Parameter, ParameterError, ParameterSet, Parameters, TypeList, Value,
};
pub use safety::{DriveEvent, DriveFault, DriveState, Reason, ReasonCounts, Safety, Tick};
pub use scheme::command::{Command, CommandError, EngineCommand};
pub use scheme::finding::{Finding, Party};
pub use scheme::matching::CheckReport;
pub use signal::data_type::{DataType, Shape, TypeRef};
pub use signal::summary::Summary;
pub use signal::unit::{AxisKind, Unit};
pub use signal::unit_tie::{UnitRelation, UnitTie};
pub use signal::word::{Format, Scalar, Word};
pub use signal::words::Words;
pub use signal::{types, words};
pub use vocabulary::description::{
    Accepted, DataTypeText, MAX_CHOICES, ParameterText, PortText, TooManyChoices,
};
pub use vocabulary::names::Name;
pub use vocabulary::{UnitOn, Vocabulary, names};
