//! The exchange between an emulated board and its host, once per tick.
//!
//! ```text
//! frame   = length u16 | section*          length excludes itself
//! section = tag u8 | length u16 | bytes
//! ```
//! Little endian; at most [`MAX_FRAME_BYTES`] in total. The host sends first: its first frame describes the
//! device ([`Tag::Device`], one byte per axis: 0 linear, 1 rotary; [`Tag::Types`]), and the board replies
//! with a [`Tag::Hello`]. Each later frame of the host triggers one tick, and the reply contains the result
//! of that tick. The exchange is in lockstep, so results do not depend on the speed of either side.
//!
//! A host without a measurement sends NaN: the [tick](dimsart_core::Dimsart::tick) is refused and computes no
//! outputs, but commands are processed.

use crate::encode::encode_into;
use dimsart_core::TickResult;

/// Version of the exchange; the first byte of a [`Tag::Hello`].
pub const VERSION: u8 = 5;
/// Maximum length of a frame.
pub const MAX_FRAME_BYTES: usize = 16_384;
/// Maximum number of packets, over all links, in one frame of the host. The board receives all of them in
/// that tick.
pub const MAX_PACKETS: usize = 64;
/// Maximum size of the data base in a frame with all other sections, words.
pub const MAX_SIGNAL_WORDS: usize = 640;
const LENGTH_BYTES: usize = 2;
const HEADER_BYTES: usize = 3;
const MAX_OUTCOME_BYTES: usize = 24;

/// The type of a section.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Tag {
    /// Host to board, first frame: a byte per axis, 0 linear, 1 rotary.
    Device = 1,
    /// Board to host, first frame: [`VERSION`], then the board's name.
    Hello = 2,
    /// Words of the device's types: measurements to the board, commands back.
    Words = 3,
    /// Bytes of the command line: requests to the board, responses back.
    Command = 4,
    /// Board to host: the outcome of the tick, as [`Frame::push_outcome`] writes it.
    Outcome = 5,
    /// Board to host: the cycle counter before and after the tick, two u32, and its number of valid bits, u8.
    Stamps = 6,
    /// Host to board, empty: requests the data base. Board to host: its revision, u32, then the words of
    /// every signal, u32 each, in the order of [`Request::Entry`](crate::protocol::Request).
    Signals = 7,
    /// Board to host, in its last frame: a panic, an exception or the watchdog stopped the firmware. Contains
    /// the words at which the actuators remain, u32 each. The second of the [`Stamps`](Self::Stamps) that
    /// follow is the time.
    Stopped = 8,
    /// Host to board, first frame: ids of the measured types, u16 each; default: `POSITION`.
    Types = 9,
    /// A complete packet of link 0.
    Link0 = 16,
    /// A complete packet of link 1.
    Link1 = 17,
}

impl Tag {
    const ALL: [Self; 11] = [
        Self::Device,
        Self::Hello,
        Self::Words,
        Self::Command,
        Self::Outcome,
        Self::Stamps,
        Self::Signals,
        Self::Stopped,
        Self::Types,
        Self::Link0,
        Self::Link1,
    ];

    /// Returns the tag of a link's packets.
    #[must_use]
    pub fn of_link(link: usize) -> Option<Self> {
        [Self::Link0, Self::Link1].get(link).copied()
    }

    /// Returns the link of a packet's tag.
    #[must_use]
    pub fn link(self) -> Option<usize> {
        [Self::Link0, Self::Link1].iter().position(|tag| *tag == self)
    }
}

/// Errors in frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExchangeError {
    /// A frame of this many bytes exceeds [`MAX_FRAME_BYTES`].
    TooLong(usize),
    /// A section overruns its frame.
    SectionOverrun,
    /// Unknown tag: the two sides have different versions.
    UnknownTag(u8),
    /// Invalid outcome.
    Outcome,
}

impl core::fmt::Display for ExchangeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::TooLong(bytes) => {
                write!(
                    f,
                    "frame of {bytes} bytes exceeds the limit of {MAX_FRAME_BYTES} bytes: send less per tick"
                )
            }
            Self::SectionOverrun => {
                write!(f, "section exceeds the end of its frame: build both sides from the same version")
            }
            Self::UnknownTag(tag) => {
                write!(f, "unknown frame section {tag}: build both sides from the same version")
            }
            Self::Outcome => write!(f, "unknown tick outcome: build both sides from the same version"),
        }
    }
}

impl core::error::Error for ExchangeError {}

/// A frame to send, or partly received.
#[derive(Debug, Clone)]
pub struct Frame {
    bytes: [u8; MAX_FRAME_BYTES],
    length: usize,
}

impl Default for Frame {
    fn default() -> Self {
        Self::new()
    }
}

