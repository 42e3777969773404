//! Responses of a controller.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use dimsart_core::{
    BoundReport, DataTypeDescription, ParameterDescription, ParameterTypeDescription, PortDescription,
};

use super::blocked::{FirstFault, NotCommandedReason};
use super::cycles::CyclesReport;
use super::description::{Identity, InstanceDescription, ModuleDescription};
use super::frame::{BufferTooSmall, DecodeError, EncodeError, decode, encode};
use super::key::KeyState;
use super::lease::LeaseStatus;
use super::motor::{Identification, MotorReport};
use super::refusal::Refusal;
use super::safety::SafetyReport;
use super::schemes::SchemeStatus;
use crate::event_log::Event;
use dimsart_core::envelope::Class;
use dimsart_core::online::LawReport;
use dimsart_core::parameter::Value;
use dimsart_core::{
    Command, CommandError, DriveState, Finding, Format, ModuleFault, Timing, TypeRef, Unit, Usage,
};

/// Maximum number of words of a signal or memory in one response.
pub const MAX_SIGNAL_WORDS: usize = 32;

/// A response. New ones are added at the end; see [Versions](super#versions).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Response<'a> {
    /// The request was refused and had no effect.
    Refused(Refusal),
    /// Identity of the device.
    #[serde(borrow)]
    Identity(Identity<'a>),
    /// A kind of module.
    Module(ModuleDescription<'a>),
    /// A parameter.
    Parameter(ParameterDescription<'a>),
    /// A port.
    Port(PortDescription<'a>),
    /// A data type.
    DataType(DataTypeDescription<'a>),
    /// A module instance.
    Instance(InstanceDescription),
    /// A signal in the data base.
    Entry(TypeRef),
    /// Effect of a command.
    Effect(Effect),
    /// Value of a parameter; of a list, its last entry.
    Value(Value),
    /// Words of a signal or memory.
    Signal(SignalWords),
    /// A finding of the matching check.
    Finding {
        /// The finding.
        finding: Finding,
        /// Total number of the scheme's faults, listed or not.
        faults: u32,
    },
    /// State of the controller.
    Status(Status),
    /// A command of the list that reproduces the scheme.
    SchemeCommand(Command),
    /// Timing of the ticks.
    Timing(TimingReport),
    /// Schemes stored on the board.
    Schemes(SchemeStatus),
    /// The right to move the device.
    Lease(LeaseStatus),
    /// Size of the samples from now on.
    Telemetry {
        /// Words of all signals; 0 if the stream ended.
        words: u8,
    },
    /// State of the board's key.
    Key(KeyState),
    /// Execution times of a tick.
    Cycles(CyclesReport),
    /// Reasons why the device does not get the scheme's commands, with counts.
    Safety(SafetyReport),
    /// An event.
    Event(Event),
    /// A type that the device measures or is commanded by.
    DeviceType {
        /// The type's first signal.
        signal: TypeRef,
        /// Whether the device is commanded by it.
        is_taken: bool,
    },
    /// Upper bound of a tick's execution time.
    Bound(BoundReport),
    /// The motor configuration of a board.
    Motor(MotorReport),
    /// State of the identification of a board's motor.
    Identification(Identification),
    /// State of a law's slot.
    Law(LawReport),
    /// The device restarts after this response.
    Restarts,
}

impl Response<'_> {
    /// Calls `each` with every text of the response and whether the text is a word in schemes, so that a host
    /// can replace control characters.
    pub fn for_each_text(&self, mut each: impl FnMut(&str, bool)) {
        match self {
            Self::Identity(Identity { device, image, protocol_version: _, axes: _, sample_period_s: _ }) => {
                [device, image].into_iter().for_each(|text| each(text, false));
            }
            Self::Module(ModuleDescription { name })
            | Self::Port(PortDescription {
                name,
                direction: _,
                stage: _,
                is_delayed: _,
                default: _,
                bound: _,
            })
            | Self::DataType(DataTypeDescription { id: _, name, unit: _, format: _, shape: _ }) => {
                each(name, true)
            }
            Self::Parameter(ParameterDescription {
                name,
                accepts,
                unit: _,
                entries: _,
                default: _,
                is_structural: _,
            }) => {
                each(name, true);
                match accepts {
                    ParameterTypeDescription::Choice(names) => names.iter().for_each(|name| each(name, true)),
                    ParameterTypeDescription::Real { .. }
                    | ParameterTypeDescription::Count { .. }
                    | ParameterTypeDescription::Integer { .. }
                    | ParameterTypeDescription::Flag
                    | ParameterTypeDescription::Types => {}
                }
            }
            Self::Refused(_)
            | Self::Instance(_)
            | Self::Entry(_)
            | Self::Effect(_)
            | Self::Value(_)
            | Self::Signal(_)
            | Self::Finding { .. }
            | Self::Status(_)
            | Self::SchemeCommand(_)
            | Self::Timing(_)
            | Self::Schemes(_)
            | Self::Lease(_)
            | Self::Telemetry { .. }
            | Self::Key(_)
            | Self::Cycles(_)
            | Self::Safety(_)
            | Self::Event(_)
            | Self::DeviceType { .. }
            | Self::Bound(_)
            | Self::Motor(_)
            | Self::Identification(_)
            | Self::Law(_)
            | Self::Restarts => {}
        }
    }
}

/// The result of a command and the resulting state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Effect {
    /// Why the command was refused without effect; `None` if it was executed.
    pub refused: Option<CommandError>,
    /// Why the scheme does not command the device; `None` if it does, or will in the next tick.
    pub blocked: Option<NotCommandedReason>,
    /// New value of the parameter, or new binding of the port, if any.
    pub value: Option<Value>,
    /// Whether a transaction is open: changes are pending until the commit.
    pub is_in_transaction: bool,
}

/// Words of a signal or memory.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SignalWords {
    /// Format of every word.
    pub format: Format,
    /// Physical unit.
    pub unit: Unit,
    /// Total number of words.
    pub total_words: u16,
    /// The requested words, in this `format`.
    pub words: Vec<u32, MAX_SIGNAL_WORDS>,
}

/// State of a controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Status {
    /// Ticks since the start.
    pub ticks: u64,
    /// Ticks in which a frame was refused.
    pub refused_ticks: u32,
    /// Whether the scheme passed its check and runs.
    pub is_running: bool,
    /// Why the scheme does not command the device; `None` if it does.
    pub blocked: Option<NotCommandedReason>,
    /// The first tick that was refused.
    pub first_fault: Option<FirstFault>,
    /// Usage of the static storage.
    pub usage: Usage,
    /// Whether a transaction is open: modules, ports and parameters are those of the pending scheme.
    pub is_in_transaction: bool,
    /// The state of the drive.
    pub state: DriveState,
    /// The first failed module, while modules are isolated, whether the device depends on it or not.
    pub module_fault: Option<ModuleFault>,
}

