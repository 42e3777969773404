//! The key that a board keeps: what travels about it. The rest is in `gate.rs`.
//!
//! ```text
//! open ──set──▶ locked ──set, clear: sealed with the key that is held──▶ locked, open
//! damaged: what was kept cannot be read. Nothing that is sealed is taken and nothing else moves the device
//! ```
//! Without feature `auth` none of it can be made or read: a request about keys is not understood there, and costs
//! nothing.

use serde::{Deserialize, Serialize};

/// A key on its way. It is not shown.
#[cfg(feature = "auth")]
#[derive(Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeyBytes(pub [u8; 16]);

#[cfg(feature = "auth")]
impl core::fmt::Debug for KeyBytes {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("KeyBytes(..)")
    }
}

#[cfg(all(feature = "auth", feature = "defmt"))]
impl defmt::Format for KeyBytes {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "KeyBytes(..)");
    }
}

/// What is wanted of the key that a board keeps. Each is answered by how it stands then.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "auth", derive(Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "auth", non_exhaustive)]
pub enum KeyAction {
    /// Nothing but to know.
    #[cfg(feature = "auth")]
    Look,
    /// Keeps a key, in place of the one before. From the answer on the board is locked.
    #[cfg(feature = "auth")]
    Set {
        /// The key.
        key: KeyBytes,
        /// A random number, another one at every `Set`: what the board's nonces begin with.
        salt: u64,
    },
    /// Forgets the key. From the answer on the board is open.
    #[cfg(feature = "auth")]
    Clear,
}

/// How a board stands to keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "auth", non_exhaustive)]
pub enum KeyState {
    /// It holds none: it takes what anybody asks, and authenticates nothing.
    #[cfg(feature = "auth")]
    Open,
    /// It holds one, and takes what changes or moves something from who has it, too.
    #[cfg(feature = "auth")]
    Locked,
    /// What it kept cannot be read: it is locked, and no key opens it.
    #[cfg(feature = "auth")]
    Damaged,
}

/// Why a request that a key has to do with was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "auth", non_exhaustive)]
pub enum KeyRefusal {
    /// The board is locked, and the request was not sealed.
    #[cfg(feature = "auth")]
    Locked,
    /// What the board kept of its key cannot be read.
    #[cfg(feature = "auth")]
    Damaged,
    /// Sealed with another key, for another start of the board, or used before.
    #[cfg(feature = "auth")]
    NotAccepted,
    /// A key is set and cleared at rest alone: the scheme runs, or somebody holds the lease.
    #[cfg(feature = "auth")]
    InUse,
}

impl core::fmt::Display for KeyRefusal {
    #[cfg_attr(not(feature = "auth"), expect(unused_variables, reason = "there is nothing to show"))]
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match *self {
            #[cfg(feature = "auth")]
            Self::Locked => f.write_str("the board is locked: give the file with its key (--key-file)"),
            #[cfg(feature = "auth")]
            Self::Damaged => f.write_str(
                "the board cannot read the key that it kept, so that it takes nothing from anybody: erase its flash \
                 and flash it anew",
            ),
            #[cfg(feature = "auth")]
            Self::NotAccepted => f.write_str(
                "the board does not take what was sealed: it holds another key than the one in the file",
            ),
            #[cfg(feature = "auth")]
            Self::InUse => f.write_str(
                "a key is changed at rest only: `stop` the scheme and let whoever armed the board end that",
            ),
        }
    }
}

/// As derived, and 48 bytes of flash less.
#[cfg(not(feature = "auth"))]
impl<'de> Deserialize<'de> for KeyAction {
    fn deserialize<D: serde::Deserializer<'de>>(_: D) -> Result<Self, D::Error> {
        Err(serde::de::Error::custom(""))
    }
}
