//! Timeouts of requests, and errors of a line.

use std::io::{self, ErrorKind};
use std::time::Duration;

use dimsart_link::protocol::PROTOCOL_VERSION;

/// Timeout and number of tries of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timeouts {
    /// Timeout of each try.
    pub timeout: Duration,
    /// Maximum number of tries.
    pub tries: u32,
}

impl Default for Timeouts {
    fn default() -> Self {
        Self { timeout: Duration::from_millis(500), tries: 3 }
    }
}

/// Error of a line.
#[derive(Debug, thiserror::Error)]
pub enum LineError {
    /// The device does not answer.
    #[error(
        "no answer from the device: request sent {tries} times, waited {} s each; {}",
        timeout.as_secs_f64(),
        heard(*bytes, *frames)
    )]
    NoAnswer {
        /// Number of tries.
        tries: u32,
        /// Timeout of each try.
        timeout: Duration,
        /// Bytes received since the line was opened.
        bytes: u64,
        /// Whole frames received.
        frames: u32,
    },
    /// No answer to a command that must not be repeated: it may have been carried out.
    #[error(
        "no answer to the command in {} s: the device may have executed the command; run `show` before you repeat it",
        timeout.as_secs_f64()
    )]
    OutcomeUnknown {
        /// Timeout.
        timeout: Duration,
    },
    /// The answer has another protocol version.
    #[error(
        "cannot decode the device's answer: its protocol version differs from {PROTOCOL_VERSION} of this program; use \
         the `dimsart` of the image's version"
    )]
    Unsupported,
    /// The peer closed the line.
    #[error("the device closed the line (reset, unplugged, or the emulator ended): connect again")]
    Closed,
    /// An input/output error.
    #[error("line error: {0}; check the cable and connect again")]
    Io(io::Error),
}

fn heard(bytes: u64, frames: u32) -> String {
    match (bytes, frames) {
        (0, _) => {
            "no bytes received: check the board's power, its DIMSART image, the port, and whether RX and TX are \
             crossed"
                .to_owned()
        }
        (_, 0) => format!(
            "{bytes} bytes received, but no whole frame: set the image's baud rate with --baud, or use another port"
        ),
        _ => format!(
            "{frames} whole frames received before: the line loses bytes or another program reads them; close other \
             programs, or increase --timeout-s"
        ),
    }
}

pub(super) fn too_long() -> LineError {
    LineError::Io(ErrorKind::InvalidInput.into())
}

pub(super) fn is_nothing_yet(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

pub(super) fn failed(error: io::Error) -> LineError {
    match error.kind() {
        ErrorKind::BrokenPipe | ErrorKind::ConnectionReset | ErrorKind::ConnectionAborted => {
            LineError::Closed
        }
        _ => LineError::Io(error),
    }
}
