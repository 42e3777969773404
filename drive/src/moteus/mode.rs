//! Modes of a drive.

use core::fmt;

/// Mode of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MoteusMode {
    /// All switches open.
    Stopped,
    /// Fault: off until a stop command.
    Fault,
    /// Preparing to operate, for some milliseconds.
    Preparing,
    /// Position mode, which follows torque commands.
    Position,
    /// Command timed out: ignores commands until a stop.
    Timeout,
    /// Any other mode, by its number; never commanded here.
    Other(u8),
}

impl MoteusMode {
    /// Converts the number of the mode register.
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

    /// Returns the number in the mode register; the first of three for [`Preparing`](Self::Preparing).
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
            Self::Fault => "fault",
            Self::Preparing => "preparing",
            Self::Position => "position",
            Self::Timeout => "timeout",
            Self::Other(5) => "PWM",
            Self::Other(6) => "voltage",
            Self::Other(7) => "voltage FOC",
            Self::Other(8 | 9) => "voltage DQ or current",
            Self::Other(12) => "zero velocity",
            Self::Other(13) => "stay within",
            Self::Other(14) => "measure inductance",
            Self::Other(15) => "brake",
            Self::Other(number) => return write!(f, "{number} (unknown)"),
        })
    }
}
