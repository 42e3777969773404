//! Fault of a joint, independent of the drive type.

use core::fmt;

use crate::{Cia402Trouble, MoteusTrouble};

/// Fault of a joint. The numbers of the drive types do not overlap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DriveTrouble {
    /// Fault of a moteus drive.
    Moteus(MoteusTrouble),
    /// Fault of a CiA 402 drive.
    Cia402(Cia402Trouble),
}

impl DriveTrouble {
    /// Converts the number of a signal; `None` for 0 and unknown numbers.
    #[must_use]
    pub fn from_number(number: u32) -> Option<Self> {
        let of_moteus = u16::try_from(number).ok().and_then(MoteusTrouble::from_number);
        of_moteus.map(Self::Moteus).or_else(|| Cia402Trouble::from_number(number).map(Self::Cia402))
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

impl From<MoteusTrouble> for DriveTrouble {
    fn from(trouble: MoteusTrouble) -> Self {
        Self::Moteus(trouble)
    }
}

impl From<Cia402Trouble> for DriveTrouble {
    fn from(trouble: Cia402Trouble) -> Self {
        Self::Cia402(trouble)
    }
}

impl From<DriveTrouble> for u32 {
    fn from(trouble: DriveTrouble) -> Self {
        match trouble {
            DriveTrouble::Moteus(trouble) => trouble.into(),
            DriveTrouble::Cia402(trouble) => trouble.into(),
        }
    }
}

impl fmt::Display for DriveTrouble {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Moteus(trouble) => trouble.fmt(f),
            Self::Cia402(trouble) => trouble.fmt(f),
        }
    }
}
