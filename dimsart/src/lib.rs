//! The `dimsart` command: runs experiments of [`hil_sim`], plots them, bounds the cost of images and talks to controllers.
//!
//! ```text
//!  hil_sim: Run { Outcome, Recording, Rig } ──▶ pictures ──▶ report: HTML, SVG, CSV, MCAP
//!  cycles:  image ──▶ cycles, stamp: cost of a tick and of each module
//!  a recording: signals.mcap ──▶ replay: identical bits, or the first difference
//!  rows of a scheme ──▶ config: differences from the defaults or from another scheme
//!  a board: Port ──▶ connect: requests, commands, telemetry; broker: many clients on one port
//!  a board: Port ──▶ commissioning: checks over the line, and their report
//! ```
//!
//! | To add | Write | Register it |
//! |---|---|---|
//! | a sub-command | a file in `cli/` | a line in [`cli`] |
//! | a picture | a [`Figure`](report::Figure) in [`pictures`] | nowhere: the report draws every figure of a run |
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
