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
    #[error("the Data Base has no room for the device's types: {0:?}")]
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
        "the link from '{from}' to '{to}' has no channel on its CAN bus: set CTX_CHANNEL of the sender and \
        CRX_CHANNEL of the receiver to the same number, 1 to 2047"
    )]
    NoChannel {
        /// The controller that sends.
        from: String,
        /// The controller that receives.
        to: String,
    },
    /// Two links over one CAN bus have the same channel.
    #[error(
        "the links to '{first}' and '{second}' share channel {channel} of one CAN bus: give each link unique \
        CTX_CHANNEL and CRX_CHANNEL"
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
        "{source}; or use another address: --set link.{name}_address=IP:PORT (on both sides), serial:PATH or \
        can:INTERFACE"
    )]
    Link {
        /// Whose address it is.
        name: String,
        /// What is wrong with it.
        source: OpenError,
    },
    /// A station that cannot run alone.
    #[error("the controller '{name}' has no link with addresses in both directions: set `address` of both links")]
    NoAddress {
        /// The controller.
        name: String,
    },
    /// The other process does not answer.
    #[error(
        "no packet from the {other} at {peer} within {waited_s} s; start it with `dimsart run --side {other}` \
        and the same scenario, or increase --wait-s"
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
    #[error("no random numbers from the operating system, required by link.key_file: {0}")]
    NoRandomness(#[from] getrandom::Error),
    /// What the other process sends cannot be trusted.
    #[error(
        "packets from the {other} at {peer} were refused: {reason}; use the same link.key_file on both sides"
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
        "packets from the {other} at {peer} do not match this side's scheme; use the same scenario (dof, \
        schemes) on both sides"
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
    #[error("stopped while waiting for the {other}, before the run")]
    Stopped {
        /// The other side's name.
        other: String,
    },
}

fn list(loaded: &Loaded) -> String {
    loaded.problems().map(|line| format!("  {line}")).collect::<Vec<_>>().join("\n")
}
