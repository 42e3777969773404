//! Faults of a moteus joint.

use core::fmt;

use super::{MoteusFault, MoteusMode};

/// Offset of a mode number.
const MODE: u16 = 256;
const SILENT: u16 = 512;

/// Fault of a joint. Its number in a signal: 1 to 255 the drive's fault or limit, from 256 an unexpected mode under
/// command, 512 no replies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MoteusJointFault {
    /// Reported by the drive.
    Fault(MoteusFault),
    /// Unexpected mode under command: the drive turned off, or another host commands it.
    UnexpectedMode(MoteusMode),
    /// No replies.
    Silent,
}

impl MoteusJointFault {
    /// Converts the number of a signal; `None` for 0 and unknown numbers.
    #[must_use]
    pub fn from_number(number: u16) -> Option<Self> {
        match (u8::try_from(number), u8::try_from(number.wrapping_sub(MODE))) {
            (Ok(number), _) => MoteusFault::from_number(number).map(Self::Fault),
            (_, Ok(number)) => Some(Self::UnexpectedMode(MoteusMode::from_number(number))),
            _ => (number == SILENT).then_some(Self::Silent),
        }
    }

    /// Returns the number in a signal.
    #[must_use]
    pub fn number(self) -> u16 {
        match self {
            Self::Fault(fault) => fault.number().into(),
            Self::UnexpectedMode(mode) => MODE + u16::from(mode.number()),
            Self::Silent => SILENT,
        }
    }

    /// Returns the recommended action.
    #[must_use]
    pub fn remedy(self) -> &'static str {
        match self {
            Self::Fault(fault) => fault.remedy(),
            Self::UnexpectedMode(MoteusMode::Timeout) => "check bus and termination, or increase the timeout",
            Self::UnexpectedMode(_) => {
                "make sure no other program commands the drive, such as `moteus_tool` or `tview`"
            }
            Self::Silent => "check supply, `id.id`, wiring, termination and bit rates",
        }
    }
}

impl From<MoteusJointFault> for u32 {
    fn from(trouble: MoteusJointFault) -> Self {
        trouble.number().into()
    }
}

impl fmt::Display for MoteusJointFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fault(fault) => fault.fmt(f),
            Self::UnexpectedMode(mode) => write!(f, "unexpected mode: {mode} ({})", self.number()),
            Self::Silent => write!(f, "no reply ({SILENT})"),
        }
    }
}
