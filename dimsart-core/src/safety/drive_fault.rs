//! Faults of a drive.

use core::fmt;

use super::SafetyReason;

macro_rules! faults {
    ($($fault:ident $reason:ident,)*) => {
        /// Fault of a drive, which has switched its bridge off. Each maps to a [`SafetyReason`] with number and
        /// texts.
        ///
        /// The values are not zero, so that `Option<DriveFault>` is all zero bits for none.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[repr(u8)]
        pub enum DriveFault {
            /// [`SafetyReason::DriveGone`]: the fault of a drive on a bus.
            NoResponse {
                /// Axis, from 0.
                axis: u8,
            } = SafetyReason::DriveGone as u8,
            $(#[doc = concat!("[`SafetyReason::", stringify!($reason), "`].")] $fault = SafetyReason::$reason as u8,)*
        }

        impl DriveFault {
            /// All faults of a board's own drive.
            pub const ALL: &[Self] = &[$(Self::$fault),*];

            /// Returns the reason, which has number, name and texts.
            #[must_use]
            pub const fn reason(self) -> SafetyReason {
                match self {
                    Self::NoResponse { .. } => SafetyReason::DriveGone,
                    $(Self::$fault => SafetyReason::$reason,)*
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
    /// Finds the fault of a board's own drive by its reason number.
    #[must_use]
    pub fn from_number(number: u8) -> Option<Self> {
        Self::ALL.iter().find(|fault| fault.reason().number() == number).copied()
    }
}

impl fmt::Display for DriveFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.reason().name())?;
        if let Self::NoResponse { axis } = self {
            write!(f, " of axis {axis}")?;
        }
        Ok(())
    }
}
