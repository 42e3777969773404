//! What a drive says of a bridge that is off.

use core::fmt;

use super::Reason;

/// Why a drive has turned its bridge off. Each is a [`Reason`].
///
/// None of them is made of zero bits, so that none at all is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum DriveFault {
    /// A phase has more than its trip current.
    Overcurrent = 1,
    /// The currents of the phases do not add up to nothing.
    CurrentSensors,
    /// The supply is too low.
    Undervoltage,
    /// The supply is too high.
    Overvoltage,
    /// Too hot, or the sensor is gone.
    Overtemperature,
    /// The encoder does not answer.
    EncoderLost,
    /// It says angles to which no rotor can have turned.
    EncoderJumped,
    /// Its magnet is gone, or at a wrong distance.
    EncoderMagnet,
    /// The rotor has stood still under current for too long.
    Stalled,
    /// The rotor turns faster than it may.
    Overspeed,
    /// Where the rotor's magnets are was not found.
    NotAligned,
    /// The current loop does not run.
    Silent,
    /// A drive on a bus does not answer, or does something else than it is commanded.
    Gone {
        /// Its axis, from 0.
        axis: u8,
    },
    /// The encoder's angle does not match the rotor's magnets.
    EncoderSlipped,
    /// The controlled currents oscillate.
    CurrentLoop,
}

impl DriveFault {
    /// Every one of a board's own drive.
    pub const ALL: [Self; 14] = [
        Self::Overcurrent,
        Self::CurrentSensors,
        Self::Undervoltage,
        Self::Overvoltage,
        Self::Overtemperature,
        Self::EncoderLost,
        Self::EncoderJumped,
        Self::EncoderMagnet,
        Self::Stalled,
        Self::Overspeed,
        Self::NotAligned,
        Self::Silent,
        Self::EncoderSlipped,
        Self::CurrentLoop,
    ];

    /// Its number and name, what it means and what to do.
    #[must_use]
    pub const fn reason(self) -> Reason {
        match self {
            Self::Overcurrent => Reason::Overcurrent,
            Self::CurrentSensors => Reason::CurrentSensors,
            Self::Undervoltage => Reason::Undervoltage,
            Self::Overvoltage => Reason::Overvoltage,
            Self::Overtemperature => Reason::Overtemperature,
            Self::EncoderLost => Reason::EncoderLost,
            Self::EncoderJumped => Reason::EncoderJumped,
            Self::EncoderMagnet => Reason::EncoderMagnet,
            Self::Stalled => Reason::Stalled,
            Self::Overspeed => Reason::Overspeed,
            Self::NotAligned => Reason::NotAligned,
            Self::Silent => Reason::DriveSilent,
            Self::EncoderSlipped => Reason::EncoderSlipped,
            Self::CurrentLoop => Reason::CurrentLoop,
            Self::Gone { .. } => Reason::DriveGone,
        }
    }

    /// The one of a reason, if it is one of a board's own drive.
    #[must_use]
    pub fn by_number(number: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|fault| fault.reason().number() == number)
    }
}

impl fmt::Display for DriveFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.reason().name())?;
        if let Self::Gone { axis } = self {
            write!(f, " of axis {axis}")?;
        }
        Ok(())
    }
}
