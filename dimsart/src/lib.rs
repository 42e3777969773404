//! The `dimsart` command: runs experiments of [`hil_sim`] and draws them, bounds what images take, talks to controllers.
//!
//! ```text
//!  hil_sim: Run { Outcome, Recording, Rig } ──▶ pictures ──▶ report: HTML, PNG, SVG, CSV, MCAP
//!  cycles:  image ──▶ cycles, stamp: what a tick and a module take
//!  a recording: signals.mcap ──▶ replay: the same bits, or where they part
//!  rows of a scheme ──▶ config: what differs from the defaults, or from another one
//!  a board: Port ──▶ connect: questions, commands, telemetry; broker: one port for many clients
//!  a board: Port ──▶ commissioning: what can be checked over its line, and a report of it
//! ```
//!
//! | To add | Write | Register it |
//! |---|---|---|
//! | a sub-command | a file in `cli/` | a line in [`cli`] |
//! | a picture | a [`Figure`](report::Figure) in [`pictures`] | nowhere else: the report draws what it is given |
#![forbid(unsafe_code)]

#[cfg(feature = "zenoh")]
pub mod bridge;
pub mod broker;
pub mod budget;
mod cdr;
pub mod cli;
pub mod commissioning;
pub mod config;
pub mod connect;
pub mod cycles;
pub mod dbc;
pub mod motor;
pub mod page;
pub mod pictures;
pub mod recorder_files;
pub mod replay;
pub mod report;
pub mod rig_argument;
pub mod stamp;
pub mod sweep;
mod tap_file;
pub mod tick_map;
mod top;
