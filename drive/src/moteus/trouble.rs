//! Why a joint does not do what it is commanded, or not all of it.

use core::fmt;

use super::{MoteusFault, MoteusMode};

/// Added to the number of a mode.
const MODE: u16 = 256;
const SILENT: u16 = 512;

/// What is wrong with a joint. As a signal it is a number: 1 to 255 the drive's own fault or limit, 256 and more the mode
/// that it is in under command, 512 no replies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MoteusTrouble {
    /// The drive says so itself.
    Fault(MoteusFault),
    /// It is at something else under command: it went off, or somebody else commands it, too.
    Disobeys(MoteusMode),
    /// It does not reply.
    Silent,
}

impl MoteusTrouble {
    /// Of a number that a signal has; none for 0, and for what has no name.
    #[must_use]
    pub fn from_number(number: u16) -> Option<Self> {
        match (u8::try_from(number), u8::try_from(number.wrapping_sub(MODE))) {
            (Ok(number), _) => MoteusFault::from_number(number).map(Self::Fault),
            (_, Ok(number)) => Some(Self::Disobeys(MoteusMode::from_number(number))),
            _ => (number == SILENT).then_some(Self::Silent),
        }
    }

    /// As a signal has it.
    #[must_use]
    pub fn number(self) -> u16 {
        match self {
            Self::Fault(fault) => fault.number().into(),
            Self::Disobeys(mode) => MODE + u16::from(mode.number()),
            Self::Silent => SILENT,
        }
    }

    /// What to do about it.
    #[must_use]
    pub fn remedy(self) -> &'static str {
        match self {
            Self::Fault(fault) => fault.remedy(),
            Self::Disobeys(MoteusMode::Timeout) => {
                "see why no frame came to it: the bus, its termination, or a longer timeout"
            }
            Self::Disobeys(_) => "let nobody else command it, such as `moteus_tool` or `tview`",
            Self::Silent => "look at its supply, its `id.id`, the bus's wires, termination and bit rates",
        }
    }
}

impl From<MoteusTrouble> for u32 {
    fn from(trouble: MoteusTrouble) -> Self {
        trouble.number().into()
    }
}

impl fmt::Display for MoteusTrouble {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fault(fault) => fault.fmt(f),
            Self::Disobeys(mode) => write!(f, "under command it is {mode} ({})", self.number()),
            Self::Silent => write!(f, "it does not reply ({SILENT})"),
        }
    }
}
