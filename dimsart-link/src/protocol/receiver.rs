//! Finds valid frames in a byte stream.

use super::frame::check;
use crate::carrier::stream::{Dropped, StreamReceiver};

/// Counters of a [`Receiver`] (saturating).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Valid frames.
    pub frames: u32,
    /// Rejected: invalid framing or CRC.
    pub damaged: u32,
    /// Rejected: too long.
    pub too_long: u32,
}

/// Finds valid frames in a byte stream: a [`StreamReceiver`] that checks the CRC.
#[derive(Debug, Default)]
pub struct Receiver {
    stream: StreamReceiver,
    frames: u32,
    refused: u32,
}

impl Receiver {
    /// Creates an empty receiver.
    #[must_use]
    pub const fn new() -> Self {
        Self { stream: StreamReceiver::new(), frames: 0, refused: 0 }
    }

    /// Adds a byte; returns the content of the valid frame that it completes, if any.
    ///
    /// The content goes to [`decode_request`](super::decode_request),
    /// [`decode_response`](super::decode_response) or [`answer`](super::answer).
    pub fn push(&mut self, byte: u8) -> Option<&[u8]> {
        let content = check(self.stream.push(byte)?);
        let counter = if content.is_some() { &mut self.frames } else { &mut self.refused };
        *counter = counter.saturating_add(1);
        content
    }

    /// Adds bytes; calls `on_frame` with the content of every valid frame.
    pub fn push_all(&mut self, bytes: &[u8], mut on_frame: impl FnMut(&[u8])) {
        for byte in bytes {
            if let Some(content) = self.push(*byte) {
                on_frame(content);
            }
        }
    }

    /// Returns the counters.
    #[must_use]
    pub fn counters(&self) -> Counters {
        let Dropped { damaged, too_long } = self.stream.dropped();
        Counters { frames: self.frames, damaged: damaged.saturating_add(self.refused), too_long }
    }
}
