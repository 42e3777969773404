//! Controllers as firmware on an emulated board, in lockstep with the simulated plants and links.
//!
//! ```text
//! Station ──▶ Board ──frames──▶ Emulator: pipes to a process, the firmware in it
//!   copy ◀── Layout: where the board's signals are in the copy's Data Base
//! ```
//! The scheme of a controller of this process is brought to the board by commands, so one image runs any scheme.
//! The controller stays as a copy that is looked at and never ticked: after each tick it holds the board's Data
//! Base. Who looks at a station need not know where its controller runs.
//!
//! The line to the emulator is made of pipes that it inherits: elsewhere than on Unix no board starts.

mod board;
#[cfg_attr(not(all(unix, feature = "emulated")), path = "emulated/no_emulator.rs")]
mod emulator;
mod error;
mod image;
#[cfg(all(unix, feature = "emulated"))]
mod log;
#[cfg(all(unix, feature = "emulated"))]
mod process;
mod processor;
mod upload;

use std::time::Duration;

pub use board::{Board, BoardKey};
pub use emulator::end_all;
pub use error::EmulatedError;
pub use image::{BOARD, BUILD, FOLDER_VARIABLE, Image, built};
pub use processor::share_one_processor;

/// The emulator.
const PROGRAM: &str = "qemu-system-arm";
/// Longest time that one exchange may take: far more than one takes on any loaded machine.
const PATIENCE: Duration = Duration::from_secs(8);
/// What an instruction takes in the emulator's time.
const NS_PER_INSTRUCTION: u64 = 1 << 10;