impl Frame {
    /// Creates an empty frame, for receiving.
    #[must_use]
    pub const fn new() -> Self {
        Self { bytes: [0; MAX_FRAME_BYTES], length: 0 }
    }

    /// Clears the frame, for sending.
    pub fn clear(&mut self) {
        self.put_length(LENGTH_BYTES);
    }

    /// Appends a section.
    ///
    /// # Errors
    /// [`ExchangeError::TooLong`] if it does not fit; the frame is unchanged.
    pub fn push(&mut self, tag: Tag, content: &[u8]) -> Result<(), ExchangeError> {
        self.push_with(tag, content.len(), |body| {
            if let Some(body) = body.get_mut(..content.len()) {
                body.copy_from_slice(content);
            }
        })
    }

    /// Appends a section of `bytes` bytes, written by `fill`.
    ///
    /// # Errors
    /// As [`push`](Self::push).
    #[inline]
    pub fn push_with(
        &mut self,
        tag: Tag,
        bytes: usize,
        fill: impl FnOnce(&mut [u8]),
    ) -> Result<(), ExchangeError> {
        let length = self.length + HEADER_BYTES + bytes;
        let too_long = ExchangeError::TooLong(length);
        let [low, high] = u16::try_from(bytes).map_err(|_| too_long)?.to_le_bytes();
        let space = self.bytes.get_mut(self.length..length).ok_or(too_long)?;
        let (header, body) = space.split_first_chunk_mut::<HEADER_BYTES>().ok_or(too_long)?;
        *header = [tag as u8, low, high];
        fill(body);
        self.put_length(length);
        Ok(())
    }

    /// Sets the total length, including the two length bytes.
    fn put_length(&mut self, length: usize) {
        self.length = length;
        // A frame's length always fits.
        let body = u16::try_from(length.saturating_sub(LENGTH_BYTES)).unwrap_or(u16::MAX);
        if let Some(start) = self.bytes.first_chunk_mut() {
            *start = body.to_le_bytes();
        }
    }

    /// Appends the outcome of the tick; `None` if there was no tick.
    ///
    /// # Errors
    /// As [`push`](Self::push).
    pub fn push_outcome(&mut self, outcome: Option<TickResult>) -> Result<(), ExchangeError> {
        let mut bytes = [0; MAX_OUTCOME_BYTES];
        let bytes = encode_into(&outcome, &mut bytes).ok_or(ExchangeError::Outcome)?;
        self.push(Tag::Outcome, bytes)
    }

    /// Returns the number of bytes available for one more section.
    #[must_use]
    pub fn free_bytes(&self) -> usize {
        MAX_FRAME_BYTES.saturating_sub(self.length + HEADER_BYTES)
    }

    /// Returns the frame's bytes, to be sent.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }

    /// Receives one frame, calling `read` until the frame is complete. `read` fills its argument from the
    /// start and returns the number of bytes read, or 0 at the end of the stream. Returns false at the end of
    /// the stream.
    ///
    /// # Errors
    /// [`ExchangeError::TooLong`], or the error of `read`; the stream is then unusable.
    pub fn receive<E: From<ExchangeError>>(
        &mut self,
        mut read: impl FnMut(&mut [u8]) -> Result<usize, E>,
    ) -> Result<bool, E> {
        self.length = 0;
        let mut filled = 0;
        loop {
            // The next frame arrives only after this one is answered.
            let more = read(self.bytes.get_mut(filled..).unwrap_or_default())?;
            if more == 0 {
                return Ok(false);
            }
            filled += more;
            let start = self.bytes.first_chunk().filter(|_| filled >= LENGTH_BYTES);
            let Some(whole) = start.map(|start| LENGTH_BYTES + usize::from(u16::from_le_bytes(*start)))
            else {
                continue;
            };
            if whole > MAX_FRAME_BYTES {
                return Err(ExchangeError::TooLong(whole).into());
            }
            if filled >= whole {
                self.length = whole;
                return Ok(true);
            }
        }
    }

    /// Iterates over the sections; stops after the first error.
    pub fn sections(&self) -> impl Iterator<Item = Result<(Tag, &[u8]), ExchangeError>> {
        let mut rest = self.as_bytes().get(LENGTH_BYTES..).unwrap_or_default();
        core::iter::from_fn(move || {
            let section = split(&mut rest)?;
            if section.is_err() {
                rest = &[];
            }
            Some(section)
        })
    }
}

/// Decodes the content of a [`Tag::Outcome`].
///
/// # Errors
/// [`ExchangeError::Outcome`] if it is invalid or unknown.
pub fn outcome(content: &[u8]) -> Result<Option<TickResult>, ExchangeError> {
    postcard::from_bytes(content).map_err(|_| ExchangeError::Outcome)
}

