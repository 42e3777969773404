//! Parses a controller's configuration from the rows of a scheme, and compares it with the defaults or another configuration.
//!
//! ```text
//! rows, names ──▶ Configuration { modules, unknown } ──▶ deviations, differences
//! ```
//! Reading never fails: an unknown row, such as for a module of a newer version, is kept as it is.

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

/// A configuration: the effect of a scheme's rows.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Configuration {
    /// Plugged-in modules in order, then unplugged modules.
    pub modules: Vec<Module>,
    /// Unknown rows.
    pub unknown: Vec<UnknownRow>,
}

/// A module and its settings.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Module {
    /// Name, such as `PDCTRL_MOD.2`.
    pub name: String,
    /// Whether it is plugged in.
    pub is_on: bool,
    /// Parameters set by rows, in the module's order, then ports bound by rows.
    pub settings: Vec<Setting>,
}

/// An unknown row: of another version, or invalid.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct UnknownRow {
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1.
    pub column: usize,
    /// Its words.
    pub row: String,
    /// Why it is unknown.
    pub reason: String,
}
