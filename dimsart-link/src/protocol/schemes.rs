//! Schemes stored on a board: a new scheme is on trial until it is confirmed.
//!
//! ```text
//! save ──▶ waits ──start──▶ tried ──confirm──▶ saved: runs at every start
//!                             └────start──▶ discarded: the last saved scheme runs, or the built-in one
//! ```
//! An invalid stored scheme never prevents the board from starting and responding.

use serde::{Deserialize, Serialize};

use crate::saved_scheme::LoadError;

/// Requests about the stored schemes. Each is idempotent; the response is the resulting [`SchemeStatus`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SchemeAction {
    /// Reads the state.
    Read,
    /// Saves the current scheme for a trial at the next start.
    Save,
    /// Saves the scheme on trial for every start. It must have run since the last start.
    Confirm,
    /// Deletes the scheme on trial; the running scheme continues until the next start.
    RollBack,
}

/// State of a board's stored schemes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SchemeStatus {
    /// The scheme loaded by the last start; commands may have changed it since.
    pub origin: Origin,
    /// Why another scheme was loaded than expected, if so.
    pub fallback: Option<Fallback>,
    /// The scheme on trial.
    pub trial: Trial,
    /// Whether a confirmed scheme is stored.
    pub is_saved: bool,
}

/// The scheme that a start loaded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Origin {
    /// None: not even the built-in scheme matches this device.
    Empty,
    /// The image's scheme.
    BuiltIn,
    /// The confirmed scheme.
    Saved,
    /// The scheme on trial.
    Trial,
}

/// Reasons why a start did not load the preferred scheme, or may have loaded an old one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Fallback {
    /// The storage cannot be read or written.
    Storage,
    /// The scheme on trial was tried before and not confirmed.
    Unconfirmed,
    /// The scheme on trial does not load.
    Trial(LoadError),
    /// The saved scheme does not load.
    Saved(LoadError),
    /// The built-in scheme does not load.
    BuiltIn(LoadError),
    /// A corrupt or incomplete entry of the storage may be newer; the last valid one is used.
    Damaged,
    /// The scheme on trial was not started: its trial could not be recorded in the storage.
    NotRecorded,
}

/// State of a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Trial {
    /// No scheme on trial.
    #[default]
    None,
    /// The next start tries the scheme.
    Pending,
    /// The scheme was tried; unless confirmed, the next start does not run it.
    Tried,
}

/// Reasons for refusing a request about stored schemes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum StoreError {
    /// The board has no storage.
    NoStorage,
    /// A scheme runs, and writing would delay its tick.
    SchemeIsRunning,
    /// The scheme is too long.
    TooLong,
    /// The last start did not load a scheme on trial.
    NoTrial,
    /// The storage cannot be read, or does not hold the written data.
    Storage,
}

impl core::fmt::Display for StoreError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NoStorage => write!(f, "the device cannot store schemes"),
            Self::SchemeIsRunning => {
                write!(f, "writing to flash would delay the running scheme: `stop` the scheme first")
            }
            Self::TooLong => {
                let most = crate::saved_scheme::MAX_SCHEME_BYTES;
                write!(f, "the scheme exceeds {most} bytes: remove modules or per-axis values")
            }
            Self::NoTrial => {
                write!(
                    f,
                    "no scheme is on trial: `save` a scheme, restart the device, test the scheme, then `confirm` it"
                )
            }
            Self::Storage => {
                write!(
                    f,
                    "the written data failed verification, and the device uses the earlier data. \
                     Try again; if this repeats, the flash is worn out or write-protected"
                )
            }
        }
    }
}

impl core::error::Error for StoreError {}
