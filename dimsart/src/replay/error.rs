//! Errors of a replay.

use std::path::PathBuf;

use dimsart_core::{DescriptorError, StorageError};

/// Error of a replay.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The file is missing or cannot be read.
    #[error("cannot read {}: {source}; give the path of a recording (MCAP)", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// The file is not an MCAP file.
    #[error("{} is not an MCAP file; use the signals.mcap of `dimsart run` or `dimsart serve`", path.display())]
    NotMcap {
        /// The file.
        path: PathBuf,
    },
    /// The file is damaged.
    #[error("{} is damaged at byte {byte}: {reason}; replay another copy", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Start of the record.
        byte: u64,
        /// The error.
        reason: String,
    },
    /// The file has no controller inputs.
    #[error(
        "{} contains signals but no controller inputs: record with `dimsart run --signals mcap` or `dimsart serve --record` \
         (recordings of `dimsart record` cannot be replayed)",
        path.display()
    )]
    NoInputs {
        /// The file.
        path: PathBuf,
    },
    /// The file has no signals of this program.
    #[error("{} contains no signals of dimsart: use the signals.mcap of `dimsart run`, `serve` or `record`", path.display())]
    NoSignals {
        /// The file.
        path: PathBuf,
    },
    /// The inputs have another format.
    #[error(
        "the recording has the input format of another dimsart version: replay with the version that recorded the \
         file"
    )]
    OtherInputs,
    /// A controller's device or scheme is missing in the file.
    #[error("the recording does not contain {what} of the controller {controller}: use another copy")]
    MissingData {
        /// The controller.
        controller: String,
        /// Missing attachment.
        what: &'static str,
    },
    /// The device of a controller cannot be decoded.
    #[error(
        "cannot decode the device of controller {controller}: {source}; replay with the version that recorded the \
         file"
    )]
    Device {
        /// The controller.
        controller: String,
        /// The error.
        source: serde_json::Error,
    },
    /// The device of a controller is invalid.
    #[error("the device of controller {controller} is invalid: {error}")]
    Descriptor {
        /// The controller.
        controller: String,
        /// The error.
        error: DescriptorError,
    },
    /// The device of a controller exceeds a limit.
    #[error("the device of controller {controller} exceeds a limit: {error:?}")]
    Storage {
        /// The controller.
        controller: String,
        /// The error.
        error: StorageError,
    },
    /// The scheme of a controller does not run.
    #[error("the scheme of controller {controller} does not run in this version:\n  {problems}")]
    Scheme {
        /// The controller.
        controller: String,
        /// Problems, one per line.
        problems: String,
    },
    /// The replay refuses a recorded command.
    #[error(
        "controller {controller} refuses a recorded command at {time_s} s: {reason}; replay with the version that \
         recorded the file"
    )]
    Command {
        /// The controller.
        controller: String,
        /// Time of the next tick, `s`.
        time_s: f64,
        /// Reason.
        reason: String,
    },
}
