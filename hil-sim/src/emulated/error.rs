//! Errors of running firmware on the emulated board.

use std::io;
use std::path::PathBuf;
use std::process::ExitStatus;

use dimsart_link::exchange::{self, ExchangeError, MAX_FRAME_BYTES, MAX_PACKETS};
use dimsart_link::protocol::Refusal;

use super::BUILD_COMMAND;
use super::{PATIENCE, PROGRAM};

/// Error of running a controller on an emulated board.
#[derive(Debug, thiserror::Error)]
pub enum EmulatedError {
    /// Image not found.
    #[error("firmware image {} not found; build it with `{BUILD_COMMAND}`, or set its path with --image", path.display())]
    ImageNotFound {
        /// Path of the image.
        path: PathBuf,
    },
    /// Image not readable.
    #[error("cannot read firmware image {}: {source}; set another path with --image", path.display())]
    UnreadableImage {
        /// The image.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// Firmware of another version or board.
    #[error("{} is not an image of {wanted}; build the image with `{BUILD_COMMAND}`", path.display())]
    WrongImage {
        /// The image.
        path: PathBuf,
        /// Expected stamp.
        wanted: String,
    },
    /// Emulator not installed or not executable.
    #[error("cannot start the emulator {PROGRAM}: {0}; install it (Debian: `apt install qemu-system-arm`)")]
    EmulatorNotFound(io::Error),
    /// Cannot create the pipes.
    #[error(
        "cannot create the pipes of the emulated board: {0}; free space in the \
        temporary folder, or set TMPDIR to another folder"
    )]
    Files(io::Error),
    /// Timeout.
    #[error("emulated board timed out after {} s and was terminated{}", PATIENCE.as_secs(), last_words(.log))]
    Unresponsive {
        /// Last lines of the firmware's log.
        log: Vec<String>,
    },
    /// The emulator exited.
    #[error("the emulated board exited: {}{}", reason(.status), last_words(.log))]
    EmulatorExited {
        /// Exit status.
        status: Option<ExitStatus>,
        /// Last lines of the firmware's log.
        log: Vec<String>,
    },
    /// The firmware stopped by a panic, a fault or its watchdog.
    #[error(
        "the firmware on the emulated board stopped; last actuator commands: {}{}",
        at(.commanded),
        last_words(.log)
    )]
    Stopped {
        /// Last commands of the actuators; 0 is their safe state.
        commanded: Vec<f32>,
        /// Last lines of the firmware's log.
        log: Vec<String>,
    },
    /// Invalid frame.
    #[error("invalid answer of the emulated board: {0}; rebuild the image with `{BUILD_COMMAND}`")]
    InvalidFrame(#[from] ExchangeError),
    /// Another version of the exchange protocol.
    #[error(
        "the image uses {} of the exchange protocol, this command uses version {}; rebuild the image with `{BUILD_COMMAND}`",
        version(.found),
        exchange::VERSION
    )]
    Version {
        /// The image's version, if known.
        found: Option<u8>,
    },
    /// Firmware with other modules or types.
    #[error("image and command differ in {what}; rebuild the image with `{BUILD_COMMAND}`")]
    IncompatibleModules {
        /// The difference.
        what: String,
    },
    /// Different sample periods.
    #[error(
        "sample periods differ: board {board_s} s, scenario {scenario_s} s; set sample_period_s={board_s}"
    )]
    SamplePeriod {
        /// The board's, `s`.
        board_s: f32,
        /// The scenario's, `s`.
        scenario_s: f32,
    },
    /// Refused request.
    #[error("the board refused a part of the scheme that the host accepts: {0}")]
    Refused(Refusal),
    /// Missing or invalid answer to a request.
    #[error("no answer from the board within {ticks} ticks; rebuild the image with `{BUILD_COMMAND}`")]
    NoAnswer {
        /// Time waited, ticks.
        ticks: u32,
    },
    /// More packets than the exchange carries in one tick.
    #[error(
        "{found} packets in one tick, but an emulated board accepts at most {MAX_PACKETS} packets and \
        {MAX_FRAME_BYTES} bytes; lower link.jitter_ticks or link.duplication"
    )]
    TooManyPackets {
        /// Packets of all links.
        found: usize,
    },
    /// Unexpected size of a tick's data.
    #[error("the board sent {found} bytes of {what}, expected {expected}: the board's scheme has changed")]
    UnexpectedAnswer {
        /// Kind of data.
        what: &'static str,
        /// Bytes.
        expected: usize,
        /// Bytes.
        found: usize,
    },
}

fn version(found: &Option<u8>) -> String {
    found.map_or_else(|| "an unknown version".to_owned(), |version| format!("version {version}"))
}

/// The firmware's and the emulator's exit codes.
fn reason(status: &Option<ExitStatus>) -> String {
    match status.and_then(|status| status.code()) {
        Some(2) => "no host found (exit status 2)".to_owned(),
        Some(3) => "invalid data from this command (exit status 3)".to_owned(),
        Some(101) => "panic, fault or watchdog reset (exit status 101)".to_owned(),
        _ => status.map_or_else(|| "connection closed".to_owned(), |status| status.to_string()),
    }
}

fn at(commanded: &[f32]) -> String {
    // Compares bits, so that NaN counts as nonzero.
    if commanded.iter().all(|force| force.to_bits() == 0) {
        return "all 0".to_owned();
    }
    format!("{commanded:?}")
}

fn last_words(log: &[String]) -> String {
    if log.is_empty() {
        return "; the firmware's log is empty".to_owned();
    }
    log.iter().fold("; end of the firmware's log:".to_owned(), |text, line| format!("{text}\n  {line}"))
}
