//! Why a drive has turned its bridge off.

use core::fmt;

use super::Reason;

macro_rules! faults {
    ($($fault:ident $reason:ident,)*) => {
        /// Why a drive has turned its bridge off. Each is a [`Reason`], which has its number and its texts.
        ///
        /// None of them is made of zero bits, so that none at all is.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[repr(u8)]
        pub enum DriveFault {
            /// [`Reason::DriveGone`]: a drive on a bus.
            Gone {
                /// Its axis, from 0.
                axis: u8,
            } = Reason::DriveGone as u8,
            $(#[doc = concat!("[`Reason::", stringify!($reason), "`].")] $fault = Reason::$reason as u8,)*
        }

        impl DriveFault {
            /// Every one of a board's own drive.
            pub const ALL: &[Self] = &[$(Self::$fault),*];

            /// Its number and name, what it means and what to do.
            #[must_use]
            pub const fn reason(self) -> Reason {
                match self {
                    Self::Gone { .. } => Reason::DriveGone,
                    $(Self::$fault => Reason::$reason,)*
                }
            }
        }
    };
}

faults! {
    Overcurrent Overcurrent,
    CurrentSensors CurrentSensors,
    Undervoltage Undervoltage,
    Overvoltage Overvoltage,
    Overtemperature Overtemperature,
    EncoderLost EncoderLost,
    EncoderJumped EncoderJumped,
    EncoderMagnet EncoderMagnet,
    Stalled Stalled,
    Overspeed Overspeed,
    NotAligned NotAligned,
    Silent DriveSilent,
    EncoderSlipped EncoderSlipped,
    CurrentLoop CurrentLoop,
}

impl DriveFault {
    /// The one of a reason, if it is one of a board's own drive.
    #[must_use]
    pub fn by_number(number: u8) -> Option<Self> {
        Self::ALL.iter().find(|fault| fault.reason().number() == number).copied()
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
