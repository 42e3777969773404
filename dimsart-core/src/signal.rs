//! Signals: words, formats, units and data types.

pub(crate) mod data_type;
pub(crate) mod summary;
pub mod types;
pub(crate) mod unit;
pub(crate) mod unit_tie;
pub(crate) mod word;
pub mod words;
