//! What a drive is at.

use core::fmt;

/// A drive's mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MoteusMode {
    /// All switches are open.
    Stopped,
    /// It found a fault, and is off until it is stopped.
    Fault,
    /// It makes itself ready, for some milliseconds.
    Preparing,
    /// It obeys commands of torque.
    Position,
    /// A command's timeout has run out; it obeys nothing until it is stopped.
    Timeout,
    /// Any other, by its number: nothing that was commanded here.
    Other(u8),
}

impl MoteusMode {
    /// Of the number that the drive has for it.
    #[must_use]
    pub fn from_number(number: u8) -> Self {
        match number {
            0 => Self::Stopped,
            1 => Self::Fault,
            2..=4 => Self::Preparing,
            10 => Self::Position,
            11 => Self::Timeout,
            other => Self::Other(other),
        }
    }

    /// The number that the drive has for it; of the three of [`Preparing`](Self::Preparing) the first.
    #[must_use]
    pub fn number(self) -> u8 {
        match self {
            Self::Stopped => 0,
            Self::Fault => 1,
            Self::Preparing => 2,
            Self::Position => 10,
            Self::Timeout => 11,
            Self::Other(number) => number,
        }
    }
}

impl fmt::Display for MoteusMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Stopped => "stopped",
            Self::Fault => "off with a fault",
            Self::Preparing => "preparing to operate",
            Self::Position => "under torque",
            Self::Timeout => "timed out",
            Self::Other(5) => "pulse-width modulation",
            Self::Other(6) => "phase voltages",
            Self::Other(7) => "a turning voltage",
            Self::Other(8 | 9) => "voltages or currents of d and q",
            Self::Other(12) => "braking to no velocity",
            Self::Other(13) => "staying within bounds",
            Self::Other(14) => "measuring the inductance",
            Self::Other(15) => "braking by shorted phases",
            Self::Other(number) => return write!(f, "mode {number}, which is unknown here"),
        })
    }
}
