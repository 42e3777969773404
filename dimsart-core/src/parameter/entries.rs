//! How many values a parameter has.

/// How many values a parameter has: rows and columns, 0 for as many as the device has axes. A command names one of them
/// by its place, row by row, or sets all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Entries {
    /// Rows; 0 for one per axis.
    pub rows: u8,
    /// Columns; 0 for one per axis.
    pub columns: u8,
}

impl Entries {
    /// One for all axes; or a list, to which each command adds an entry.
    pub const ONE: Self = Self { rows: 1, columns: 1 };
    /// One for each axis, whose number is its place: `K_PARAM[1]`.
    pub const AXES: Self = Self { rows: 0, columns: 1 };
    /// A row for each axis and a column for each: `K[1][2]` has place `1 × axes + 2`.
    pub const SQUARE: Self = Self { rows: 0, columns: 0 };

    /// Rows and columns on a device of `dof` axes.
    #[must_use]
    pub const fn size(self, dof: u8) -> (u8, u8) {
        let Self { rows, columns } = self;
        (if rows == 0 { dof } else { rows }, if columns == 0 { dof } else { columns })
    }

    /// Number of values.
    #[must_use]
    pub const fn count(self, dof: u8) -> u8 {
        let (rows, columns) = self.size(dof);
        rows.saturating_mul(columns)
    }

    /// Whether each axis has its own.
    #[must_use]
    pub const fn are_of_axes(self) -> bool {
        self.rows == 0
    }

    /// Whether an entry is named by its row and its column.
    #[must_use]
    pub const fn are_matrix(self) -> bool {
        self.columns != 1 || self.rows > 1
    }

    /// The place that the indices behind a name stand for, none of it for all entries; none for indices that the
    /// parameter does not have. An axis can be beyond the last one.
    #[must_use]
    pub fn place(self, indices: [Option<u8>; 2], dof: u8) -> Option<Option<u8>> {
        let (_, columns) = self.size(dof);
        match indices {
            [None, _] => Some(None),
            [axis, None] => (self == Self::AXES).then_some(axis),
            [Some(row), Some(column)] => {
                let place = row.saturating_mul(columns).saturating_add(column);
                (self.are_matrix() && column < columns).then_some(Some(place))
            }
        }
    }

    /// The axis whose values hold the entry at `place`, and its number among them if there are several; none where
    /// there is no entry that a place names.
    pub(crate) fn split(self, place: u8, dof: u8) -> Option<(u8, Option<u8>)> {
        if self == Self::ONE || place >= self.count(dof) {
            return None;
        }
        let (_, columns) = self.size(dof);
        let axis = if self.are_of_axes() { place.checked_div(columns)? } else { 0 };
        let element = place.wrapping_sub(axis.wrapping_mul(columns));
        Some((axis, self.are_matrix().then_some(element)))
    }
}
