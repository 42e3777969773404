//! Tags, and the two profiles for their length.

use dimsart_cmac::{Cmac, KEY_BYTES};
use heapless::Vec;

use super::line::KeyDomain;
use dimsart_core::envelope::MAX_CONTENT_BYTES;

/// Maximum number of tag bytes sent.
pub(super) const TAG_BYTES: usize = 8;
const KEY_BITS: u16 = 128;
/// Line, channel, freshness, and a content.
const MAX_TAGGED_BYTES: usize = 2 + 2 + 8 + MAX_CONTENT_BYTES;
/// Maximum length of a label and a context, including the fixed fields.
const MAX_DERIVED_BYTES: usize = 64;

/// A key shared by both ends.
#[derive(Clone)]
pub struct Key([u8; KEY_BYTES]);

impl core::fmt::Debug for Key {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Key(..)")
    }
}

impl Key {
    /// Creates a key from 128 random bits.
    #[must_use]
    pub const fn new(bytes: &[u8; KEY_BYTES]) -> Self {
        Self(*bytes)
    }

    /// Derives a key from a label and a context (NIST SP 800-108, counter mode with AES-CMAC, one block). The
    /// original key cannot be computed from the derived one.
    pub(super) fn derive(&self, label: &str, context: &[u8]) -> Self {
        let parts: [&[u8]; 5] = [&[1], label.as_bytes(), &[0], context, &KEY_BITS.to_be_bytes()];
        Self(cmac::<MAX_DERIVED_BYTES>(&self.cipher(), &parts))
    }

    /// Returns the key's first bytes, for use as a tag or nonce.
    pub(super) fn first_bytes(&self) -> [u8; TAG_BYTES] {
        first_bytes(self.0)
    }

    fn cipher(&self) -> Cmac {
        Cmac::new(&self.0)
    }
}

/// The expanded key of a session.
#[derive(Clone)]
pub(super) struct ContentKey {
    cipher: Cmac,
    line: KeyDomain,
}

impl core::fmt::Debug for ContentKey {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("ContentKey(..)")
    }
}

impl ContentKey {
    pub(super) fn new(key: &Key, line: KeyDomain) -> Self {
        Self { cipher: key.cipher(), line }
    }

    /// Computes the tag of a message.
    pub(super) fn tag(&self, channel: u16, freshness: u64, covered: &[u8]) -> [u8; TAG_BYTES] {
        let parts: [&[u8]; 4] =
            [&self.line.to_bytes(), &channel.to_le_bytes(), &freshness.to_le_bytes(), covered];
        first_bytes(cmac::<MAX_TAGGED_BYTES>(&self.cipher, &parts))
    }
}

/// Computes the CMAC of the concatenated `parts`. Each call of the library costs a setup of the cipher.
fn cmac<const N: usize>(cipher: &Cmac, parts: &[&[u8]]) -> [u8; KEY_BYTES] {
    let mut joined: Vec<u8, N> = Vec::new();
    for part in parts {
        // Fits: every message is at most a content long, every label at most 16 bytes.
        let _ = joined.extend_from_slice(part);
    }
    cipher.tag(&joined)
}

fn first_bytes([a, b, c, d, e, f, g, h, ..]: [u8; KEY_BYTES]) -> [u8; TAG_BYTES] {
    [a, b, c, d, e, f, g, h]
}

/// Compares two tags in constant time.
pub(super) fn is_same(a: &[u8], b: &[u8]) -> bool {
    let differences = a.iter().zip(b).fold(0, |found, (a, b)| found | a ^ b);
    a.len() == b.len() && core::hint::black_box(differences) == 0
}

/// Number of freshness and tag bits sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Profile {
    /// 32 bits of freshness, 64 bits of tag.
    Full,
    /// 8 and 56 bits: two words, for 8-byte frames.
    Short,
}

