//! Why an experiment cannot be set up or run: what is wrong, where, and what to do next.

use dimsart_core::{DescriptorError, StorageError};

use crate::bus::DelayFileError;
use crate::key_file::KeyFileError;
use crate::link::{Address, OpenError};
use crate::motion::SamplesError;
use crate::plant::ParameterError;
use crate::recorder::UnknownSignal;
use crate::rig::{AuthenticationFailure, RemoteError};
use crate::schemes::{Loaded, SchemeFileError};

/// Why an experiment could not be set up or run.
#[derive(Debug, thiserror::Error)]
pub enum ExperimentError {
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
    #[error("{place}: {error}")]
    Plant {
        /// Which plant.
        place: String,
        /// What is wrong.
        error: ParameterError,
    },
    /// The scheme cannot be read.
    #[error(transparent)]
    SchemeFile(#[from] SchemeFileError),
    /// The scheme does not run on this controller.
    #[error("the scheme {name} does not run on {controller}:\n{}", list(loaded))]
    Scheme {
        /// The scheme.
        name: String,
        /// The controller.
        controller: String,
        /// What is wrong.
        loaded: Loaded,
    },
    /// A law that cannot be read, is invalid, or is one too many.
    #[error("the controller '{controller}': {what}")]
    Law {
        /// The controller.
        controller: String,
        /// What is wrong.
        what: String,
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
    /// Recorded delays of a network.
    #[error(transparent)]
    Delays(#[from] DelayFileError),
    /// What `record.signals` names.
    #[error(transparent)]
    Record(#[from] UnknownSignal),
    /// The side's link to another process.
    #[error(
        "{source}, or give another one with --set link.{name}_address=IP:PORT (of both sides), serial:PATH or \
         can:INTERFACE"
    )]
    Link {
        /// Whose address it is.
        name: String,
        /// What is wrong with it.
        source: OpenError,
    },
    /// A station that cannot run alone.
    #[error("the controller '{name}' has no link with an address each way: give both links an `address`")]
    NoAddress {
        /// The controller.
        name: String,
    },
    /// The other process does not answer.
    #[error(
        "nothing came from the {other} at {peer} in {waited_s} s; start it with `dimsart run --side {other}` and the \
         same scenario, or wait longer with --wait-s"
    )]
    NoPeer {
        /// Where it should be.
        peer: Address,
        /// How long was waited, `s`.
        waited_s: f64,
        /// The other side's name.
        other: String,
    },
    /// The key cannot be read.
    #[error(transparent)]
    KeyFile(#[from] KeyFileError),
    /// Nothing to make a nonce of.
    #[error("the system gives no random numbers, which link.key_file takes: {0}")]
    NoRandomness(#[from] getrandom::Error),
    /// What the other process sends cannot be trusted.
    #[error(
        "what came from the {other} at {peer} was refused: {reason}; give both sides the same link.key_file"
    )]
    AuthenticationFailure {
        /// Where it is.
        peer: Address,
        /// The other side's name.
        other: String,
        /// Why.
        reason: AuthenticationFailure,
    },
    /// The other process sends something else.
    #[error(
        "what came from the {other} at {peer} is not what this side's scheme expects; give both sides the same \
         scenario (dof, schemes)"
    )]
    WrongPeer {
        /// Where it is.
        peer: Address,
        /// The other side's name.
        other: String,
    },
    /// The firmware of a station does not run, or no longer runs.
    #[error("{station} as firmware: {source}")]
    Emulated {
        /// The station.
        station: String,
        /// What is wrong.
        source: RemoteError,
    },
    /// The user gave up waiting.
    #[error("stopped while waiting for the {other}; nothing was run")]
    Stopped {
        /// The other side's name.
        other: String,
    },
}

fn list(loaded: &Loaded) -> String {
    loaded.problems().map(|line| format!("  {line}")).collect::<Vec<_>>().join("\n")
}
