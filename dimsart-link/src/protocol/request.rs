//! Requests of a host to a controller.

use serde::{Deserialize, Serialize};

use super::LawAction;
use super::frame::{BufferTooSmall, DecodeError, decode, encode};
use super::{KeyAction, LeaseAction, MotorAction, SchemeAction};
use dimsart_core::envelope::Class;
use dimsart_core::{Command, KindId, ModuleRef, TypeRef};

/// A request. New ones are added at the end; see [Versions](super#versions).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Request {
    /// Identifies the device. Response: [`Response::Identity`](super::Response::Identity).
    Identify,
    /// Name of a kind of module.
    Module {
        /// Index in the image's list of module kinds.
        place: u8,
    },
    /// Description of a parameter of a module kind.
    Parameter {
        /// Kind of module.
        kind: KindId,
        /// Index of the parameter, as in the [command](Command::Set) that sets it.
        index: u8,
    },
    /// A port of a module with its current parameters; with default parameters if the module does not exist.
    Port {
        /// The module.
        module: ModuleRef,
        /// Index of the port, as in the [command](Command::Bind) that binds it.
        index: u8,
    },
    /// Description of a data type: standard types first, then the device's own.
    DataType {
        /// Index in the list; not the type's id.
        index: u16,
    },
    /// A module instance.
    Instance {
        /// Index in the list.
        index: u8,
    },
    /// A signal in the data base.
    Entry {
        /// Index in the list.
        index: u8,
    },
    /// A command. Response: its [`Effect`](super::Effect).
    Command(Command),
    /// Value of a parameter.
    Get {
        /// The module.
        module: ModuleRef,
        /// Index of the parameter.
        parameter: u8,
        /// Index of the value if the parameter has [several](dimsart_core::ParameterShape), or 0.
        entry: u8,
    },
    /// Words of a signal, from the last tick.
    Signal {
        /// The signal.
        signal: TypeRef,
        /// First word; a response has at most [`MAX_SIGNAL_WORDS`](super::MAX_SIGNAL_WORDS).
        from: u16,
    },
    /// A finding of the matching check: a fault or a declared delay.
    Finding {
        /// Index in the report.
        index: u8,
    },
    /// State of the controller.
    Status,
    /// A command of the list that reproduces the scheme; see
    /// [`Engine::rebuild_command`](dimsart_core::Engine::rebuild_command).
    SchemeCommand {
        /// Index of the module in the plug-in order.
        place: u8,
        /// Index of the command.
        index: u16,
    },
    /// Timing of the ticks.
    Timing,
    /// Schemes stored on the board; handled by the caller that has the storage, not by
    /// [`serve`](super::serve). A change renews the holder's lease, because the board receives nothing while
    /// it writes the flash.
    Schemes(SchemeAction),
    /// The right to move the device. Response: the resulting state.
    Lease(LeaseAction),
    /// Adds a signal to the telemetry; see [`Sample`](super::Sample). Telemetry ends when the client is
    /// silent for 5 s.
    Telemetry {
        /// Index of the signal in a sample. The first of a stream's
        /// [`MAX_TELEMETRY_SIGNALS`](super::MAX_TELEMETRY_SIGNALS) restarts the stream, the others add to it.
        /// The controller's creator sets the number of streams.
        place: u8,
        /// The signal.
        signal: TypeRef,
        /// Interval of the samples, ticks; 0 ends the stream.
        every_ticks: u32,
    },
    /// The board's key; handled by the caller that has the key storage, not by [`serve`](super::serve).
    Key(KeyAction),
    /// Execution times since the last scheme change; handled by a caller that measures them.
    /// [`serve`](super::serve) returns [`Refusal::NotFound`](super::Refusal::NotFound).
    Cycles {
        /// 0 for the whole tick, then 1 for the first of [`Engine::steps`](dimsart_core::Engine::steps) and
        /// so on.
        place: u8,
        /// Clears the measurements of all places after the response. Needs no lease, because nothing moves.
        clears: bool,
    },
    /// Reasons why the device does not get the scheme's commands, with counts.
    Safety,
    /// Words of a module's memory, from the last tick. Response:
    /// [`Response::Signal`](super::Response::Signal) with integers; only the module interprets them.
    Memory {
        /// The module, which must be plugged in.
        module: ModuleRef,
        /// Index of the [port](dimsart_core::Direction::Memory) that declares the memory.
        port: u8,
        /// First word; a response has at most [`MAX_SIGNAL_WORDS`](super::MAX_SIGNAL_WORDS).
        from: u16,
    },
    /// One of the last [`MAX_EVENTS`](crate::MAX_EVENTS) events.
    Event {
        /// Number of later events.
        back: u8,
    },
    /// A type that the device measures or is commanded by.
    DeviceType {
        /// Index in the list: measured types first, then commanded types.
        index: u8,
    },
    /// Upper bound of a tick's execution time.
    Bound,
    /// The motor of a board with a drive; [`serve`](super::serve) only checks the permission.
    Motor(MotorAction),
    /// An uploaded law: a [program](dimsart_core::online). The response to a read is a
    /// [`Response::Signal`](super::Response::Signal), to a look a [`Response::Law`](super::Response::Law).
    Law(LawAction),
    /// Restarts the board, as after a reset. Refused while a client holds the lease; [`serve`](super::serve)
    /// only checks the permission.
    Restart,
}

