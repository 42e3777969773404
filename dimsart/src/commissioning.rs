//! The first hour with a board: what can be checked over its line, check by check, and a report of it.
//!
//! ```text
//! examine        looks alone: no lease, nothing moves                     dimsart doctor --board
//!   + watch_ticks, save_and_restart, LockedRotor ──▶ Report: Markdown, JSON    dimsart commission
//! ```
//! Where an emulated chip is in the board's place, the time is the chip's: [`Surroundings`] say what it is.

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
pub use surroundings::{Computer, Surroundings};
pub use ticks::watch_ticks;
