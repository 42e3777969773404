//! What one side sends to the other in a tick, and its bytes on a link.
//!
//! ```text
//! version u8 | words u8 | content u16 | sequence u32 | echo u32 | words × u32 | CRC-32 (poly 0xF4ACFB13) u32
//! ```
//! Little endian. The CRC (AUTOSAR's CRC-32, Hamming distance 6 up to 256 bytes) covers all before it.

use heapless::Vec;

use crate::checksum::CRC;
use crate::limits::MAX_PACKET_WORDS;

/// Version of the byte layout; a receiver refuses any other.
pub const PACKET_VERSION: u8 = 2;
/// Bytes around the words: header and CRC.
pub const PACKET_OVERHEAD: usize = 16;
/// Longest packet in bytes.
pub const MAX_PACKET_BYTES: usize = PACKET_OVERHEAD + 4 * MAX_PACKET_WORDS;

/// A packet between two controllers.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Packet {
    /// Stands for what the words mean: [`Content::id`](crate::Content::id).
    pub content: u16,
    /// Counts up by one per packet, from 1, wrapping.
    pub sequence: u32,
    /// Newest sequence number received from the other side; 0 for none.
    pub echo: u32,
    /// Contents, as the comm modules agreed.
    pub words: Vec<u32, MAX_PACKET_WORDS>,
}

/// Why bytes are no packet. Nothing is changed by a refused packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum PacketError {
    /// Shorter than a packet can be, or not as long as its header says.
    Length {
        /// Bytes received.
        bytes: usize,
    },
    /// Another version of the layout.
    Version {
        /// The version received.
        found: u8,
    },
    /// Damaged on the way.
    Crc,
    /// There is no link of this number.
    NoLink,
}

impl core::fmt::Display for PacketError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Length { bytes } => write!(f, "{bytes} bytes are not a whole packet"),
            Self::Version { found } => {
                write!(f, "packet of version {found}, this side speaks version {PACKET_VERSION}")
            }
            Self::Crc => write!(f, "packet damaged on the way (CRC)"),
            Self::NoLink => write!(f, "no link of this number"),
        }
    }
}

impl core::error::Error for PacketError {}

impl Packet {
    /// The packet's bytes.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8, MAX_PACKET_BYTES> {
        let mut bytes = Vec::new();
        let length = PACKET_OVERHEAD + 4 * self.words.len();
        // Cannot fail: the longest packet is what the vector is made for.
        let _ = bytes.resize_default(length);
        if let Some((content, crc)) = bytes.split_last_chunk_mut::<4>() {
            self.write_content(content);
            *crc = CRC.checksum(content).to_le_bytes();
        }
        bytes
    }

    fn write_content(&self, content: &mut [u8]) {
        let Some((header, body)) = content.split_first_chunk_mut::<4>() else { return };
        let [low, high] = self.content.to_le_bytes();
        *header = [PACKET_VERSION, u8::try_from(self.words.len()).unwrap_or(u8::MAX), low, high];
        let words = [self.sequence, self.echo].into_iter().chain(self.words.iter().copied());
        let (chunks, _) = body.as_chunks_mut::<4>();
        for (chunk, word) in chunks.iter_mut().zip(words) {
            *chunk = word.to_le_bytes();
        }
    }

    /// Reads a packet back.
    ///
    /// # Errors
    /// [`PacketError`] when the bytes are not one whole, undamaged packet of this version.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, PacketError> {
        let length = PacketError::Length { bytes: bytes.len() };
        let (content, crc) = bytes.split_last_chunk::<4>().ok_or(length)?;
        let (&[version, words, low, high], body) = content.split_first_chunk::<4>().ok_or(length)?;
        if version != PACKET_VERSION {
            return Err(PacketError::Version { found: version });
        }
        if bytes.len() != PACKET_OVERHEAD + 4 * usize::from(words) || usize::from(words) > MAX_PACKET_WORDS {
            return Err(length);
        }
        if CRC.checksum(content) != u32::from_le_bytes(*crc) {
            return Err(PacketError::Crc);
        }
        let (chunks, _) = body.as_chunks::<4>();
        let mut numbers = chunks.iter().map(|chunk| u32::from_le_bytes(*chunk));
        let (Some(sequence), Some(echo)) = (numbers.next(), numbers.next()) else {
            return Err(length);
        };
        Ok(Self { content: u16::from_le_bytes([low, high]), sequence, echo, words: numbers.collect() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Packet {
        let words = [1, 0x8000_0000, 3].into_iter().collect();
        Packet { content: 0x1234, sequence: 7, echo: 0xFFFF_FFFF, words }
    }

    #[test]
    fn bytes_are_as_documented_and_read_back() {
        let bytes = sample().to_bytes();
        assert_eq!(bytes.len(), PACKET_OVERHEAD + 12);
        assert_eq!(bytes[..8], [2, 3, 0x34, 0x12, 7, 0, 0, 0]);
        assert_eq!(Packet::from_bytes(&bytes), Ok(sample()));
    }

    #[test]
    fn every_single_bit_error_and_every_cut_is_refused() {
        let bytes = sample().to_bytes();
        for bit in 0..bytes.len() * 8 {
            let mut damaged = bytes.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert!(Packet::from_bytes(&damaged).is_err(), "bit {bit}");
        }
        for length in 0..bytes.len() {
            assert!(Packet::from_bytes(&bytes[..length]).is_err(), "cut to {length}");
        }
    }
}
