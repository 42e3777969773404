//! Tags, and the two ways of how much of freshness and tag travels.

use dimsart_cmac::{Cmac, KEY_BYTES};
use heapless::Vec;

use super::line::Line;
use dimsart_core::envelope::MAX_CONTENT_BYTES;

/// Bytes of the longest tag that travels.
pub(super) const TAG_BYTES: usize = 8;
const KEY_BITS: u16 = 128;
/// Line, channel, freshness, and a content.
const MAX_TAGGED_BYTES: usize = 2 + 2 + 8 + MAX_CONTENT_BYTES;
/// Of a label and a context, with what is around them.
const MAX_DERIVED_BYTES: usize = 64;

/// A key that both ends have and nobody else.
#[derive(Clone)]
pub struct Key([u8; KEY_BYTES]);

impl core::fmt::Debug for Key {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Key(..)")
    }
}

impl Key {
    /// A key of 128 bits, from a source of randomness.
    #[must_use]
    pub const fn new(bytes: &[u8; KEY_BYTES]) -> Self {
        Self(*bytes)
    }

    /// The key for what the label and the context say, from which neither this one nor any other can be found: NIST SP
    /// 800-108, in counter mode with AES-CMAC, of one block.
    pub(super) fn derive(&self, label: &str, context: &[u8]) -> Self {
        let parts: [&[u8]; 5] = [&[1], label.as_bytes(), &[0], context, &KEY_BITS.to_be_bytes()];
        Self(cmac::<MAX_DERIVED_BYTES>(&self.cipher(), &parts))
    }

    /// What can be said of a key that is nothing but a tag.
    pub(super) fn first_bytes(&self) -> [u8; TAG_BYTES] {
        first_bytes(self.0)
    }

    fn cipher(&self) -> Cmac {
        Cmac::new(&self.0)
    }
}

/// A key that is ready for the contents of one association.
#[derive(Clone)]
pub(super) struct ContentKey {
    cipher: Cmac,
    line: Line,
}

impl core::fmt::Debug for ContentKey {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("ContentKey(..)")
    }
}

impl ContentKey {
    pub(super) fn new(key: &Key, line: Line) -> Self {
        Self { cipher: key.cipher(), line }
    }

    /// The tag of a content.
    pub(super) fn tag(&self, channel: u16, freshness: u64, covered: &[u8]) -> [u8; TAG_BYTES] {
        let parts: [&[u8]; 4] =
            [&self.line.to_bytes(), &channel.to_le_bytes(), &freshness.to_le_bytes(), covered];
        first_bytes(cmac::<MAX_TAGGED_BYTES>(&self.cipher, &parts))
    }
}

/// Over `parts`, one behind the other. They are joined before: every call of the library sets the cipher up anew.
fn cmac<const N: usize>(cipher: &Cmac, parts: &[&[u8]]) -> [u8; KEY_BYTES] {
    let mut joined: Vec<u8, N> = Vec::new();
    for part in parts {
        // Fits: nothing longer than a content is sealed or opened, and no label is longer than 16 bytes.
        let _ = joined.extend_from_slice(part);
    }
    cipher.tag(&joined)
}

fn first_bytes([a, b, c, d, e, f, g, h, ..]: [u8; KEY_BYTES]) -> [u8; TAG_BYTES] {
    [a, b, c, d, e, f, g, h]
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
    /// 8 and 56 bits, two words, for 8-byte frames.
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
        let of = |parts: &[&[u8]]| cmac::<64>(&key.cipher(), parts);
        assert_eq!(of(&[]), hex(0xbb1d_6929_e959_3728_7fa3_7d12_9b75_6746));
        assert_eq!(of(&[&message]), hex(0x070a_16b4_6b4d_4144_f79b_dd9d_d04a_287c));
        let end = &hex(0x30c8_1c46_a35c_e411_0000_0000_0000_0000)[..8];
        assert_eq!(of(&[&message, &more, end]), hex(0xdfa6_6747_de9a_e630_30ca_3261_1497_c827));
    }

    /// By hand: one block, and no label or context that could be mistaken for another one's.
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
