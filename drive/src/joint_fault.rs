//! Fault of a joint, independent of the drive type.

use core::fmt;

use crate::{Cia402JointFault, MoteusJointFault};

/// Fault of a joint. The numbers of the drive types do not overlap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointFault {
    /// Fault of a moteus drive.
    Moteus(MoteusJointFault),
    /// Fault of a CiA 402 drive.
    Cia402(Cia402JointFault),
}

impl JointFault {
    /// Converts the number of a signal; `None` for 0 and unknown numbers.
    #[must_use]
    pub fn from_number(number: u32) -> Option<Self> {
        let of_moteus = u16::try_from(number).ok().and_then(MoteusJointFault::from_number);
        of_moteus.map(Self::Moteus).or_else(|| Cia402JointFault::from_number(number).map(Self::Cia402))
    }

    /// Returns the recommended action.
    #[must_use]
    pub fn remedy(self) -> &'static str {
        match self {
            Self::Moteus(trouble) => trouble.remedy(),
            Self::Cia402(trouble) => trouble.remedy(),
        }
    }
}

impl From<MoteusJointFault> for JointFault {
    fn from(trouble: MoteusJointFault) -> Self {
        Self::Moteus(trouble)
    }
}

impl From<Cia402JointFault> for JointFault {
    fn from(trouble: Cia402JointFault) -> Self {
        Self::Cia402(trouble)
    }
}

impl From<JointFault> for u32 {
    fn from(trouble: JointFault) -> Self {
        match trouble {
            JointFault::Moteus(trouble) => trouble.into(),
            JointFault::Cia402(trouble) => trouble.into(),
        }
    }
}

impl fmt::Display for JointFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Moteus(trouble) => trouble.fmt(f),
            Self::Cia402(trouble) => trouble.fmt(f),
        }
    }
}
