//! Envelope of all data between controllers and hosts.
//!
//! ```text
//! class u8 | counter u16 | payload | CRC-32 (poly 0xF4ACFB13) u32     at most 256 bytes
//! ```
//! Little endian. The CRC covers the data id and everything before the CRC. The data id is not sent: both
//! ends know it, so data of another channel fails the CRC check like damaged data.
//!
//! This is end-to-end protection like AUTOSAR profile 4 (same polynomial, a counter, a data id) in a shorter
//! layout: Hamming distance 6 up to 256 bytes, at least 7 up to 32 bytes.

use crate::packet::checksum::CRC;

/// Maximum size of an envelope: the CRC's Hamming distance is 6 up to here.
pub const MAX_CONTENT_BYTES: usize = 256;
/// Bytes before the payload.
pub const HEADER_BYTES: usize = 3;
/// Bytes after the payload.
pub const CRC_BYTES: usize = 4;

/// Added to the class of an authenticated envelope: `auth`.
pub const AUTHENTICATED_FLAG: u8 = 0x80;

/// Purpose of an envelope. The layout of a released class never changes: a new layout is a new class.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Class {
    /// Request of a host: `dimsart_link::protocol`.
    Request = 1,
    /// Response of a controller.
    Response = 2,
    /// Cyclic packet of a comm module: [`Packet`](crate::Packet).
    Packet = 3,
    /// Signals that a client has subscribed to: `dimsart_link::protocol::Sample`.
    Telemetry = 4,
    /// Heartbeat of a controller: `dimsart_link::protocol::Heartbeat`.
    Heartbeat = 5,
    /// Handshake that establishes freshness: `auth`.
    Handshake = 6,
}

impl Class {
    const ALL: [Self; 6] =
        [Self::Request, Self::Response, Self::Packet, Self::Telemetry, Self::Heartbeat, Self::Handshake];

    fn from_byte(byte: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|class| *class as u8 == byte)
    }
}

/// Undamaged content of the right channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Envelope<'c> {
    /// Purpose.
    pub class: Class,
    /// Sequence number in a channel; in a response, the counter of its request.
    pub counter: u16,
    /// Payload.
    pub payload: &'c [u8],
}

/// Reason why bytes are not a valid envelope. Nothing has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum EnvelopeError {
    /// Invalid length.
    Length {
        /// Bytes received.
        bytes: usize,
    },
    /// Damaged, or from another channel.
    Crc,
    /// Undamaged, but of an unknown class.
    Class {
        /// The class received.
        found: u8,
    },
}

/// Completes an envelope in `buffer`, whose payload of `length` bytes starts at [`HEADER_BYTES`]. Returns
/// none if the envelope is too long or does not fit the buffer.
pub fn seal(class: Class, channel: u16, counter: u16, length: usize, buffer: &mut [u8]) -> Option<&[u8]> {
    let [low, high] = counter.to_le_bytes();
    *buffer.first_chunk_mut()? = [class as u8, low, high];
    append_crc(channel, HEADER_BYTES.checked_add(length)?, buffer)
}

/// Appends the CRC to the first `end` bytes of `buffer`.
pub fn append_crc(channel: u16, end: usize, buffer: &mut [u8]) -> Option<&[u8]> {
    let whole = end.checked_add(CRC_BYTES).filter(|whole| *whole <= MAX_CONTENT_BYTES)?;
    let (content, rest) = buffer.split_at_mut_checked(end)?;
    *rest.first_chunk_mut()? = crc(channel, content).to_le_bytes();
    buffer.get(..whole)
}

/// Checks and parses an envelope of a channel.
///
/// # Errors
/// [`EnvelopeError`] when the bytes are not one complete, undamaged envelope of that channel and a known
/// class.
pub fn open(content: &[u8], channel: u16) -> Result<Envelope<'_>, EnvelopeError> {
    parse(verify(content, channel)?)
}

/// Checks the CRC for a channel and returns the envelope without it.
///
/// # Errors
/// [`EnvelopeError::Length`] or [`EnvelopeError::Crc`].
pub fn verify(content: &[u8], channel: u16) -> Result<&[u8], EnvelopeError> {
    let length = EnvelopeError::Length { bytes: content.len() };
    let (covered, found) = content.split_last_chunk::<CRC_BYTES>().ok_or(length)?;
    if covered.len() < HEADER_BYTES || content.len() > MAX_CONTENT_BYTES {
        return Err(length);
    }
    let is_right = crc(channel, covered) == u32::from_le_bytes(*found);
    is_right.then_some(covered).ok_or(EnvelopeError::Crc)
}

/// Parses the bytes that [`verify`] has returned.
///
/// # Errors
/// [`EnvelopeError::Length`] or [`EnvelopeError::Class`].
pub fn parse(covered: &[u8]) -> Result<Envelope<'_>, EnvelopeError> {
    let length = EnvelopeError::Length { bytes: covered.len() };
    let (&[class, low, high], payload) = covered.split_first_chunk::<HEADER_BYTES>().ok_or(length)?;
    let class = Class::from_byte(class).ok_or(EnvelopeError::Class { found: class })?;
    Ok(Envelope { class, counter: u16::from_le_bytes([low, high]), payload })
}

/// Computes the CRC over the data id (the channel as 32 bits) and the covered bytes.
fn crc(channel: u16, covered: &[u8]) -> u32 {
    let mut digest = CRC.digest();
    digest.update(&u32::from(channel).to_le_bytes());
    digest.update(covered);
    digest.finalize()
}
