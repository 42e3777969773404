//! What a controller answers.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use dimsart_core::{Accepted, BoundReport, DataTypeText, ParameterText, PortText};

use super::blocked::{Blocked, FirstFault};
use super::cycles::CyclesReport;
use super::description::{Identity, InstanceText, ModuleText};
use super::frame::{DecodeError, EncodeError, NoRoom, decode, encode};
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

/// Most words of a signal, or of a memory, in one response.
pub const MAX_SIGNAL_WORDS: usize = 32;

/// A response. New ones are added at the end; see [Versions](super#versions).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Response<'a> {
    /// Nothing was done.
    Refused(Refusal),
    /// Who is there.
    #[serde(borrow)]
    Identity(Identity<'a>),
    /// A kind of module.
    Module(ModuleText<'a>),
    /// A parameter.
    Parameter(ParameterText<'a>),
    /// A port.
    Port(PortText<'a>),
    /// A data type.
    DataType(DataTypeText<'a>),
    /// A module that exists.
    Instance(InstanceText),
    /// A signal that is in the Data Base.
    Entry(TypeRef),
    /// What a command did.
    Effect(Effect),
    /// Value of a parameter; of a list, its last entry.
    Value(Value),
    /// Words of a signal, or of a memory.
    Signal(SignalText),
    /// A finding of the matching check.
    Finding {
        /// The finding.
        finding: Finding,
        /// Faults of the scheme in all, listed or not.
        faults: u32,
    },
    /// How the controller is doing.
    Status(Status),
    /// A command of those that would build the scheme.
    SchemeCommand(Command),
    /// How well the ticks keep their time.
    Timing(TimingReport),
    /// Schemes that the board keeps.
    Schemes(SchemeStatus),
    /// The right to move the device.
    Lease(LeaseStatus),
    /// Words of each sample that comes from now on.
    Telemetry {
        /// Of all signals; 0 when it has ended.
        words: u8,
    },
    /// How the board stands to keys.
    Key(KeyState),
    /// What was measured of a tick.
    Cycles(CyclesReport),
    /// Why the device does not get what the scheme commands, and how often.
    Safety(SafetyReport),
    /// Something that happened.
    Event(Event),
    /// A type that the device measures or takes.
    DeviceType {
        /// The type's first signal, which the frame writes or reads.
        signal: TypeRef,
        /// Whether the device takes it.
        is_taken: bool,
    },
    /// What a tick takes at most.
    Bound(BoundReport),
    /// What a board's motor is run by.
    Motor(MotorReport),
    /// How the identification of a board's motor stands.
    Identification(Identification),
    /// How a place for a law stands.
    Law(LawReport),
    /// The device starts anew, right behind this answer.
    Restarts,
}

impl Response<'_> {
    /// Calls `each` with every text of the response, and whether the text is a word in schemes: a host replaces
    /// characters that a terminal would act on.
    pub fn for_each_text(&self, mut each: impl FnMut(&str, bool)) {
        match self {
            Self::Identity(Identity { device, image, protocol_version: _, axes: _, sample_period_s: _ }) => {
                [device, image].into_iter().for_each(|text| each(text, false));
            }
            Self::Module(ModuleText { name })
            | Self::Port(PortText { name, direction: _, stage: _, is_delayed: _, default: _, bound: _ })
            | Self::DataType(DataTypeText { id: _, name, unit: _, format: _, shape: _ }) => each(name, true),
            Self::Parameter(ParameterText {
                name,
                accepts,
                unit: _,
                entries: _,
                default: _,
                is_structural: _,
            }) => {
                each(name, true);
                match accepts {
                    Accepted::Choice(names) => names.iter().for_each(|name| each(name, true)),
                    Accepted::Real { .. }
                    | Accepted::Count { .. }
                    | Accepted::Integer { .. }
                    | Accepted::Flag
                    | Accepted::Types => {}
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

/// What a command came to: whether it was carried out, and how things stand now.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Effect {
    /// Why the command was refused, and nothing changed; none when it was carried out.
    pub refused: Option<CommandError>,
    /// Why the scheme does not command the device now; none when it does, or will in the next tick.
    pub blocked: Option<Blocked>,
    /// What the named parameter is set to, or the named port bound to, now, if there is one.
    pub value: Option<Value>,
    /// Whether a transaction is open now: what was changed waits for its commit.
    pub is_in_transaction: bool,
}

/// Words of a signal, or of a memory.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SignalText {
    /// Format of every word.
    pub format: Format,
    /// Physical unit.
    pub unit: Unit,
    /// Words in all.
    pub words_in_all: u16,
    /// The words from the one that was asked for on, to be read as `format` says.
    pub words: Vec<u32, MAX_SIGNAL_WORDS>,
}

/// How a controller is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Status {
    /// Ticks since the start.
    pub ticks: u64,
    /// Those of them in which a frame was refused.
    pub refused_ticks: u32,
    /// Whether the scheme passed its check and runs.
    pub is_running: bool,
    /// Why the scheme does not command the device now; none when it does.
    pub blocked: Option<Blocked>,
    /// The first tick that was refused.
    pub first_fault: Option<FirstFault>,
    /// What is taken of the static storage.
    pub usage: Usage,
    /// Whether a transaction is open: modules, their ports and parameters are told of the next scheme.
    pub is_in_transaction: bool,
    /// The state of the drive.
    pub state: DriveState,
    /// The first module that failed, while modules are cut out for that; whether the device depends on it or not.
    pub module_fault: Option<ModuleFault>,
}

/// How well the ticks keep their time; see [`Timing`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct TimingReport {
    /// Ticks.
    pub ticks: u32,
    /// Ticks that began late.
    pub late: u32,
    /// Ticks that were not done when the next one was due.
    pub overruns: u32,
    /// Processor cycles of the last tick, of ticks on average, and of the longest one, if they are known.
    pub last_mean_max_cycles: Option<[u32; 3]>,
}

impl From<Timing> for TimingReport {
    fn from(timing: Timing) -> Self {
        let Timing { ticks, late, overruns, duration } = timing;
        let cycles = duration.map(|found| [found.last_cycles, found.mean_cycles(), found.max_cycles]);
        Self { ticks, late, overruns, last_mean_max_cycles: cycles }
    }
}

/// Writes the frame of a response to the start of `out` and gives it. A response that does not fit a
/// frame becomes [`Refusal::TooLong`].
///
/// # Errors
/// [`NoRoom`] when `out` is too small; [`MAX_FRAME_BYTES`](super::MAX_FRAME_BYTES) are enough.
pub fn encode_response<'o>(response: &Response<'_>, id: u16, out: &'o mut [u8]) -> Result<&'o [u8], NoRoom> {
    let length = match encode(Class::Response, id, response, out) {
        Err(EncodeError::TooLong) => encode(Class::Response, id, &Response::Refused(Refusal::TooLong), out),
        result => result,
    };
    let length = length.map_err(|_| NoRoom)?;
    out.get(..length).ok_or(NoRoom)
}

/// Reads id and response out of a frame's content; texts are borrowed from it.
///
/// # Errors
/// [`DecodeError`] when it is no response, or one that this version does not know.
pub fn decode_response(content: &[u8]) -> Result<(u16, Response<'_>), DecodeError> {
    decode(Class::Response, content)
}
