//! DBC files of a scheme's CAN messages, for CAN tools.
//!
//! Describes the packets of a controller that runs the scheme, in the layout of [`carrier`](dimsart_link::carrier). One message
//! per sending module; its identifier is the module's channel.

mod layout;

use std::fmt::{self, Display, Formatter};

use dimsart_core::{Command, Dimsart, KindId, ModuleRef, TypeRef, Value};
use serde::Serialize;

use hil_sim::first_packet::first_packet;

pub use layout::{NumberFormat, Signal};

/// Format of the CAN frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FrameFormat {
    /// 8 bytes: several frames per packet, with the multiplexer `INDEX`.
    Can,
    /// 64 bytes: one frame per packet.
    CanFd,
}

impl FrameFormat {
    /// Index in the list of the attribute, for 11-bit identifiers.
    fn format(self) -> u8 {
        match self {
            Self::Can => 0,
            Self::CanFd => 14,
        }
    }
}

/// Attributes of bus type and frame format.
const ATTRIBUTES: &str = r#"BA_DEF_ "BusType" STRING ;
BA_DEF_ BO_ "VFrameFormat" ENUM "StandardCAN","ExtendedCAN","reserved","reserved","reserved","reserved","reserved","reserved","reserved","reserved","reserved","reserved","reserved","reserved","StandardCAN_FD","ExtendedCAN_FD";
BA_DEF_DEF_ "BusType" "CAN";
BA_DEF_DEF_ "VFrameFormat" "StandardCAN";"#;

/// A message: all packets of one sending module.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Message {
    /// Identifier of its frames: the channel.
    pub identifier: u16,
    /// Name, such as `master_COMM_TXMOD`.
    pub name: String,
    /// Sending controller.
    pub sender: String,
    /// Format of its frames.
    pub frames: FrameFormat,
    /// Longest frame, bytes.
    pub bytes: usize,
    /// Signals of its frames.
    pub signals: Vec<Signal>,
}

/// Errors of DBC files.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DbcError {
    /// The controller sends nothing.
    #[error("the scheme sends nothing on the {side}: plug in a COMM_TXMOD")]
    NoMessages {
        /// The side.
        side: String,
    },
    /// Channel 0, whose identifier depends on the chip's serial number.
    #[error(
        "{module} on the {side} sends on channel 0, whose identifier depends on the board's serial number: add a row \
        `{side} {module} CTX_CHANNEL n`, n from 1 to 2047, before its MOD_ON, and set the receiver's CRX_CHANNEL to n"
    )]
    NoIdentifier {
        /// The side.
        side: String,
        /// The module.
        module: String,
    },
    /// Duplicate identifier.
    #[error(
        "duplicate channel {channel}: {one} and {other} would send frames with the same identifier; give each module its \
        own `CTX_CHANNEL`, and its receiver the same `CRX_CHANNEL`"
    )]
    DuplicateIdentifier {
        /// First message.
        one: String,
        /// Second message.
        other: String,
        /// The channel of both.
        channel: u16,
    },
    /// Too many words for the frames.
    #[error(
        "{module} on the {side} sends {words} words per packet, maximum {most}: remove signals, or the counters \
        (`CTX_COUNTERS OFF`)"
    )]
    TooLong {
        /// The side.
        side: String,
        /// The module.
        module: String,
        /// Words of a packet.
        words: usize,
        /// Maximum words.
        most: usize,
    },
}

/// Returns the messages of a controller with a running scheme; `side` is its name.
///
/// Ticks the controller, with a device at rest, until every module has sent.
///
/// # Errors
/// [`DbcError`] if nothing is sent, or a packet does not fit.
pub fn messages(dimsart: &mut Dimsart, side: &str, frames: FrameFormat) -> Result<Vec<Message>, DbcError> {
    let senders = senders(dimsart);
    if senders.is_empty() {
        return Err(DbcError::NoMessages { side: side.to_owned() });
    }
    senders.into_iter().map(|sender| message(dimsart, side, &sender, frames)).collect()
}

/// A sending module.
struct Sender {
    module: ModuleRef,
    link: usize,
    types: Vec<TypeRef>,
}

