//! The envelope of all that travels between controllers and hosts.
//!
//! ```text
//! class u8 | counter u16 | payload | CRC-32 (poly 0xF4ACFB13) u32     at most 256 bytes
//! ```
//! Little endian. The CRC covers the data id and all before it. The data id is not sent: both ends know it. What
//! was meant for another channel is refused like what was damaged.
//!
//! This is end-to-end protection in the manner of AUTOSAR's profile 4 (same polynomial, a counter, a data id), in
//! a shorter layout: Hamming distance 6 up to 256 bytes, 7 and more up to 32.

use crate::packet::checksum::CRC;

/// Longest content, all included: the CRC's Hamming distance is 6 up to here.
pub const MAX_CONTENT_BYTES: usize = 256;
/// Bytes before the payload.
pub const HEADER_BYTES: usize = 3;
/// Bytes behind the payload.
pub const CRC_BYTES: usize = 4;

/// Added to the class of a content that has a tag: `auth`.
pub const TAGGED: u8 = 0x80;

/// What an envelope is for. What is behind it never changes once it was released: a new layout is a new class.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Class {
    /// A host asks: `dimsart_link::protocol`.
    Request = 1,
    /// A controller answers a request.
    Response = 2,
    /// What a comm module sends, cyclically: [`Packet`](crate::Packet).
    Packet = 3,
    /// Signals that a client asked to be sent again and again: `dimsart_link::protocol::Sample`.
    Telemetry = 4,
    /// A controller says how it is doing: `dimsart_link::protocol::Heartbeat`.
    Heartbeat = 5,
    /// Two ends agree on what is fresh: `auth`.
    Handshake = 6,
}

impl Class {
    const ALL: [Self; 6] =
        [Self::Request, Self::Response, Self::Packet, Self::Telemetry, Self::Heartbeat, Self::Handshake];

    fn from_byte(byte: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|class| *class as u8 == byte)
    }
}

/// An undamaged content of the right channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Envelope<'c> {
    /// What it is for.
    pub class: Class,
    /// Counts the contents of a channel, or tells which request a response answers.
    pub counter: u16,
    /// What is inside.
    pub payload: &'c [u8],
}

/// Why bytes are no envelope. Nothing has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum EnvelopeError {
    /// Shorter or longer than an envelope can be.
    Length {
        /// Bytes received.
        bytes: usize,
    },
    /// Damaged on the way, or meant for another channel.
    Crc,
    /// Undamaged, and of a class that this version does not know.
    Class {
        /// The class received.
        found: u8,
    },
}

/// Closes an envelope around the payload that is at [`HEADER_BYTES`] of `buffer`, `length` bytes long. None when it
/// does not fit the buffer or is too long.
pub fn seal(class: Class, channel: u16, counter: u16, length: usize, buffer: &mut [u8]) -> Option<&[u8]> {
    let [low, high] = counter.to_le_bytes();
    *buffer.first_chunk_mut()? = [class as u8, low, high];
    close(channel, HEADER_BYTES.checked_add(length)?, buffer)
}

/// Puts the CRC behind the first `end` bytes of `buffer`.
pub fn close(channel: u16, end: usize, buffer: &mut [u8]) -> Option<&[u8]> {
    let whole = end.checked_add(CRC_BYTES).filter(|whole| *whole <= MAX_CONTENT_BYTES)?;
    let (content, rest) = buffer.split_at_mut_checked(end)?;
    *rest.first_chunk_mut()? = crc(channel, content).to_le_bytes();
    buffer.get(..whole)
}

/// Opens an envelope of a channel.
///
/// # Errors
/// [`EnvelopeError`] when the bytes are not one whole, undamaged envelope of that channel and a known class.
pub fn open(content: &[u8], channel: u16) -> Result<Envelope<'_>, EnvelopeError> {
    parse(verify(content, channel)?)
}

/// An envelope without its CRC, if that is right for the channel.
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

/// Reads what [`verify`] let through.
///
/// # Errors
/// [`EnvelopeError::Length`] or [`EnvelopeError::Class`].
pub fn parse(covered: &[u8]) -> Result<Envelope<'_>, EnvelopeError> {
    let length = EnvelopeError::Length { bytes: covered.len() };
    let (&[class, low, high], payload) = covered.split_first_chunk::<HEADER_BYTES>().ok_or(length)?;
    let class = Class::from_byte(class).ok_or(EnvelopeError::Class { found: class })?;
    Ok(Envelope { class, counter: u16::from_le_bytes([low, high]), payload })
}

/// The data id comes first, as a 32-bit number: the channel.
fn crc(channel: u16, covered: &[u8]) -> u32 {
    let mut digest = CRC.digest();
    digest.update(&u32::from(channel).to_le_bytes());
    digest.update(covered);
    digest.finalize()
}
