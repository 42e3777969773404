//! Controllers as firmware on an emulated board, in lockstep with the simulated plants and links.
//!
//! ```text
//! Station ──▶ Board ──frames──▶ Emulator: FIFOs to a process, the firmware in it
//!   copy ◀── Layout: where the board's signals are in the copy's Data Base
//! ```
//! The scheme of a controller of this process is brought to the board by commands, so one image runs any scheme.
//! The controller stays as a copy that is looked at and never ticked: after each tick it holds the board's Data
//! Base. Who looks at a station need not know where its controller runs.
//!
//! The emulator needs FIFOs: on Unix systems only.

mod board;
mod emulator;
mod error;
mod image;
mod log;
mod process;
mod upload;

pub use board::Board;
pub use error::EmulatedError;
pub use image::{BOARD, BUILD, FOLDER_VARIABLE, Image};
