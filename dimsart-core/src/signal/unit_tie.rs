//! Ties between the units of a module's ports: a sum has the unit of what is added.

use crate::signal::unit::Unit;

/// How the unit of a port follows from the unit of another one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum UnitRelation {
    /// It is the same.
    Same,
    /// It is the other's times `s`.
    Integral,
    /// It is the other's over `s`.
    Derivative,
    /// It is the same, and so are format and shape.
    Alike,
}

impl UnitRelation {
    /// Whether a signal of unit `found` fits a port tied in this way to a signal of unit `other`. Any unit
    /// fits, and only that does where what follows from `other` has no name.
    #[must_use]
    pub fn admits(self, found: Unit, other: Unit) -> bool {
        let expected = match self {
            Self::Same | Self::Alike => Some(other),
            Self::Integral => other.integral(),
            Self::Derivative => other.derivative(),
        };
        expected.map_or(found == Unit::Any, |expected| expected.fits(found))
    }
}

/// Ties the unit of a port to that of another port of the same module; see [`Declare::tie`](crate::Declare::tie).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UnitTie {
    /// How the unit follows.
    pub relation: UnitRelation,
    /// Number of the port that it follows from.
    pub port: u8,
}