fn split<'a>(rest: &mut &'a [u8]) -> Option<Result<(Tag, &'a [u8]), ExchangeError>> {
    if rest.is_empty() {
        return None;
    }
    let Some((&[tag, low, high], behind)) = rest.split_first_chunk::<HEADER_BYTES>() else {
        return Some(Err(ExchangeError::SectionOverrun));
    };
    let Some((content, behind)) = behind.split_at_checked(usize::from(u16::from_le_bytes([low, high])))
    else {
        return Some(Err(ExchangeError::SectionOverrun));
    };
    *rest = behind;
    let known = Tag::ALL.into_iter().find(|known| *known as u8 == tag);
    Some(known.map(|tag| (tag, content)).ok_or(ExchangeError::UnknownTag(tag)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use dimsart_core::{FrameError, types};
    use std::vec::Vec;

    /// A frame is received whole, however the stream splits it.
    #[test]
    fn a_frame_survives_any_cutting() {
        let mut sent = Frame::new();
        sent.clear();
        sent.push(Tag::Words, &[1, 2, 3, 4]).unwrap();
        sent.push(Tag::Link1, &[]).unwrap();
        sent.push(Tag::Command, &[9; 300]).unwrap();
        for step in 1..sent.as_bytes().len() {
            let mut stream = sent.as_bytes().chunks(step);
            let mut received = Frame::new();
            let whole = received.receive::<ExchangeError>(|buffer| {
                let chunk = stream.next().unwrap_or_default();
                buffer[..chunk.len()].copy_from_slice(chunk);
                Ok(chunk.len())
            });
            assert_eq!(whole, Ok(true));
            let sections: Vec<_> = received.sections().map(Result::unwrap).collect();
            assert_eq!(
                sections,
                [(Tag::Words, [1, 2, 3, 4].as_slice()), (Tag::Link1, &[]), (Tag::Command, &[9; 300])]
            );
        }
    }

    #[test]
    fn a_section_that_does_not_fit_leaves_the_frame_as_it_was() {
        let mut frame = Frame::new();
        frame.clear();
        frame.push(Tag::Command, &[7; MAX_FRAME_BYTES - 96]).unwrap();
        let before = frame.as_bytes().to_vec();
        let room = frame.free_bytes();
        assert!(frame.push(Tag::Words, &std::vec![0; room + 1]).is_err());
        assert_eq!(frame.as_bytes(), before);
        frame.push(Tag::Words, &std::vec![0; room]).unwrap();
        assert_eq!(frame.as_bytes().len(), MAX_FRAME_BYTES);
    }

    fn received(bytes: &[u8]) -> Result<Frame, ExchangeError> {
        let mut frame = Frame::new();
        let whole = frame.receive(|buffer| {
            buffer[..bytes.len()].copy_from_slice(bytes);
            Ok::<_, ExchangeError>(bytes.len())
        })?;
        assert!(whole);
        Ok(frame)
    }

    #[test]
    fn what_is_no_frame_is_refused() {
        assert_eq!(received(&[0xff, 0xff, 0]).unwrap_err(), ExchangeError::TooLong(0x1_0001));
        let errors = |bytes: &[u8]| received(bytes).unwrap().sections().find_map(Result::err);
        assert_eq!(errors(&[2, 0, 3, 0]), Some(ExchangeError::SectionOverrun));
        assert_eq!(errors(&[3, 0, 3, 1, 0]), Some(ExchangeError::SectionOverrun));
        assert_eq!(errors(&[3, 0, 99, 0, 0]), Some(ExchangeError::UnknownTag(99)));
        assert_eq!(errors(&[0, 0]), None);
    }

    #[test]
    fn an_outcome_comes_back_as_it_was() {
        let refused = FrameError::NotFinite { signal: types::POSITION.first(), word: u16::MAX };
        let longest = FrameError::Length { expected: usize::MAX, found: usize::MAX };
        let ticks = [
            TickResult::Ran,
            TickResult::Idle,
            TickResult::MeasurementRefused(refused),
            TickResult::CommandRefused(longest),
            TickResult::Disarmed,
        ];
        for sent in ticks.map(Some).into_iter().chain([None]) {
            let mut frame = Frame::new();
            frame.clear();
            frame.push_outcome(sent).unwrap();
            let (tag, content) = frame.sections().next().unwrap().unwrap();
            assert_eq!((tag, outcome(content)), (Tag::Outcome, Ok(sent)));
        }
        assert_eq!(outcome(&[1, 9]), Err(ExchangeError::Outcome));
    }

    #[test]
    fn the_end_of_the_stream_is_no_frame() {
        assert_eq!(Frame::new().receive::<ExchangeError>(|_| Ok(0)), Ok(false));
    }
}
