//! Why firmware does not run on the emulated board: what is wrong and what to do next.

use std::io;
use std::path::PathBuf;
use std::process::ExitStatus;

use dimsart_link::exchange::{self, ExchangeError, MAX_FRAME_BYTES, MAX_PACKETS};
use dimsart_link::protocol::Refusal;

use super::image::BUILD;
use super::{PATIENCE, PROGRAM};

/// Why a controller does not run, or no longer runs, on an emulated board.
#[derive(Debug, thiserror::Error)]
pub enum EmulatedError {
    /// Nothing to run.
    #[error("there is no firmware image {}; build it with `{BUILD}`, or give its path with --image", path.display())]
    NoImage {
        /// Where it was looked for.
        path: PathBuf,
    },
    /// A file that cannot be read.
    #[error("cannot read the firmware image {}: {source}; give another path with --image", path.display())]
    Image {
        /// The image.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// Something else than this version's firmware for this board.
    #[error("{} is no image of {wanted}; build one with `{BUILD}`", path.display())]
    WrongImage {
        /// The image.
        path: PathBuf,
        /// What it should call itself.
        wanted: String,
    },
    /// No emulator.
    #[error(
        "the emulator {PROGRAM} does not start: {0}; install it (Debian: `apt install qemu-system-arm`) and try again"
    )]
    NoEmulator(io::Error),
    /// The folder or the files in it that the board is reached by.
    #[error(
        "cannot make the files to reach the emulated board by: {0}; free space in the system's folder for \
             temporary files or set TMPDIR"
    )]
    Files(io::Error),
    /// It stopped answering.
    #[error("the emulated board has not answered for {} s and was ended{}", PATIENCE.as_secs(), last_words(.log))]
    Hung {
        /// The last of what the firmware logged.
        log: Vec<String>,
    },
    /// It ended.
    #[error("the emulated board ended: {}{}", reason(.status), last_words(.log))]
    Ended {
        /// How.
        status: Option<ExitStatus>,
        /// The last of what the firmware logged.
        log: Vec<String>,
    },
    /// Its firmware stopped by a panic, a fault or its watchdog.
    #[error("the firmware on the emulated board stopped, its actuators {}{}", at(.commanded), last_words(.log))]
    Stopped {
        /// What its actuators are left with: 0 in their safe state.
        commanded: Vec<f32>,
        /// The last of what the firmware logged.
        log: Vec<String>,
    },
    /// What it says is no frame.
    #[error("the emulated board answers with {0}; build the image anew with `{BUILD}`")]
    Exchange(#[from] ExchangeError),
    /// Firmware of another version.
    #[error(
        "the image speaks {} of the exchange and this command version {}; build the image anew with `{BUILD}`",
        version(.found),
        exchange::VERSION
    )]
    Version {
        /// The image's, if it says one.
        found: Option<u8>,
    },
    /// Firmware with other modules or types.
    #[error("the image has another {what} than this command; build the image anew with `{BUILD}`")]
    OtherLibrary {
        /// What differs.
        what: String,
    },
    /// Firmware of another sample period.
    #[error(
        "the board ticks every {board_s} s and the scenario every {scenario_s} s; set sample_period_s={board_s}"
    )]
    SamplePeriod {
        /// The board's, `s`.
        board_s: f32,
        /// The scenario's, `s`.
        scenario_s: f32,
    },
    /// A request that is not carried out.
    #[error("the board refuses a part of the scheme that runs on the host: {0}")]
    Refused(Refusal),
    /// A request that is not answered, or by something else.
    #[error("the board does not answer a request in {ticks} ticks; build the image anew with `{BUILD}`")]
    NoAnswer {
        /// How long was waited.
        ticks: u32,
    },
    /// More packets than the exchange carries.
    #[error(
        "{found} packets came in one tick, and an emulated board takes {MAX_PACKETS} or what {MAX_FRAME_BYTES} bytes \
             hold; lower link.jitter_ticks or link.duplication"
    )]
    TooManyPackets {
        /// Packets of all links.
        found: usize,
    },
    /// A tick that brings something else than asked for.
    #[error(
        "the board's tick brings {found} bytes of {what} and not {expected}: its scheme was changed meanwhile"
    )]
    OtherAnswer {
        /// Of what.
        what: &'static str,
        /// Bytes.
        expected: usize,
        /// Bytes.
        found: usize,
    },
}

fn version(found: &Option<u8>) -> String {
    found.map_or_else(|| "no version".to_owned(), |version| format!("version {version}"))
}

/// The firmware's and the emulator's exit codes.
fn reason(status: &Option<ExitStatus>) -> String {
    match status.and_then(|status| status.code()) {
        Some(2) => "it found no host (exit status 2)".to_owned(),
        Some(3) => "it refused what this command sent (exit status 3)".to_owned(),
        Some(101) => "its firmware stopped by a panic, a fault or its watchdog (exit status 101)".to_owned(),
        _ => status.map_or_else(|| "it closed its line".to_owned(), |status| status.to_string()),
    }
}

fn at(commanded: &[f32]) -> String {
    // Not equal to 0 is NaN, too.
    if commanded.iter().all(|force| force.to_bits() == 0) {
        return "at rest".to_owned();
    }
    format!("not at rest, but commanded {commanded:?}")
}

fn last_words(log: &[String]) -> String {
    if log.is_empty() {
        return ", without a word".to_owned();
    }
    log.iter().fold("; its last words:".to_owned(), |text, line| format!("{text}\n  {line}"))
}
