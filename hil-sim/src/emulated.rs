//! Controllers as firmware on an emulated board, in lockstep with the simulated plants and links.
//!
//! ```text
//! Station ──▶ Board ──frames──▶ Emulator: pipes to a process, the firmware in it
//!   copy ◀── Layout: where the board's signals are in the copy's Data Base
//! ```
//! Commands upload the scheme of a controller of this process to the board, so that one image runs any scheme. The
//! controller remains as a copy that is never ticked: it mirrors the board's Data Base after each tick. Readers of a
//! station are independent of where its controller runs.
//!
//! The emulator inherits pipes as its line; boards are therefore available on Unix only.

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
mod wire;

use std::time::Duration;

pub use board::Board;
pub use emulator::terminate_emulators;
pub use error::EmulatedError;
pub use image::{Image, built};
pub use processor::pin_to_current_cpu;
pub use wire::BoardKey;

/// The emulated board, by the name of its image.
pub const BOARD: &str = "mps2-an386";
/// Folder of images, each named after its board and variant.
pub const IMAGE_FOLDER_VARIABLE: &str = "DIMSART_FIRMWARE";
/// Command that builds the image.
pub const BUILD_COMMAND: &str = "cargo board mps2-an386";

/// The emulator.
const PROGRAM: &str = "qemu-system-arm";
/// Timeout of an exchange, far above the time on a loaded machine.
const PATIENCE: Duration = Duration::from_secs(8);
/// Time of an instruction in the emulator.
const NS_PER_INSTRUCTION: u64 = 1 << 10;

/// Converts bytes to words.
fn words(bytes: &[u8]) -> impl Iterator<Item = u32> {
    bytes.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word))
}
