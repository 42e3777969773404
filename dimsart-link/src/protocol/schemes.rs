//! Schemes that a board keeps: a new one is on trial until it is confirmed.
//!
//! ```text
//! save ──▶ waits ──start──▶ tried ──confirm──▶ saved: runs at every start
//!                             └────start──▶ not run again; the last saved one runs, or the built-in one
//! ```
//! Whatever becomes of a kept scheme, the board starts and answers.

use serde::{Deserialize, Serialize};

use crate::saved_scheme::LoadError;

/// What is wanted of the schemes that a board keeps. Each is answered by how they stand then, and given
/// twice comes to the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SchemeAction {
    /// Nothing but to know.
    Look,
    /// Keeps the scheme as it is now; the next start tries it.
    Save,
    /// Keeps the scheme on trial, as it was saved, for every start. It must run since the last start.
    Confirm,
    /// Forgets the scheme on trial; what runs goes on until the next start.
    RollBack,
}

/// How the schemes of a board stand.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SchemeStatus {
    /// What the last start loaded; commands may have changed it since.
    pub origin: Origin,
    /// Why it was not what should have been loaded, if it was not.
    pub fallback: Option<Fallback>,
    /// The scheme on trial.
    pub trial: Trial,
    /// Whether a confirmed scheme is kept.
    pub is_saved: bool,
}

/// Which scheme a start loaded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Origin {
    /// None: not even the built-in one matches this device.
    Empty,
    /// The one in the image.
    BuiltIn,
    /// The confirmed one.
    Saved,
    /// The one on trial.
    Trial,
}

/// Why a start did not load the scheme that comes first, or may have loaded an old one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Fallback {
    /// The storage cannot be read or written.
    Storage,
    /// The one on trial was tried before and not confirmed.
    Unconfirmed,
    /// The one on trial does not load.
    Trial(LoadError),
    /// The saved one does not load.
    Saved(LoadError),
    /// The built-in one does not load.
    BuiltIn(LoadError),
    /// An entry of the storage that is damaged or incomplete may say something else: an older one counts.
    Damaged,
    /// The one on trial was not started: the storage did not take, or has no room for, the record of its trial.
    NotRecorded,
}

/// How a trial stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Trial {
    /// There is none.
    #[default]
    None,
    /// The next start tries it.
    Waits,
    /// It was tried; the next start does not run it unless it is confirmed.
    Tried,
}

/// Why nothing was done to the schemes that a board keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum StoreError {
    /// The board keeps no schemes.
    NoStorage,
    /// Writing would hold up the tick, and a scheme runs.
    SchemeRuns,
    /// The scheme takes more bytes than are kept.
    TooLong,
    /// No scheme on trial was loaded by the last start.
    NotTried,
    /// The storage cannot be read, or holds something else than was written to it.
    Storage,
}

impl core::fmt::Display for StoreError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NoStorage => write!(f, "the device has nowhere to keep a scheme"),
            Self::SchemeRuns => {
                write!(f, "writing would hold up the tick of the scheme that runs: `stop` it first")
            }
            Self::TooLong => {
                let most = crate::saved_scheme::MAX_SCHEME_BYTES;
                write!(
                    f,
                    "the scheme takes more than {most} bytes: leave modules or values of single axes out"
                )
            }
            Self::NotTried => {
                write!(
                    f,
                    "no scheme on trial runs: `save` one, restart the device, and confirm it when it does well"
                )
            }
            Self::Storage => {
                write!(
                    f,
                    "its storage does not hold what was written to it, what was kept before still is: try again; if it \
                     stays so, the flash is worn out or write-protected"
                )
            }
        }
    }
}

impl core::error::Error for StoreError {}
