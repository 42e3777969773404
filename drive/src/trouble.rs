//! Why a joint does not do what it is commanded, whatever kind of drive it has.

use core::fmt;

use crate::{Cia402Trouble, MoteusTrouble};

/// What is wrong with a joint. Its numbers are those of the kinds of drives, which have none in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DriveTrouble {
    /// Of a moteus.
    Moteus(MoteusTrouble),
    /// Of a drive of CiA 402.
    Cia402(Cia402Trouble),
}

impl DriveTrouble {
    /// Of a number that a signal has; none for 0, and for what has no name.
    #[must_use]
    pub fn from_number(number: u32) -> Option<Self> {
        let of_moteus = u16::try_from(number).ok().and_then(MoteusTrouble::from_number);
        of_moteus.map(Self::Moteus).or_else(|| Cia402Trouble::from_number(number).map(Self::Cia402))
    }

    /// What to do about it.
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
