//! Why a recording cannot be run again.

use std::path::PathBuf;

use dimsart_core::{DescriptorError, StorageError};

/// Why a recording cannot be run again.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// It is not there, or not to be read.
    #[error("cannot read {}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// It does not begin as an MCAP file.
    #[error("{} is not an MCAP file; give a signals.mcap of `dimsart run` or `serve`", path.display())]
    NotMcap {
        /// The file.
        path: PathBuf,
    },
    /// A part of it is not as it was written.
    #[error("{} is damaged at byte {byte}: {reason}; replay another copy of it", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Where the record begins.
        byte: u64,
        /// What is wrong.
        reason: String,
    },
    /// Nothing is in it that went into a controller.
    #[error(
        "{} has signals, and not what went into the controllers: `dimsart run --signals mcap` and `dimsart serve --record` \
         record both; what is recorded over a line, as by `dimsart record`, cannot be replayed",
        path.display()
    )]
    NoInputs {
        /// The file.
        path: PathBuf,
    },
    /// A message of inputs is of another form.
    #[error(
        "the inputs are of a version of dimsart that writes them otherwise: replay with the one that recorded them"
    )]
    OtherInputs,
    /// What a controller was is not in it.
    #[error("the file lacks {what} of the controller {controller}")]
    Lacking {
        /// The controller.
        controller: String,
        /// A name of an attachment.
        what: &'static str,
    },
    /// Its device cannot be understood.
    #[error(
        "the device of {controller} is not understood: {source}; replay with the version that recorded it"
    )]
    Device {
        /// The controller.
        controller: String,
        /// What is wrong.
        source: serde_json::Error,
    },
    /// Its device cannot be.
    #[error("the device of {controller} cannot be here: {error}")]
    Descriptor {
        /// The controller.
        controller: String,
        /// What is wrong.
        error: DescriptorError,
    },
    /// Its device does not fit.
    #[error("the device of {controller} does not fit: {error:?}")]
    Storage {
        /// The controller.
        controller: String,
        /// What is wrong.
        error: StorageError,
    },
    /// Its scheme does not run here.
    #[error("the scheme of {controller} does not run here:\n  {problems}")]
    Scheme {
        /// The controller.
        controller: String,
        /// Everything that is wrong, a line each.
        problems: String,
    },
    /// A command that was carried out is not carried out here.
    #[error(
        "{controller} refuses a command at {time_s} s that it carried out: {reason}; replay with the version that recorded it"
    )]
    Command {
        /// The controller.
        controller: String,
        /// Time of the tick behind it, `s`.
        time_s: f64,
        /// Why.
        reason: String,
    },
}
