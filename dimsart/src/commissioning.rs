//! Checks a board over its line, and writes a report.
//!
//! ```text
//! examine        reads only: no lease, no motion                          dimsart doctor --board
//!   + observe_ticks, save_and_restart, LockedRotor ──▶ Report: Markdown, JSON    dimsart commission
//! ```
//! [`BoardEnvironment`] provide the time, which is simulated for an emulated chip, and the restart of the board.

mod at_rest;
mod check;
mod examination;
mod jitter;
mod locked_rotor;
mod report;
mod saving;
mod surroundings;
mod ticks;

pub use check::{Check, Verdict};
pub use examination::examine;
pub use jitter::Histogram;
pub use locked_rotor::{LockedRotor, Step};
pub use report::Report;
pub use saving::save_and_restart;
pub use surroundings::{BoardEnvironment, HostComputer};
pub use ticks::observe_ticks;
