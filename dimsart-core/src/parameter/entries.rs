//! Number and arrangement of a parameter's values.

/// Rows and columns of a parameter's values, 0 for the number of axes. A command sets one entry by its index,
/// row by row, or all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ParameterShape {
    /// Rows; 0 for one per axis.
    pub rows: u8,
    /// Columns; 0 for one per axis.
    pub columns: u8,
}

impl ParameterShape {
    /// One value for all axes; or a list, to which each command appends an entry.
    pub const ONE: Self = Self { rows: 1, columns: 1 };
    /// One value per axis; the index is the axis: `K_PARAM[1]`.
    pub const AXES: Self = Self { rows: 0, columns: 1 };
    /// One row and one column per axis: `K[1][2]` has index `1 × axes + 2`.
    pub const SQUARE: Self = Self { rows: 0, columns: 0 };

    /// Returns rows and columns on a device with `dof` axes.
    #[must_use]
    pub const fn size(self, dof: u8) -> (u8, u8) {
        let Self { rows, columns } = self;
        (if rows == 0 { dof } else { rows }, if columns == 0 { dof } else { columns })
    }

    /// Returns the number of values.
    #[must_use]
    pub const fn count(self, dof: u8) -> u8 {
        let (rows, columns) = self.size(dof);
        rows.saturating_mul(columns)
    }

    /// Returns whether each axis has its own value.
    #[must_use]
    pub const fn is_per_axis(self) -> bool {
        self.rows == 0
    }

    /// Returns whether an entry is named by row and column.
    #[must_use]
    pub const fn is_matrix(self) -> bool {
        self.columns != 1 || self.rows > 1
    }

    /// Converts the indices after a name to an entry: `Some(None)` without indices (all entries), none for
    /// indices that the parameter does not have. An axis may exceed the last axis.
    #[must_use]
    pub fn place(self, indices: [Option<u8>; 2], dof: u8) -> Option<Option<u8>> {
        let (_, columns) = self.size(dof);
        match indices {
            [None, _] => Some(None),
            [axis, None] => (self == Self::AXES).then_some(axis),
            [Some(row), Some(column)] => {
                let place = row.saturating_mul(columns).saturating_add(column);
                (self.is_matrix() && column < columns).then_some(Some(place))
            }
        }
    }

    /// Splits an entry into its axis and the index within the axis, if the axis has several values. None if
    /// there is no such entry.
    pub(crate) fn split(self, place: u8, dof: u8) -> Option<(u8, Option<u8>)> {
        if self == Self::ONE || place >= self.count(dof) {
            return None;
        }
        let (_, columns) = self.size(dof);
        let axis = if self.is_per_axis() { place.checked_div(columns)? } else { 0 };
        let element = place.wrapping_sub(axis.wrapping_mul(columns));
        Some((axis, self.is_matrix().then_some(element)))
    }
}
