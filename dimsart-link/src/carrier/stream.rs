//! Contents in a stream of bytes, such as a UART's: `0 | COBS(content) | 0`.
//!
//! Zero stands only between frames, so whatever a line made of one frame, the next one is found.

use cobs::{DecodeResult, DecoderState};
use heapless::Vec;

use dimsart_core::envelope::MAX_CONTENT_BYTES;

/// Longest frame, with a zero at both ends.
pub const MAX_FRAME_BYTES: usize = cobs::max_encoding_length(MAX_CONTENT_BYTES) + 2;

/// Writes the frame of a content to the start of `out`. None when it does not fit; [`MAX_FRAME_BYTES`] are always
/// enough.
pub fn encode<'o>(content: &[u8], out: &'o mut [u8]) -> Option<&'o [u8]> {
    let (start, rest) = out.split_first_mut()?;
    let length = cobs::try_encode(content, rest).ok()?;
    *start = 0;
    *rest.get_mut(length)? = 0;
    out.get(..length + 2)
}

/// What a [`StreamReceiver`] dropped. Counters stop at their largest number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Dropped {
    /// Not COBS: bytes were lost, added or changed.
    pub damaged: u32,
    /// Longer than a content can be.
    pub too_long: u32,
}

/// Takes the bytes of a line and gives the contents in them.
///
/// It holds one content, never waits and cannot overflow. Noise costs the frame it falls into: the next
/// zero ends whatever was begun.
#[derive(Debug, Default)]
pub struct StreamReceiver {
    state: DecoderState,
    content: Vec<u8, MAX_CONTENT_BYTES>,
    is_too_long: bool,
    dropped: Dropped,
}

impl StreamReceiver {
    /// A receiver that has seen nothing yet.
    #[must_use]
    pub const fn new() -> Self {
        let dropped = Dropped { damaged: 0, too_long: 0 };
        Self { state: DecoderState::Idle, content: Vec::new(), is_too_long: false, dropped }
    }

    /// Takes a byte; gives the content that it ended, if any. Its CRC was not looked at.
    pub fn take(&mut self, byte: u8) -> Option<&[u8]> {
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

    /// What was dropped so far.
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