fn senders(dimsart: &mut Dimsart) -> Vec<Sender> {
    let engine = dimsart.engine_mut();
    let kinds = engine.kinds();
    let is_sender = |module: &ModuleRef| module.kind == KindId::from_name("COMM_TXMOD");
    let modules: Vec<ModuleRef> =
        engine.instances().filter(|module| is_sender(module) && engine.is_plugged_in(*module)).collect();
    let mut senders: Vec<Sender> =
        modules.into_iter().map(|module| Sender { module, link: 0, types: Vec::new() }).collect();
    for sender in &mut senders {
        let link = kinds.parameter(sender.module.kind, "CTX_LINK");
        if let Some(Ok(Value::Count(link))) = link.map(|index| engine.get(sender.module, index, 0)) {
            sender.link = usize::try_from(link).unwrap_or_default();
        }
        let types = kinds.parameter(sender.module.kind, "CTX_ADD_DATA");
        for command in engine.rebuild_commands() {
            if let Command::Set { module, parameter, value: Value::Type(signal), .. } = command
                && module == sender.module
                && Some(parameter) == types
            {
                sender.types.push(signal);
            }
        }
    }
    senders
}

fn message(
    dimsart: &mut Dimsart,
    side: &str,
    sender: &Sender,
    frames: FrameFormat,
) -> Result<Message, DbcError> {
    let module = dimsart.engine().kinds().module_name(sender.module).to_string();
    let side = side.to_owned();
    let Some(packet) = first_packet(dimsart, sender.link) else { return Err(DbcError::NoMessages { side }) };
    if packet.channel == 0 {
        return Err(DbcError::NoIdentifier { side, module });
    }
    let words = layout::words(dimsart.engine().device(), &sender.types, packet.words.len());
    let (bytes, most) = layout::limits(frames, words.len());
    if words.len() > most {
        return Err(DbcError::TooLong { side, module, words: words.len(), most });
    }
    let name = format!("{side}_{}", module.replace('.', "_"));
    let signals = layout::signals(frames, words);
    Ok(Message { identifier: packet.channel, name, sender: side, frames, bytes, signals })
}

/// Messages as a DBC file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Dbc {
    messages: Vec<Message>,
}

impl Dbc {
    /// Collects the messages of one bus.
    ///
    /// # Errors
    /// [`DbcError::DuplicateIdentifier`] for a duplicate identifier.
    pub fn new(messages: Vec<Message>) -> Result<Self, DbcError> {
        for (place, message) in messages.iter().enumerate() {
            let before = messages.iter().take(place);
            if let Some(same) = before.into_iter().find(|before| before.identifier == message.identifier) {
                let [one, other] = [&same.name, &message.name].map(Clone::clone);
                return Err(DbcError::DuplicateIdentifier { one, other, channel: message.identifier });
            }
        }
        Ok(Self { messages })
    }
}

impl Display for Dbc {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(f, "VERSION \"\"\n\nNS_ :\n\nBS_:\n")?;
        let mut nodes: Vec<&str> = self.messages.iter().map(|message| message.sender.as_str()).collect();
        nodes.dedup();
        writeln!(f, "BU_: {}\n", nodes.join(" "))?;
        for Message { identifier, name, sender, bytes, signals, .. } in &self.messages {
            writeln!(f, "BO_ {identifier} {name}: {bytes} {sender}")?;
            for signal in signals {
                writeln!(f, "{signal}")?;
            }
            writeln!(f)?;
        }
        writeln!(f, "{ATTRIBUTES}")?;
        if self.messages.iter().any(|message| message.frames == FrameFormat::CanFd) {
            writeln!(f, "BA_ \"BusType\" \"CAN FD\";")?;
        }
        for Message { identifier, frames, .. } in &self.messages {
            writeln!(f, "BA_ \"VFrameFormat\" BO_ {identifier} {};", frames.format())?;
        }
        for message in &self.messages {
            for signal in message.signals.iter().filter(|signal| signal.kind == NumberFormat::Real) {
                writeln!(f, "SIG_VALTYPE_ {} {} : 1;", message.identifier, signal.name)?;
            }
        }
        Ok(())
    }
}