/// Timing of the ticks; see [`Timing`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct TimingReport {
    /// Ticks.
    pub ticks: u32,
    /// Ticks that began late.
    pub late: u32,
    /// Ticks that were not finished when the next one was due.
    pub overruns: u32,
    /// Processor cycles of a tick, if known: last, mean, maximum.
    pub last_mean_max_cycles: Option<[u32; 3]>,
}

impl From<Timing> for TimingReport {
    fn from(timing: Timing) -> Self {
        let Timing { ticks, late, overruns, duration } = timing;
        let cycles = duration.map(|found| [found.last_cycles, found.mean_cycles(), found.max_cycles]);
        Self { ticks, late, overruns, last_mean_max_cycles: cycles }
    }
}

/// Encodes the frame of a response into `out`. A response that does not fit a frame becomes
/// [`Refusal::TooLong`].
///
/// # Errors
/// [`BufferTooSmall`] if `out` is too small; [`MAX_FRAME_BYTES`](super::MAX_FRAME_BYTES) are enough.
pub fn encode_response<'o>(
    response: &Response<'_>,
    id: u16,
    out: &'o mut [u8],
) -> Result<&'o [u8], BufferTooSmall> {
    let length = match encode(Class::Response, id, response, out) {
        Err(EncodeError::TooLong) => encode(Class::Response, id, &Response::Refused(Refusal::TooLong), out),
        result => result,
    };
    let length = length.map_err(|_| BufferTooSmall)?;
    out.get(..length).ok_or(BufferTooSmall)
}

/// Decodes id and response from a frame's content; texts are borrowed from it.
///
/// # Errors
/// [`DecodeError`] if it is another message or of an unknown version.
pub fn decode_response(content: &[u8]) -> Result<(u16, Response<'_>), DecodeError> {
    decode(Class::Response, content)
}
