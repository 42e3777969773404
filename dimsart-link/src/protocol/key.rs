//! Messages about a board's key. `gate.rs` checks requests against it.
//!
//! ```text
//! open ──set──▶ locked ──set, clear: sealed with the current key──▶ locked, open
//! damaged: the stored key is corrupt. The board refuses all requests that need a key
//! ```
//! Without feature `auth` none of these values exists: requests about keys are unknown.

use serde::{Deserialize, Serialize};

/// A key in a message. Its debug output is redacted.
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

/// Requests about the board's key. The response is the resulting [`KeyState`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "auth", derive(Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "auth", non_exhaustive)]
pub enum KeyAction {
    /// Reads the state.
    #[cfg(feature = "auth")]
    Read,
    /// Stores a key, replacing an existing one. The board is locked from the response on.
    #[cfg(feature = "auth")]
    Set {
        /// The key.
        key: KeyBytes,
        /// A random number, different for every `Set`: start of the board's nonces.
        salt: u64,
    },
    /// Deletes the key. The board is open from the response on.
    #[cfg(feature = "auth")]
    Clear,
}

/// State of a board's key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "auth", non_exhaustive)]
pub enum KeyState {
    /// No key: the board accepts requests from every client.
    #[cfg(feature = "auth")]
    Open,
    /// Locked: the board accepts requests that change or move something only if they are sealed.
    #[cfg(feature = "auth")]
    Locked,
    /// The stored key is corrupt: the board is locked, and no key unlocks it.
    #[cfg(feature = "auth")]
    Damaged,
}

/// Reasons for refusing a request because of the key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "auth", non_exhaustive)]
pub enum KeyRefusal {
    /// The board is locked, and the request was not sealed.
    #[cfg(feature = "auth")]
    Locked,
    /// The stored key is corrupt.
    #[cfg(feature = "auth")]
    Damaged,
    /// Sealed with another key or for an earlier start of the board, or replayed.
    #[cfg(feature = "auth")]
    NotAccepted,
    /// The key can only be changed at rest: the scheme runs, or a client holds the lease.
    #[cfg(feature = "auth")]
    InUse,
}

impl core::fmt::Display for KeyRefusal {
    #[cfg_attr(not(feature = "auth"), expect(unused_variables, reason = "there is nothing to show"))]
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match *self {
            #[cfg(feature = "auth")]
            Self::Locked => f.write_str("the board is locked: pass its key file (--key-file FILE)"),
            #[cfg(feature = "auth")]
            Self::Damaged => f.write_str(
                "the key stored in the board is corrupt, so the board refuses all commands that change or move something: \
                 erase and flash the board",
            ),
            #[cfg(feature = "auth")]
            Self::NotAccepted => f.write_str(
                "sealed request refused: the board's key differs from the key in the file; pass the board's key file",
            ),
            #[cfg(feature = "auth")]
            Self::InUse => f.write_str(
                "the key can only be changed at rest: `stop` the scheme and disarm the client that holds the lease",
            ),
        }
    }
}

/// The derived implementation takes 48 bytes more flash.
#[cfg(not(feature = "auth"))]
impl<'de> Deserialize<'de> for KeyAction {
    fn deserialize<D: serde::Deserializer<'de>>(_: D) -> Result<Self, D::Error> {
        Err(serde::de::Error::custom(""))
    }
}
