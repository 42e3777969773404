//! Schemes: modules, bindings and parameters, as [text](Row) and in the engine.

pub(crate) mod command;
pub(crate) mod finding;
pub(crate) mod matching;
pub(crate) mod schedule;
pub(crate) mod stored;
pub(crate) mod wiring;

pub(crate) use command::{Command, CommandError, EngineCommand};
pub(crate) use finding::{Endpoint, Finding};
pub(crate) use matching::{CheckReport, MatchingCheck};
pub(crate) use stored::{Instance, Scheme, Schemes};
pub(crate) use wiring::{ActiveModule, Call, New, Port, Wiring};

pub use crate::rows::*;
