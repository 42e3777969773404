//! AES-CMAC (NIST SP 800-38B) with a 128-bit key.
#![no_std]
#![forbid(unsafe_code)]

use aes::Aes128;
use cmac::{KeyInit, Mac as _};

/// Length of a key and of a tag, bytes.
pub const KEY_BYTES: usize = 16;

/// A key with its expanded key schedule.
#[derive(Clone)]
pub struct Cmac(cmac::Cmac<Aes128>);

impl core::fmt::Debug for Cmac {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Cmac(..)")
    }
}

impl Cmac {
    /// Expands a key.
    #[must_use]
    pub fn new(key: &[u8; KEY_BYTES]) -> Self {
        Self(cmac::Cmac::new(&(*key).into()))
    }

    /// Computes the tag of a message.
    #[must_use]
    pub fn tag(&self, message: &[u8]) -> [u8; KEY_BYTES] {
        let mut mac = self.0.clone();
        mac.update(message);
        mac.finalize().into_bytes().into()
    }
}
