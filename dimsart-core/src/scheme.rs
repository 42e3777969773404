//! Schemes: modules, bindings and parameters, as [text](Row) and as the engine keeps them.

pub(crate) mod command;
pub(crate) mod finding;
pub(crate) mod matching;
pub(crate) mod schedule;
pub(crate) mod stored;
pub(crate) mod wiring;

pub use crate::rows::*;
