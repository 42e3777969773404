//! Data types: name, unit, format and shape of signals.

use crate::signal::summary::Summary;
use crate::signal::unit::Unit;
use crate::signal::word::Format;

/// Number of words of a data type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Shape {
    /// One word.
    Scalar,
    /// One word per degree of freedom.
    Vector,
    /// `rows × columns` words, row by row.
    Matrix(u8, u8),
    /// One row and one column per degree of freedom, row by row, such as a joint-space inertia matrix.
    Square,
}

impl Shape {
    /// Returns the number of words on a device with `dof` degrees of freedom.
    #[must_use]
    pub const fn words(self, dof: usize) -> usize {
        match self {
            Self::Scalar => 1,
            Self::Vector => dof,
            Self::Matrix(rows, columns) => rows as usize * columns as usize,
            Self::Square => dof * dof,
        }
    }

    /// Returns row and column of a word, both from 0. In a vector and in a square the row is the axis.
    #[must_use]
    pub fn place(self, word: usize, dof: usize) -> (usize, usize) {
        let columns = match self {
            Self::Scalar | Self::Vector => 1,
            Self::Matrix(_, columns) => usize::from(columns),
            Self::Square => dof,
        };
        (word.checked_div(columns).unwrap_or(0), word.checked_rem(columns).unwrap_or(0))
    }
}

/// A data type of signals. It is in flash; the Data Base refers to it.
#[doc(alias = "data type")]
#[derive(Debug, PartialEq, Eq)]
pub struct DataType {
    /// Stable number, never reused. Below 0x8000 for the standard catalogue, from 0x8000 for a device's own
    /// types.
    pub id: u16,
    /// Name in schemes and reports, `UPPER_CASE`.
    pub name: &'static str,
    /// Physical unit.
    pub unit: Unit,
    /// Format of every word.
    pub format: Format,
    /// Rows and columns.
    pub shape: Shape,
    /// One sentence for help texts.
    pub summary: Summary,
}

impl DataType {
    /// Returns the first signal of this type.
    #[must_use]
    pub const fn first(&self) -> TypeRef {
        self.instance(1)
    }

    /// Returns the signal of this type with a number, from 1.
    #[must_use]
    pub const fn instance(&self, number: u8) -> TypeRef {
        TypeRef { id: self.id, number }
    }
}

/// One signal: a data type and an instance number, written `FORCE`, `FORCE.2`, ...
///
/// Several signals of one type can exist, for example the forces of two controllers before they are added.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TypeRef {
    /// [`DataType::id`].
    pub id: u16,
    /// Instance number; 1 for the plain name.
    pub number: u8,
}
