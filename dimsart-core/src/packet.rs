//! Packets between two controllers, and their byte layout.
//!
//! ```text
//! 3 u8 | counter u16 | echo u16 | content u16 | words × u32 | CRC-32 (poly 0xF4ACFB13) u32
//! ```
//! Little endian: an [`envelope`](crate::envelope) of [`Class::Packet`]. The channel is the envelope's data
//! id: both ends know it, so it is not sent, and a packet of another channel fails the CRC check.

pub mod checksum;
pub(crate) mod content;
pub mod envelope;
pub mod mailbox;

pub(crate) use checksum::CRC;
pub(crate) use mailbox::{LinkPort, LinkTimeout};

use heapless::Vec;

use crate::limits::MAX_PACKET_WORDS;
use crate::packet::envelope::{CRC_BYTES, Class, EnvelopeError, HEADER_BYTES, open, seal};

/// Bytes of echo and content.
const INNER_HEADER_BYTES: usize = 4;
/// Bytes around the words: header and CRC.
pub const PACKET_OVERHEAD: usize = HEADER_BYTES + INNER_HEADER_BYTES + CRC_BYTES;
/// Maximum packet size in bytes.
pub const MAX_PACKET_BYTES: usize = PACKET_OVERHEAD + 4 * MAX_PACKET_WORDS;

/// A packet between two controllers.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Packet {
    /// Channel, 0 to 2047; 0 on a point-to-point link.
    pub channel: u16,
    /// Sequence number, from 1. On overflow it skips [`START_COUNTERS`](crate::START_COUNTERS).
    pub counter: u16,
    /// Newest counter accepted from the peer; 0 for none.
    pub echo: u16,
    /// Meaning of the words: [`Content::id`](crate::Content::id).
    pub content: u16,
    /// Payload, as agreed between the comm modules.
    pub words: Vec<u32, MAX_PACKET_WORDS>,
}

/// Reason why a packet was refused. A refused packet changes nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum PacketError {
    /// Not a valid packet length.
    Length {
        /// Bytes received.
        bytes: usize,
    },
    /// Damaged, or from another channel.
    Crc,
    /// The counter is 0.
    Counter,
    /// Undamaged content of another class.
    Class {
        /// The class received.
        found: u8,
    },
    /// The link does not exist.
    NoLink,
}

impl core::fmt::Display for PacketError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Length { bytes } => write!(f, "invalid packet length: {bytes} bytes"),
            Self::Crc => write!(f, "wrong CRC: packet damaged or from another channel"),
            Self::Counter => write!(f, "invalid packet counter 0: counters are 1 to 65535"),
            Self::Class { found } => write!(f, "wrong message class {found}: packets have class 3"),
            Self::NoLink => write!(f, "the link does not exist"),
        }
    }
}

impl core::error::Error for PacketError {}

impl From<EnvelopeError> for PacketError {
    fn from(error: EnvelopeError) -> Self {
        match error {
            EnvelopeError::Length { bytes } => Self::Length { bytes },
            EnvelopeError::Crc => Self::Crc,
            EnvelopeError::Class { found } => Self::Class { found },
        }
    }
}

impl Packet {
    /// Encodes the packet.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8, MAX_PACKET_BYTES> {
        let mut bytes = Vec::new();
        let payload = INNER_HEADER_BYTES + 4 * self.words.len();
        // Cannot fail: the vector holds the longest packet, and the envelope limit is higher.
        let _ = bytes.resize_default(HEADER_BYTES + payload + CRC_BYTES);
        self.write_payload(bytes.get_mut(HEADER_BYTES..).unwrap_or_default());
        let _ = seal(Class::Packet, self.channel, self.counter, payload, &mut bytes);
        bytes
    }

    fn write_payload(&self, payload: &mut [u8]) {
        let Some((header, words)) = payload.split_first_chunk_mut::<INNER_HEADER_BYTES>() else { return };
        let ([echo, echo_high], [content, content_high]) =
            (self.echo.to_le_bytes(), self.content.to_le_bytes());
        *header = [echo, echo_high, content, content_high];
        let (chunks, _) = words.as_chunks_mut::<4>();
        for (chunk, word) in chunks.iter_mut().zip(&self.words) {
            *chunk = word.to_le_bytes();
        }
    }

    /// Decodes a packet of a channel.
    ///
    /// # Errors
    /// [`PacketError`] when the bytes are not one complete, undamaged packet of this channel.
    pub fn from_bytes(bytes: &[u8], channel: u16) -> Result<Self, PacketError> {
        let length = PacketError::Length { bytes: bytes.len() };
        let envelope = open(bytes, channel)?;
        if envelope.class != Class::Packet {
            return Err(PacketError::Class { found: envelope.class as u8 });
        }
        if envelope.counter == 0 {
            return Err(PacketError::Counter);
        }
        let header = envelope.payload.split_first_chunk::<INNER_HEADER_BYTES>();
        let (&[echo, echo_high, content, content_high], words) = header.ok_or(length)?;
        let (chunks, rest) = words.as_chunks::<4>();
        if !rest.is_empty() || chunks.len() > MAX_PACKET_WORDS {
            return Err(length);
        }
        Ok(Self {
            channel,
            counter: envelope.counter,
            echo: u16::from_le_bytes([echo, echo_high]),
            content: u16::from_le_bytes([content, content_high]),
            words: chunks.iter().map(|chunk| u32::from_le_bytes(*chunk)).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Packet {
        let words = [1, 0x8000_0000, 3].into_iter().collect();
        Packet { channel: 5, counter: 0x0203, echo: 0xFFFF, content: 0x1234, words }
    }

    #[test]
    fn bytes_are_as_documented_and_read_back() {
        let bytes = sample().to_bytes();
        assert_eq!(bytes.len(), PACKET_OVERHEAD + 12);
        assert_eq!(PACKET_OVERHEAD, 11);
        assert_eq!(bytes[..11], [3, 3, 2, 0xFF, 0xFF, 0x34, 0x12, 1, 0, 0, 0]);
        assert_eq!(Packet::from_bytes(&bytes, 5), Ok(sample()));
    }

    #[test]
    fn every_single_bit_error_and_every_cut_is_refused() {
        let bytes = sample().to_bytes();
        for bit in 0..bytes.len() * 8 {
            let mut damaged = bytes.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(Packet::from_bytes(&damaged, 5), Err(PacketError::Crc), "bit {bit}");
        }
        for length in 0..bytes.len() {
            assert!(Packet::from_bytes(&bytes[..length], 5).is_err(), "cut to {length}");
        }
    }

    #[test]
    fn a_packet_without_a_counter_is_refused() {
        let bytes = Packet { counter: 0, ..sample() }.to_bytes();
        assert_eq!(Packet::from_bytes(&bytes, 5), Err(PacketError::Counter));
    }

    #[test]
    fn what_is_meant_for_another_channel_or_is_no_packet_is_refused() {
        let bytes = sample().to_bytes();
        for channel in (0..=2047).filter(|channel| *channel != 5) {
            assert_eq!(Packet::from_bytes(&bytes, channel), Err(PacketError::Crc), "{channel}");
        }
        let mut buffer = [0; 32];
        for (class, payload) in [(Class::Request, 8), (Class::Packet, 3), (Class::Packet, 9)] {
            let sealed = seal(class, 5, 1, payload, &mut buffer).unwrap();
            let error = match class {
                Class::Packet => PacketError::Length { bytes: payload + 7 },
                _ => PacketError::Class { found: 1 },
            };
            assert_eq!(Packet::from_bytes(sealed, 5), Err(error));
        }
    }
}
