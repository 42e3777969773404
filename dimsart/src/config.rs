//! A controller's configuration as text: what its rows come to, what differs from the defaults, and from another one.
//!
//! ```text
//! rows, names ──▶ Configuration { modules, unknown } ──▶ deviations, differences
//! ```
//! Reading never fails: a row that is not understood, such as one for a module of a newer version, is kept as it is.

mod deviation;
mod difference;
mod reading;
mod text;
mod value;

pub use deviation::{Deviation, deviations};
pub use difference::{Change, ChangeKind, Difference};
pub use text::{first_side, text};
pub use value::Setting;

use serde::Serialize;

/// What the rows of a scheme come to.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Configuration {
    /// Modules: those that are plugged in, in their order, then the others.
    pub modules: Vec<Module>,
    /// Rows that are not understood.
    pub unknown: Vec<UnknownRow>,
}

/// A module and what was set of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Module {
    /// Name, such as `PDCTRL_MOD.2`.
    pub name: String,
    /// Whether it is plugged in.
    pub is_on: bool,
    /// Parameters that rows have set, as described, then ports that rows have bound.
    pub settings: Vec<Setting>,
}

/// A row that is not understood: it is of another version, or wrong.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct UnknownRow {
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1.
    pub column: usize,
    /// Its words.
    pub row: String,
    /// What is not understood of it.
    pub reason: String,
}
