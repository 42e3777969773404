//! Why a rig cannot be set up: what is wrong, where, and what to do next.

use dimsart_core::{DescriptorError, StorageError};

use super::motion::SamplesError;
use crate::bus::DelayFileError;
use crate::emulated::EmulatedError;
use crate::plant::ParameterError;
use crate::recorder::UnknownSignal;
use crate::schemes::{Loaded, SchemeFileError};

/// Why a rig could not be set up.
#[derive(Debug, thiserror::Error)]
pub enum ResponseError {
    /// The device cannot exist.
    #[error("device '{device}': {error}")]
    Device {
        /// The device.
        device: String,
        /// What is wrong.
        error: DescriptorError,
    },
    /// The device's types do not fit.
    #[error("the device's types do not fit into the Data Base: {0:?}")]
    Storage(StorageError),
    /// A plant's parameter.
    #[error("device '{device}', axis {axis}: {error}")]
    Plant {
        /// The device.
        device: String,
        /// The axis.
        axis: usize,
        /// What is wrong.
        error: ParameterError,
    },
    /// The scheme cannot be read.
    #[error(transparent)]
    SchemeFile(#[from] SchemeFileError),
    /// A law that cannot be read, is wrong, or is one too many.
    #[error("the controller '{controller}': {what}")]
    Law {
        /// The controller.
        controller: String,
        /// What is wrong.
        what: String,
    },
    /// The scheme does not run on this device.
    #[error(
        "the scheme {name} does not run on the controller '{controller}':\n{}",
        loaded.problems().map(|problem| format!("  {problem}")).collect::<Vec<_>>().join("\n")
    )]
    Scheme {
        /// The scheme.
        name: String,
        /// The controller.
        controller: String,
        /// What is wrong.
        loaded: Loaded,
    },
    /// A file that something moves by.
    #[error(transparent)]
    Samples(#[from] SamplesError),
    /// A link over a CAN bus whose receiver listens to no channel.
    #[error(
        "the link from '{from}' to '{to}' goes over a CAN bus without a channel: give the sender a CTX_CHANNEL and the \
         receiver the same CRX_CHANNEL, 1 to 2047"
    )]
    NoChannel {
        /// The controller that sends.
        from: String,
        /// The controller that receives.
        to: String,
    },
    /// Two links over one CAN bus have the same channel.
    #[error(
        "the links to '{first}' and to '{second}' go over one CAN bus on channel {channel}: give each a CTX_CHANNEL and \
         CRX_CHANNEL of its own"
    )]
    SameChannel {
        /// The channel.
        channel: u16,
        /// The controller that receives by the first one in the file.
        first: String,
        /// The one that receives by the other one.
        second: String,
    },
    /// Recorded delays of a bus.
    #[error(transparent)]
    Delays(#[from] DelayFileError),
    /// The emulated board of a device.
    #[error("device '{device}': {source}")]
    Emulated {
        /// The device.
        device: String,
        /// What went wrong.
        source: EmulatedError,
    },
    /// What `record.signals` names.
    #[error(transparent)]
    Record(#[from] UnknownSignal),
}
