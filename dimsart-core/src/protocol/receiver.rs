//! Finds frames in a stream of bytes.

use cobs::{DecodeResult, DecoderState};
use heapless::Vec;

use super::frame::check;
use crate::envelope::MAX_CONTENT_BYTES;

/// What a [`Receiver`] has taken and refused. Counters stop at their largest number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Whole, undamaged frames.
    pub frames: u32,
    /// Refused: not a frame, or its CRC is wrong.
    pub damaged: u32,
    /// Refused: longer than a frame can be.
    pub too_long: u32,
}

/// Takes the bytes of a line and gives the frames in them.
///
/// It holds one frame, never waits and cannot overflow. Noise costs the frame it falls into: the next
/// zero ends whatever was begun.
#[derive(Debug, Default)]
pub struct Receiver {
    state: DecoderState,
    content: Vec<u8, MAX_CONTENT_BYTES>,
    is_too_long: bool,
    counters: Counters,
}

impl Receiver {
    /// A receiver that has seen nothing yet.
    #[must_use]
    pub const fn new() -> Self {
        let counters = Counters { frames: 0, damaged: 0, too_long: 0 };
        Self { state: DecoderState::Idle, content: Vec::new(), is_too_long: false, counters }
    }

    /// Takes a byte; gives the content of the frame that it ended, if it ended a good one.
    ///
    /// The content goes to [`decode_request`](super::decode_request),
    /// [`decode_response`](super::decode_response) or [`answer`](super::answer).
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

    /// Takes many bytes; `on_frame` gets the content of every good frame that ends in them.
    pub fn take_all(&mut self, bytes: &[u8], mut on_frame: impl FnMut(&[u8])) {
        for byte in bytes {
            if let Some(content) = self.take(*byte) {
                on_frame(content);
            }
        }
    }

    /// What was taken and refused so far.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.counters
    }

    fn end(&mut self, is_complete: bool) -> Option<&[u8]> {
        let content = if is_complete && !self.is_too_long { check(&self.content) } else { None };
        let counter = match content {
            Some(_) => &mut self.counters.frames,
            None if self.is_too_long => &mut self.counters.too_long,
            None => &mut self.counters.damaged,
        };
        *counter = counter.saturating_add(1);
        content
    }
}
