//! What a host asks about the laws that a controller keeps.

use serde::{Deserialize, Serialize};

/// What is asked of the programs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum LawAction {
    /// How the place of this number stands, from 1.
    Look {
        /// The place.
        number: u8,
    },
    /// Words of the program in this place, from one of them on.
    Read {
        /// The place.
        number: u8,
        /// First word wanted; at most 32 come at a time.
        from: u8,
    },
}
