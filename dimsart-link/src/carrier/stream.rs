//! Contents in a byte stream, such as a UART: `0 | COBS(content) | 0`.
//!
//! A zero occurs only between frames, so a receiver resynchronises after any corruption.

use cobs::{DecodeResult, DecoderState};
use heapless::Vec;

use dimsart_core::envelope::MAX_CONTENT_BYTES;

/// Maximum length of a frame, including the zeros at both ends.
pub const MAX_FRAME_BYTES: usize = cobs::max_encoding_length(MAX_CONTENT_BYTES) + 2;

/// Encodes a content into `out`. `None` if it does not fit; [`MAX_FRAME_BYTES`] are always enough.
pub fn encode<'o>(content: &[u8], out: &'o mut [u8]) -> Option<&'o [u8]> {
    let (start, rest) = out.split_first_mut()?;
    let length = cobs::try_encode(content, rest).ok()?;
    *start = 0;
    *rest.get_mut(length)? = 0;
    out.get(..length + 2)
}

/// Counters of the frames that a [`StreamReceiver`] dropped (saturating).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Dropped {
    /// Invalid COBS: bytes were lost, added or changed.
    pub damaged: u32,
    /// Exceeds the maximum content.
    pub too_long: u32,
}

/// Finds contents in a byte stream.
///
/// Buffers one content, never blocks and cannot overflow. Noise affects only the current frame: the next zero
/// ends it.
#[derive(Debug, Default)]
pub struct StreamReceiver {
    state: DecoderState,
    content: Vec<u8, MAX_CONTENT_BYTES>,
    is_too_long: bool,
    dropped: Dropped,
}

impl StreamReceiver {
    /// Creates an empty receiver.
    #[must_use]
    pub const fn new() -> Self {
        let dropped = Dropped { damaged: 0, too_long: 0 };
        Self { state: DecoderState::Idle, content: Vec::new(), is_too_long: false, dropped }
    }

    /// Adds a byte; returns the content that it completes, if any. The CRC is not checked.
    pub fn push(&mut self, byte: u8) -> Option<&[u8]> {
        match self.state.feed(byte) {
            Ok(DecodeResult::NoData) => None,
            Ok(DecodeResult::DataStart) => {
                self.content.clear();
                self.is_too_long = false;
                None
            }
            Ok(DecodeResult::DataContinue(byte)) => {
                self.is_too_long |= self.content.push(byte).is_err();
                None
            }
            Ok(DecodeResult::DataComplete) => self.end(true),
            Err(_) => self.end(false),
        }
    }

    /// Returns the counters of dropped frames.
    #[must_use]
    pub fn dropped(&self) -> Dropped {
        self.dropped
    }

    fn end(&mut self, is_whole: bool) -> Option<&[u8]> {
        let counter = match (is_whole, self.is_too_long) {
            (true, false) => return Some(&self.content),
            (_, true) => &mut self.dropped.too_long,
            (false, false) => &mut self.dropped.damaged,
        };
        *counter = counter.saturating_add(1);
        None
    }
}
