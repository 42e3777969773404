//! The CRCs of what travels or is kept.

/// With its lowest bit first.
const POLYNOMIAL: u32 = 0xF4AC_FB13_u32.reverse_bits();

/// AUTOSAR's CRC-32 (polynomial 0xF4ACFB13), Hamming distance 6 up to 256 bytes. One byte at a time:
/// a table of 16 entries saves 960 bytes of flash and costs 560 instructions a packet.
#[derive(Debug, Clone, Copy)]
pub struct Crc32(u32);

impl Crc32 {
    const TABLE: [u32; 256] = table();

    /// Of no bytes yet.
    #[must_use]
    pub const fn new() -> Self {
        Self(u32::MAX)
    }

    /// Of these bytes.
    #[must_use]
    pub fn checksum(bytes: &[u8]) -> u32 {
        let mut sum = Self::new();
        sum.update(bytes);
        sum.finalize()
    }

    /// Adds bytes.
    pub fn update(&mut self, bytes: &[u8]) {
        let mut sum = self.0;
        for byte in bytes {
            let place = ((sum ^ u32::from(*byte)) & 0xFF) as usize;
            sum = (sum >> 8) ^ Self::TABLE.get(place).copied().unwrap_or_default();
        }
        self.0 = sum;
    }

    /// The CRC of all of them.
    #[must_use]
    pub const fn finalize(self) -> u32 {
        !self.0
    }
}

impl Default for Crc32 {
    fn default() -> Self {
        Self::new()
    }
}

/// What each byte makes of the CRC.
#[expect(clippy::indexing_slicing, clippy::cast_possible_truncation, reason = "the compiler works it out")]
const fn table() -> [u32; 256] {
    let mut table = [0; 256];
    let mut place = 0;
    while place < 256 {
        let (mut sum, mut bit) = (place as u32, 0);
        while bit < 8 {
            sum = (sum >> 1) ^ if sum & 1 == 1 { POLYNOMIAL } else { 0 };
            bit += 1;
        }
        table[place] = sum;
        place += 1;
    }
    table
}

/// AUTOSAR's CRC-8 (polynomial 0x2F), Hamming distance 4 up to 14 bytes: for frames of 8.
pub(crate) static CRC_8: crc::Crc<u8, crc::Table<1>> =
    crc::Crc::<u8, crc::Table<1>>::new(&crc::CRC_8_AUTOSAR);

#[cfg(test)]
mod tests {
    use super::*;

    /// The check value of the catalogue, and what another implementation makes of all bytes, in parts too.
    #[test]
    fn the_checksum_is_that_of_the_catalogue() {
        assert_eq!(Crc32::checksum(b"123456789"), 0x1697_D06A);
        let other = crc::Crc::<u32>::new(&crc::CRC_32_AUTOSAR);
        let mut byte = 13_u8;
        let bytes: [u8; 256] = core::array::from_fn(|_| {
            byte = byte.wrapping_mul(165).wrapping_add(7);
            byte
        });
        let mut parts = Crc32::new();
        for end in 0..bytes.len() {
            assert_eq!(Crc32::checksum(&bytes[..end]), other.checksum(&bytes[..end]));
            assert_eq!(parts.finalize(), other.checksum(&bytes[..end]));
            parts.update(&bytes[end..=end]);
        }
    }
}