impl Profile {
    pub(super) const fn freshness_bytes(self) -> usize {
        match self {
            Self::Full => 4,
            Self::Short => 1,
        }
    }

    pub(super) const fn tag_bytes(self) -> usize {
        match self {
            Self::Full => TAG_BYTES,
            Self::Short => TAG_BYTES - 1,
        }
    }

    /// Returns the overhead per message, bytes.
    #[must_use]
    pub const fn overhead(self) -> usize {
        self.freshness_bytes() + self.tag_bytes()
    }

    /// Returns the next freshness after `newest` with these low bits; `None` if they equal those of `newest`
    /// or lie in the half range before it.
    pub(super) fn freshness(self, low: &[u8], newest: u64) -> Option<u64> {
        let step = match (self, low) {
            (Self::Full, &[a, b, c, d]) => {
                let step = u32::from_le_bytes([a, b, c, d]).wrapping_sub(low_word(newest));
                u64::from(step).checked_sub(1).filter(|step| *step < 1 << 31)?
            }
            (Self::Short, &[low]) => {
                let [newest, ..] = newest.to_le_bytes();
                u64::from(low.wrapping_sub(newest)).checked_sub(1).filter(|step| *step < 1 << 7)?
            }
            _ => return None,
        };
        newest.checked_add(step + 1)
    }
}

fn low_word(number: u64) -> u32 {
    let [a, b, c, d, ..] = number.to_le_bytes();
    u32::from_le_bytes([a, b, c, d])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// RFC 4493, section 4, examples 1 to 3.
    #[test]
    fn tags_are_those_of_the_standard() {
        let key = Key::new(&hex(0x2b7e_1516_28ae_d2a6_abf7_1588_09cf_4f3c));
        let message = hex(0x6bc1_bee2_2e40_9f96_e93d_7e11_7393_172a);
        let more = hex(0xae2d_8a57_1e03_ac9c_9eb7_6fac_45af_8e51);
        let of = |parts: &[&[u8]]| cmac::<64>(&key.cipher(), parts);
        assert_eq!(of(&[]), hex(0xbb1d_6929_e959_3728_7fa3_7d12_9b75_6746));
        assert_eq!(of(&[&message]), hex(0x070a_16b4_6b4d_4144_f79b_dd9d_d04a_287c));
        let end = &hex(0x30c8_1c46_a35c_e411_0000_0000_0000_0000)[..8];
        assert_eq!(of(&[&message, &more, end]), hex(0xdfa6_6747_de9a_e630_30ca_3261_1497_c827));
    }

    /// Computed by hand: one block; labels and contexts cannot be confused.
    #[test]
    fn keys_are_derived_as_the_standard_says() {
        let key = Key::new(&hex(7));
        let joined: &[u8] = b"\x01proof\0abc\0\x80";
        assert_eq!(key.derive("proof", b"abc").0, cmac::<64>(&key.cipher(), &[joined]));
        assert_ne!(key.derive("proof", b"abc").0, key.derive("proofa", b"bc").0);
    }

    fn hex(number: u128) -> [u8; 16] {
        number.to_be_bytes()
    }

    #[test]
    fn low_bits_stand_for_the_next_freshness_that_has_them() {
        let newest = 0x1_FFFF_FFFF;
        assert_eq!(Profile::Full.freshness(&[0, 0, 0, 0], newest), Some(newest + 1));
        assert_eq!(Profile::Full.freshness(&[0xFF; 4], newest), None);
        assert_eq!(Profile::Full.freshness(&[0xFE, 0xFF, 0xFF, 0xFF], newest), None);
        assert_eq!(Profile::Short.freshness(&[0], newest), Some(newest + 1));
        assert_eq!(Profile::Short.freshness(&[0x7F], newest), Some(newest + 128));
        assert_eq!(Profile::Short.freshness(&[0x80], newest), None);
        assert_eq!(Profile::Short.freshness(&[0xFF], newest), None);
    }
}