impl Request {
    /// Returns whether the request changes what the device does and is refused while another client holds the
    /// lease.
    ///
    /// `STOP` does not count: every client may stop the device.
    #[must_use]
    pub fn changes_device(&self) -> bool {
        match self {
            Self::Command(command) => !matches!(command, Command::Stop),
            Self::Schemes(action) => *action != SchemeAction::Read,
            Self::Restart => true,
            Self::Motor(action) => !matches!(action, MotorAction::Read | MotorAction::ReadIdentification),
            Self::Identify
            | Self::Module { .. }
            | Self::Parameter { .. }
            | Self::Port { .. }
            | Self::DataType { .. }
            | Self::Instance { .. }
            | Self::Entry { .. }
            | Self::Get { .. }
            | Self::Signal { .. }
            | Self::Finding { .. }
            | Self::Status
            | Self::SchemeCommand { .. }
            | Self::Timing
            | Self::Lease(_)
            | Self::Telemetry { .. }
            | Self::Key(_)
            | Self::Cycles { .. }
            | Self::Safety
            | Self::Memory { .. }
            | Self::Event { .. }
            | Self::DeviceType { .. }
            | Self::Bound
            | Self::Law(_) => false,
        }
    }

    /// Returns whether a locked board requires the request to be sealed: requests that change or move
    /// something, except those that bring the device to rest.
    #[cfg(feature = "auth")]
    #[must_use]
    pub fn needs_key(&self) -> bool {
        match self {
            Self::Lease(action) => *action != LeaseAction::Read,
            Self::Key(action) => *action != KeyAction::Read,
            Self::Cycles { clears, .. } => *clears,
            _ => self.changes_device(),
        }
    }
}

/// Encodes the frame of a request into `out`. The response has the same `id`; see
/// [`request_id`](super::request_id).
///
/// # Errors
/// [`BufferTooSmall`] if `out` is too small; [`MAX_FRAME_BYTES`](super::MAX_FRAME_BYTES) are enough.
pub fn encode_request<'o>(request: &Request, id: u16, out: &'o mut [u8]) -> Result<&'o [u8], BufferTooSmall> {
    let length = encode(Class::Request, id, request, out).map_err(|_| BufferTooSmall)?;
    out.get(..length).ok_or(BufferTooSmall)
}

/// Decodes id and request from a frame's content.
///
/// # Errors
/// [`DecodeError`] if it is another message or of an unknown version.
pub fn decode_request(content: &[u8]) -> Result<(u16, Request), DecodeError> {
    decode(Class::Request, content)
}
