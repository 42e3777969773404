//! What a host asks of a controller.

use serde::{Deserialize, Serialize};

use super::LawAction;
use super::frame::{DecodeError, NoRoom, decode, encode};
use super::{KeyAction, LeaseAction, MotorAction, SchemeAction};
use dimsart_core::envelope::Class;
use dimsart_core::{Command, KindId, ModuleRef, TypeRef};

/// A request. New ones are added at the end; see [Versions](super#versions).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Request {
    /// Who is there? Answered by [`Response::Identity`](super::Response::Identity).
    Identify,
    /// Name and purpose of a kind of module.
    Module {
        /// Place in the image's list of module kinds.
        place: u8,
    },
    /// Description of a parameter of a kind of module.
    Parameter {
        /// Kind of module.
        kind: KindId,
        /// Number of the parameter, as in the [command](Command::Set) that sets it.
        index: u8,
    },
    /// A port of a module as its parameters are now; as by default for a module that does not exist.
    Port {
        /// The module.
        module: ModuleRef,
        /// Number of the port, as in the [command](Command::Bind) that binds it.
        index: u8,
    },
    /// Description of a data type: the standard ones, then the device's own.
    DataType {
        /// Place in the list; not the type's id.
        index: u16,
    },
    /// A module that exists.
    Instance {
        /// Place in the list.
        index: u8,
    },
    /// A signal that is in the Data Base now.
    Entry {
        /// Place in the list.
        index: u8,
    },
    /// A command, answered by its [`Effect`](super::Effect).
    Command(Command),
    /// Value of a parameter.
    Get {
        /// The module.
        module: ModuleRef,
        /// Number of the parameter.
        parameter: u8,
        /// Place of the value where the parameter has [several](dimsart_core::Entries), or 0.
        entry: u8,
    },
    /// Words of a signal, as the last tick left them.
    Signal {
        /// The signal.
        signal: TypeRef,
        /// First word wanted; at most [`MAX_SIGNAL_WORDS`](super::MAX_SIGNAL_WORDS) come at a time.
        from: u16,
    },
    /// A finding of the matching check, faults and declared delays.
    Finding {
        /// Place in the report.
        index: u8,
    },
    /// How the controller is doing.
    Status,
    /// A command of those that would build the scheme; see
    /// [`Engine::command_of`](dimsart_core::Engine::command_of).
    SchemeCommand {
        /// Place of the module.
        place: u8,
        /// Which of its commands.
        index: u16,
    },
    /// How well the ticks keep their time.
    Timing,
    /// Schemes that the board keeps; for whoever has the storage, [`serve`](super::serve) has none. A change renews the
    /// lease of a client that holds it: nothing is received while the flash is written.
    Schemes(SchemeAction),
    /// The right to move the device, answered by how it stands then.
    Lease(LeaseAction),
    /// A signal to be sent by the device itself; see [`Sample`](super::Sample). All of it ends when the client has
    /// not asked for anything for 5 s.
    Telemetry {
        /// Place of the signal in a sample: the first of a stream's
        /// [`MAX_TELEMETRY_SIGNALS`](super::MAX_TELEMETRY_SIGNALS) begins it anew, every other one adds to what it sends.
        /// There are as many streams as the controller's creator has chosen.
        place: u8,
        /// Which signal.
        signal: TypeRef,
        /// Ticks from one sample to the next; 0 ends it.
        every_ticks: u32,
    },
    /// The key that the board keeps; for whoever has it, [`serve`](super::serve) knows of none.
    Key(KeyAction),
    /// What was measured of a tick since the scheme was changed; for a caller of the tick that measures,
    /// [`serve`](super::serve) has nothing of that number.
    Cycles {
        /// 0 for the whole tick, then 1 for the first of [`Engine::steps`](dimsart_core::Engine::steps) and so on.
        place: u8,
        /// Forgets all that was measured, of every place, once it is answered. It moves nothing, so that it needs no
        /// lease.
        begins_anew: bool,
    },
    /// Why the device does not get what the scheme commands, and how often.
    Safety,
    /// Words of a memory that a module keeps, as the last tick left them. Answered by
    /// [`Response::Signal`](super::Response::Signal), as whole numbers: what they mean is the module's matter.
    Memory {
        /// The module, which is plugged in.
        module: ModuleRef,
        /// Number of the [port](dimsart_core::Direction::Memory) that declares the memory.
        port: u8,
        /// First word wanted; at most [`MAX_SIGNAL_WORDS`](super::MAX_SIGNAL_WORDS) come at a time.
        from: u16,
    },
    /// Something that happened, of the last [`MAX_EVENTS`](crate::MAX_EVENTS).
    Event {
        /// How many happened since.
        back: u8,
    },
    /// A type that the device measures or takes.
    DeviceType {
        /// Place in the list of both, those that it measures first.
        index: u8,
    },
    /// What a tick takes at most.
    Bound,
    /// The motor of a board that has a drive; for whoever has that, [`serve`](super::serve) says only who may not.
    Motor(MotorAction),
    /// A law that was uploaded: a [program](dimsart_core::online). Reading is answered by
    /// [`Response::Signal`](super::Response::Signal), looking by [`Response::Law`](super::Response::Law).
    Law(LawAction),
    /// To start anew, as after a reset, while no client holds the lease; for whoever can, [`serve`](super::serve) says only who may not.
    Restart,
}

impl Request {
    /// Whether it changes what the device does, so that it is refused while another client holds the lease.
    ///
    /// `STOP` is none of these: whoever sees that a device must rest may say so.
    #[must_use]
    pub fn is_change(&self) -> bool {
        match self {
            Self::Command(command) => !matches!(command, Command::Stop),
            Self::Schemes(action) => *action != SchemeAction::Look,
            Self::Restart => true,
            Self::Motor(action) => !matches!(action, MotorAction::Look | MotorAction::Found),
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

    /// Whether a board that holds a key takes it only from who has that: all that changes or moves something, but for
    /// what brings the device to rest.
    #[cfg(feature = "auth")]
    #[must_use]
    pub fn needs_key(&self) -> bool {
        match self {
            Self::Lease(action) => *action != LeaseAction::Look,
            Self::Key(action) => *action != KeyAction::Look,
            Self::Cycles { begins_anew, .. } => *begins_anew,
            _ => self.is_change(),
        }
    }
}

/// Writes the frame of a request to the start of `out` and gives it; its answer has the same `id`, which is made
/// by [`request_id`](super::request_id).
///
/// # Errors
/// [`NoRoom`] when `out` is too small; [`MAX_FRAME_BYTES`](super::MAX_FRAME_BYTES) are enough.
pub fn encode_request<'o>(request: &Request, id: u16, out: &'o mut [u8]) -> Result<&'o [u8], NoRoom> {
    let length = encode(Class::Request, id, request, out).map_err(|_| NoRoom)?;
    out.get(..length).ok_or(NoRoom)
}

/// Reads id and request out of a frame's content.
///
/// # Errors
/// [`DecodeError`] when it is no request, or one that this version does not know.
pub fn decode_request(content: &[u8]) -> Result<(u16, Request), DecodeError> {
    decode(Class::Request, content)
}
