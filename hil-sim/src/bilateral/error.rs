//! Why an experiment cannot be set up: what is wrong, where, and what to do next.

use dimsart_core::{DescriptorError, StorageError};

use crate::bus::DelayFileError;
use crate::emulated::EmulatedError;
use crate::key_file::KeyFileError;
use crate::link::{Address, OpenError};
use crate::plant::ParameterError;
use crate::recorder::UnknownSignal;
use crate::rig::AuthenticationFailure;
use crate::schemes::{Loaded, SchemeFileError};

/// Why an experiment could not be set up or run.
#[derive(Debug, thiserror::Error)]
pub enum ExperimentError {
    /// The device cannot exist.
    #[error("{0}; change dof or sample_period_s")]
    Device(#[from] DescriptorError),
    /// The device's types do not fit.
    #[error("the device's types do not fit into the Data Base: {0:?}")]
    Storage(StorageError),
    /// A plant's parameter.
    #[error("{side}: {error}")]
    Plant {
        /// Whose plant.
        side: &'static str,
        /// What is wrong.
        error: ParameterError,
    },
    /// The scheme cannot be read.
    #[error(transparent)]
    SchemeFile(#[from] SchemeFileError),
    /// The scheme does not run on this side.
    #[error("the scheme {name} does not run on the {side}:\n{}", list(loaded))]
    Scheme {
        /// The scheme.
        name: String,
        /// The side.
        side: &'static str,
        /// What is wrong.
        loaded: Loaded,
    },
    /// The recorded delays of a network.
    #[error(transparent)]
    Delays(#[from] DelayFileError),
    /// What `record.signals` names.
    #[error(transparent)]
    Record(#[from] UnknownSignal),
    /// The side's link to another process.
    #[error(
        "{source}, or give another one with --set link.{side}_address=IP:PORT (of both sides), serial:PATH or \
         can:INTERFACE"
    )]
    Link {
        /// Whose address it is.
        side: &'static str,
        /// What is wrong with it.
        source: OpenError,
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
        other: &'static str,
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
        other: &'static str,
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
        other: &'static str,
    },
    /// The firmware of a side does not run, or no longer runs.
    #[error("{side} as firmware: {source}")]
    Emulated {
        /// The side.
        side: String,
        /// What is wrong.
        source: EmulatedError,
    },
    /// The user gave up waiting.
    #[error("stopped while waiting for the {other}; nothing was run")]
    Stopped {
        /// The other side's name.
        other: &'static str,
    },
}

fn list(loaded: &Loaded) -> String {
    loaded.problems().map(|line| format!("  {line}")).collect::<Vec<_>>().join("\n")
}
