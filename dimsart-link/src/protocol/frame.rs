//! Requests and responses as frames of a byte stream.

use serde::{Deserialize, Serialize};

use crate::carrier::stream;
use crate::encode::encode_into;
use dimsart_core::envelope::{CRC_BYTES, Class, HEADER_BYTES, MAX_CONTENT_BYTES, parse, seal, verify};

pub use crate::carrier::stream::MAX_FRAME_BYTES;

/// The channel of all that is between hosts and one controller.
pub(super) const CHANNEL: u16 = 0;

/// The buffer is too small for the frame; one of [`MAX_FRAME_BYTES`] never is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct NoRoom;

impl core::fmt::Display for NoRoom {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "buffer too small for the frame: {MAX_FRAME_BYTES} bytes are always enough")
    }
}

impl core::error::Error for NoRoom {}

/// Why the content of a frame is not what was asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum DecodeError {
    /// The frame is for somebody else: a response where requests are taken, or the reverse.
    OtherClass,
    /// Undamaged, but of a version that knows more, or less.
    NotUnderstood {
        /// The frame's id.
        id: u16,
    },
}

impl core::fmt::Display for DecodeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::OtherClass => write!(f, "the frame is for another receiver"),
            Self::NotUnderstood { id } => {
                write!(f, "frame {id} is not understood: compare both sides' protocol versions")
            }
        }
    }
}

impl core::error::Error for DecodeError {}

/// Why a frame was not made.
pub(super) enum EncodeError {
    /// The payload does not fit [`MAX_CONTENT_BYTES`].
    TooLong,
    /// The frame does not fit the buffer.
    NoRoom,
}

/// Writes a frame to the start of `out` and gives its length.
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
    seal_frame(class, id, length, &mut buffer, out).ok_or(EncodeError::NoRoom)
}

/// Writes the frame of the payload that is at [`HEADER_BYTES`] of `buffer` to the start of `out` and gives its
/// length.
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

/// The content without its CRC, if that is right.
pub(super) fn check(content: &[u8]) -> Option<&[u8]> {
    verify(content, CHANNEL).ok()
}

/// Reads id and payload of a content that [`check`] let through.
pub(super) fn decode<'c, T: Deserialize<'c>>(
    class: Class,
    content: &'c [u8],
) -> Result<(u16, T), DecodeError> {
    let envelope = parse(content).map_err(|_| DecodeError::OtherClass)?;
    if envelope.class != class {
        return Err(DecodeError::OtherClass);
    }
    match postcard::take_from_bytes(envelope.payload) {
        Ok((value, [])) => Ok((envelope.counter, value)),
        _ => Err(DecodeError::NotUnderstood { id: envelope.counter }),
    }
}
