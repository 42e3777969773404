//! Unit ties: relations between the units of a module's ports, such as a sum and its terms.

use crate::signal::unit::Unit;

/// Relation of a port's unit to the unit of another port.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum UnitRelation {
    /// The same unit.
    Same,
    /// The other unit times `s`.
    Integral,
    /// The other unit divided by `s`.
    Derivative,
    /// The same unit, format and shape.
    SameType,
}

impl UnitRelation {
    /// Returns whether unit `found` fits a port tied in this way to unit `other`. [`Unit::Any`] always fits,
    /// and is the only fit if the list has no unit for the relation.
    #[must_use]
    pub fn accepts(self, found: Unit, other: Unit) -> bool {
        let expected = match self {
            Self::Same | Self::SameType => Some(other),
            Self::Integral => other.integral(),
            Self::Derivative => other.derivative(),
        };
        expected.map_or(found == Unit::Any, |expected| expected.matches(found))
    }
}

/// Tie between the units of two ports of a module; see [`Declarations::constrain_unit`](crate::Declarations::constrain_unit).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UnitConstraint {
    /// Relation of the units.
    pub relation: UnitRelation,
    /// Number of the other port.
    pub port: u8,
}
