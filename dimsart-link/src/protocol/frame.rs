//! Frames of requests and responses in a byte stream.

use serde::{Deserialize, Serialize};

use crate::carrier::stream;
use crate::encode::encode_into;
use dimsart_core::envelope::{CRC_BYTES, Class, HEADER_BYTES, MAX_CONTENT_BYTES, parse, seal, verify};

pub use crate::carrier::stream::MAX_FRAME_BYTES;

/// The channel between hosts and one controller.
pub(super) const CHANNEL: u16 = 0;

/// The buffer is too small for the frame; [`MAX_FRAME_BYTES`] are always enough.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BufferTooSmall;

impl core::fmt::Display for BufferTooSmall {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "buffer too small for the frame: {MAX_FRAME_BYTES} bytes are always enough")
    }
}

impl core::error::Error for BufferTooSmall {}

/// Errors in the content of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum DecodeError {
    /// A response where a request is expected, or the reverse.
    UnexpectedClass,
    /// Intact, but of a different protocol version.
    Unsupported {
        /// The frame's id.
        id: u16,
    },
}

impl core::fmt::Display for DecodeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::UnexpectedClass => {
                write!(f, "unexpected frame: a response instead of a request, or the reverse")
            }
            Self::Unsupported { id } => {
                write!(f, "cannot decode frame {id}: compare both sides' protocol versions")
            }
        }
    }
}

impl core::error::Error for DecodeError {}

/// Errors in encoding.
pub(super) enum EncodeError {
    /// The payload exceeds [`MAX_CONTENT_BYTES`].
    TooLong,
    /// The frame does not fit the buffer.
    BufferTooSmall,
}

/// Encodes a frame into `out`; returns its length.
pub(super) fn encode(
    class: Class,
    id: u16,
    payload: &impl Serialize,
    out: &mut [u8],
) -> Result<usize, EncodeError> {
    let mut buffer = [0; MAX_CONTENT_BYTES];
    let room = buffer.get_mut(HEADER_BYTES..MAX_CONTENT_BYTES - CRC_BYTES);
    let payload = room.and_then(|room| encode_into(payload, room));
    let length = payload.ok_or(EncodeError::TooLong)?.len();
    seal_frame(class, id, length, &mut buffer, out).ok_or(EncodeError::BufferTooSmall)
}

/// Encodes the frame of the payload at [`HEADER_BYTES`] of `buffer` into `out`; returns its length.
#[inline(never)]
pub(super) fn seal_frame(
    class: Class,
    counter: u16,
    length: usize,
    buffer: &mut [u8; MAX_CONTENT_BYTES],
    out: &mut [u8],
) -> Option<usize> {
    stream::encode(seal(class, CHANNEL, counter, length, buffer)?, out).map(<[u8]>::len)
}

/// Returns the content without its CRC, if the CRC is valid.
pub(super) fn check(content: &[u8]) -> Option<&[u8]> {
    verify(content, CHANNEL).ok()
}

/// Decodes id and payload of a content that passed [`check`].
pub(super) fn decode<'c, T: Deserialize<'c>>(
    class: Class,
    content: &'c [u8],
) -> Result<(u16, T), DecodeError> {
    let envelope = parse(content).map_err(|_| DecodeError::UnexpectedClass)?;
    if envelope.class != class {
        return Err(DecodeError::UnexpectedClass);
    }
    match postcard::take_from_bytes(envelope.payload) {
        Ok((value, [])) => Ok((envelope.counter, value)),
        _ => Err(DecodeError::Unsupported { id: envelope.counter }),
    }
}
