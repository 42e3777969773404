//! Errors of setting up and running an experiment.

use dimsart_core::{DescriptorError, StorageError};

use crate::bus::DelayFileError;
use crate::key_file::KeyFileError;
use crate::link::{Address, OpenError};
use crate::motion::SamplesError;
use crate::plant::ParameterError;
use crate::recorder::UnknownSignal;
use crate::rig::{AuthenticationFailure, RemoteError};
use crate::schemes::{LoadReport, SchemeFileError};

/// Error of an experiment.
#[derive(Debug, thiserror::Error)]
pub enum ExperimentError {
    /// Invalid device.
    #[error("device '{device}': {error}")]
    Device {
        /// The device.
        device: String,
        /// Reason.
        error: DescriptorError,
    },
    /// The Data Base is too small for the device's types.
    #[error("the Data Base is too small for the device's data types ({0:?}): remove axes or `measures`")]
    Storage(StorageError),
    /// Invalid plant parameter.
    #[error("{place}: {error}")]
    Plant {
        /// Plant.
        place: String,
        /// Reason.
        error: ParameterError,
    },
    /// Unreadable scheme.
    #[error(transparent)]
    SchemeFile(#[from] SchemeFileError),
    /// Invalid scheme for this controller.
    #[error("the scheme {name} does not run on {controller}:\n{}", list(loaded))]
    Scheme {
        /// The scheme.
        name: String,
        /// The controller.
        controller: String,
        /// Reason.
        loaded: LoadReport,
    },
    /// Law that is unreadable, invalid, or one too many.
    #[error("the controller '{controller}': {what}")]
    Law {
        /// The controller.
        controller: String,
        /// Reason.
        what: String,
    },
    /// Invalid samples file.
    #[error(transparent)]
    Samples(#[from] SamplesError),
    /// A link over a CAN bus without a channel.
    #[error(
        "the link from '{from}' to '{to}' has no channel on its CAN bus: set CTX_CHANNEL of the sender and \
        CRX_CHANNEL of the receiver to the same number, 1 to 2047"
    )]
    NoChannel {
        /// Sending controller.
        from: String,
        /// Receiving controller.
        to: String,
    },
    /// Duplicate channel of two links on a CAN bus.
    #[error(
        "the links to '{first}' and '{second}' share channel {channel} of one CAN bus: give each link unique \
        CTX_CHANNEL and CRX_CHANNEL"
    )]
    SameChannel {
        /// The channel.
        channel: u16,
        /// Receiver of the first link in the file.
        first: String,
        /// Receiver of the second link.
        second: String,
    },
    /// Invalid delays file.
    #[error(transparent)]
    Delays(#[from] DelayFileError),
    /// Unknown name in `record.signals`.
    #[error(transparent)]
    Record(#[from] UnknownSignal),
    /// Cannot open the link to another process.
    #[error(
        "{source}; or use another address: --set link.{name}_address=IP:PORT (on both sides), serial:PATH or \
        can:INTERFACE"
    )]
    Link {
        /// Station of the address.
        name: String,
        /// Reason.
        source: OpenError,
    },
    /// The station cannot run alone.
    #[error(
        "the controller '{name}' has no link with addresses in both directions: set `address` of both links"
    )]
    NoAddress {
        /// The controller.
        name: String,
    },
    /// The peer does not answer.
    #[error(
        "no packet from the {other} at {peer} within {waited_s} s; start the peer with `dimsart run --side \
        {other}` and the same scenario, or increase --wait-s"
    )]
    NoPeer {
        /// Address of the peer.
        peer: Address,
        /// Time waited, `s`.
        waited_s: f64,
        /// Name of the peer.
        other: String,
    },
    /// Unreadable key.
    #[error(transparent)]
    KeyFile(#[from] KeyFileError),
    /// No random numbers for a nonce.
    #[error("the operating system supplies no random numbers, which link.key_file requires: {0}")]
    NoRandomness(#[from] getrandom::Error),
    /// Authentication failure of the peer's packets.
    #[error(
        "packets from the {other} at {peer} were refused: {reason}; use the same link.key_file on both sides"
    )]
    AuthenticationFailure {
        /// Address of the peer.
        peer: Address,
        /// Name of the peer.
        other: String,
        /// Reason.
        reason: AuthenticationFailure,
    },
    /// The peer's packets do not match.
    #[error(
        "packets from the {other} at {peer} do not match this side's scheme; use the same scenario (dof, \
        schemes) on both sides"
    )]
    WrongPeer {
        /// Address of the peer.
        peer: Address,
        /// Name of the peer.
        other: String,
    },
    /// Error of a station's firmware.
    #[error("firmware of controller '{station}': {source}")]
    Emulated {
        /// The station.
        station: String,
        /// Reason.
        source: RemoteError,
    },
    /// Stopped by the user while waiting.
    #[error("stopped by the user while waiting for the {other}, before the run")]
    Stopped {
        /// Name of the peer.
        other: String,
    },
}

fn list(loaded: &LoadReport) -> String {
    loaded.problems().map(|line| format!("  {line}")).collect::<Vec<_>>().join("\n")
}
