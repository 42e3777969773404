//! Finds undamaged frames in a stream of bytes.

use super::frame::check;
use crate::carrier::stream::{Dropped, StreamReceiver};

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

/// Takes the bytes of a line and gives the undamaged frames in them: a [`StreamReceiver`] that looks at the CRC.
#[derive(Debug, Default)]
pub struct Receiver {
    stream: StreamReceiver,
    frames: u32,
    refused: u32,
}

impl Receiver {
    /// A receiver that has seen nothing yet.
    #[must_use]
    pub const fn new() -> Self {
        Self { stream: StreamReceiver::new(), frames: 0, refused: 0 }
    }

    /// Takes a byte; gives the content of the frame that it ended, if it ended a good one.
    ///
    /// The content goes to [`decode_request`](super::decode_request),
    /// [`decode_response`](super::decode_response) or [`answer`](super::answer).
    pub fn take(&mut self, byte: u8) -> Option<&[u8]> {
        let content = check(self.stream.take(byte)?);
        let counter = if content.is_some() { &mut self.frames } else { &mut self.refused };
        *counter = counter.saturating_add(1);
        content
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
        let Dropped { damaged, too_long } = self.stream.dropped();
        Counters { frames: self.frames, damaged: damaged.saturating_add(self.refused), too_long }
    }
}
