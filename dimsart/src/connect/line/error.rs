//! How long an answer is waited for, and why there is none.

use std::io::{self, ErrorKind};
use std::time::Duration;

use dimsart_link::protocol::PROTOCOL_VERSION;

/// How long an answer is waited for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Patience {
    /// For each try.
    pub timeout: Duration,
    /// How often a request is sent at most.
    pub tries: u32,
}

impl Default for Patience {
    fn default() -> Self {
        Self { timeout: Duration::from_millis(500), tries: 3 }
    }
}

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum LineError {
    /// Nothing that answers.
    #[error("no answer: sent {tries} times, waited {} s each; {}", timeout.as_secs_f64(), heard(*bytes, *frames))]
    NoAnswer {
        /// How often it was asked.
        tries: u32,
        /// For each try.
        timeout: Duration,
        /// Bytes that came since the line was opened.
        bytes: u64,
        /// Whole frames among them.
        frames: u32,
    },
    /// A command that must not be given twice, so it was sent once.
    #[error(
        "no answer to the command in {} s; the line lost it or its answer, so it may have been carried out: look with \
         `show` before you give it again",
        timeout.as_secs_f64()
    )]
    Unsure {
        /// How long was waited.
        timeout: Duration,
    },
    /// A version that this one does not know.
    #[error(
        "the device's answer is not understood: this command speaks protocol {PROTOCOL_VERSION} and the device another \
         one; use the `dimsart` that the image was built with"
    )]
    NotUnderstood,
    /// The other end is gone.
    #[error("the device closed the line: was it reset or unplugged, did the emulator end? Connect again")]
    Closed,
    /// Anything else.
    #[error("the line failed: {0}; check the cable and connect again")]
    Io(io::Error),
}

fn heard(bytes: u64, frames: u32) -> String {
    match (bytes, frames) {
        (0, _) => {
            "nothing came back at all: is the board powered, does it run a DIMSART image, is this the right \
                   port, are RX and TX crossed?"
                .to_owned()
        }
        (_, 0) => format!(
            "{bytes} bytes came back and no whole frame: give the image's own baud rate with --baud, or another port"
        ),
        _ => format!(
            "{frames} whole frames came before: the line loses bytes or another program reads them; wait longer with \
             --timeout-s"
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
