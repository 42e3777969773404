//! Tags, and the two ways of how much of freshness and tag travels.

use aes::Aes128;
use cmac::{Cmac, KeyInit, Mac};
use heapless::Vec;

use crate::envelope::MAX_CONTENT_BYTES;

/// Channel, nonce, freshness, and a content.
const MAX_TAGGED_BYTES: usize = 2 + 8 + 8 + MAX_CONTENT_BYTES;
/// Bytes of the longest tag that travels.
pub(super) const FULL_TAG_BYTES: usize = 8;

/// A key that both ends have and nobody else.
#[derive(Clone)]
pub struct Key(Cmac<Aes128>);

impl core::fmt::Debug for Key {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Key(..)")
    }
}

impl Key {
    /// A key of 128 bits, from a source of randomness.
    #[must_use]
    pub fn new(bytes: &[u8; 16]) -> Self {
        Self(Cmac::new(&(*bytes).into()))
    }

    /// The first 8 bytes of the CMAC over `parts`, one behind the other.
    ///
    /// Parts are joined before: every call of the library sets the cipher up anew.
    pub(super) fn tag(&self, parts: &[&[u8]]) -> [u8; FULL_TAG_BYTES] {
        let mut joined: Vec<u8, MAX_TAGGED_BYTES> = Vec::new();
        for part in parts {
            // Fits: nothing longer than a content is sealed or opened.
            let _ = joined.extend_from_slice(part);
        }
        let mut mac = self.0.clone();
        mac.update(&joined);
        let whole: [u8; 16] = mac.finalize().into_bytes().into();
        let [a, b, c, d, e, f, g, h, ..] = whole;
        [a, b, c, d, e, f, g, h]
    }
}

/// Whether two tags are the same, in a time that does not tell where they differ.
pub(super) fn is_same(a: &[u8], b: &[u8]) -> bool {
    let differences = a.iter().zip(b).fold(0, |found, (a, b)| found | a ^ b);
    a.len() == b.len() && core::hint::black_box(differences) == 0
}

/// How much of freshness and tag travels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Profile {
    /// 32 and 64 bits.
    Full,
    /// 8 and 24 bits, for 8-byte frames; wrong tags lock the receiver out for a while.
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
            Self::Full => FULL_TAG_BYTES,
            Self::Short => 3,
        }
    }

    /// Bytes that a content grows by.
    #[must_use]
    pub const fn overhead(self) -> usize {
        self.freshness_bytes() + self.tag_bytes()
    }

    /// The freshness that low bits stand for, the next one after `newest` that has them; none when they are those of
    /// `newest` itself or of half the range behind it.
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
        assert_eq!(key.tag(&[]), [0xbb, 0x1d, 0x69, 0x29, 0xe9, 0x59, 0x37, 0x28]);
        assert_eq!(key.tag(&[&message]), [0x07, 0x0a, 0x16, 0xb4, 0x6b, 0x4d, 0x41, 0x44]);
        let tag = key.tag(&[&message, &more, &hex(0x30c8_1c46_a35c_e411_0000_0000_0000_0000)[..8]]);
        assert_eq!(tag, [0xdf, 0xa6, 0x67, 0x47, 0xde, 0x9a, 0xe6, 0x30]);
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
