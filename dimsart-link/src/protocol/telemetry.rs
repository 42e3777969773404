//! Telemetry: signals that a device sends at an interval.
//!
//! ```text
//! payload  id u16 | tick u32 | words u32 each        little endian; class 4; the frame's counter counts samples
//! ```
//! The id is that of the last [request](super::Request::Telemetry) that changed the stream; the words are
//! those of its signals, in order of index. A gap in the counter means dropped samples. Each stream has its
//! own id and counter; a controller on a host has several streams.

use heapless::Vec;

use super::client::{NO_CLIENT, request_client};
use super::frame::{BufferTooSmall, DecodeError, seal_frame};
use super::refusal::Refusal;
use dimsart_core::envelope::{Class, HEADER_BYTES, MAX_CONTENT_BYTES, parse};
use dimsart_core::{DataBase, TypeRef};

/// Maximum number of signals per stream.
pub const MAX_TELEMETRY_SIGNALS: usize = 4;
/// Maximum number of words of all signals of a stream.
pub const MAX_TELEMETRY_WORDS: usize = 12;
const FIXED_BYTES: usize = 6;

/// Signals of one tick.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sample {
    /// Counts the samples of a stream, including dropped ones.
    pub counter: u16,
    /// Id of the request.
    pub id: u16,
    /// Number of the tick, from 1; it wraps.
    pub tick: u32,
    /// The words of the signals, concatenated.
    pub words: Vec<u32, MAX_TELEMETRY_WORDS>,
}

/// Encodes the frame of a sample into `out`.
///
/// # Errors
/// [`BufferTooSmall`] if `out` is too small; [`MAX_FRAME_BYTES`](super::MAX_FRAME_BYTES) are enough.
pub fn encode_sample<'o>(sample: &Sample, out: &'o mut [u8]) -> Result<&'o [u8], BufferTooSmall> {
    let mut buffer = [0; MAX_CONTENT_BYTES];
    let [id_low, id_high] = sample.id.to_le_bytes();
    let [a, b, c, d] = sample.tick.to_le_bytes();
    let words = sample.words.iter().flat_map(|word| word.to_le_bytes());
    let payload = [id_low, id_high, a, b, c, d].into_iter().chain(words);
    let mut length = 0;
    for (to, from) in buffer.iter_mut().skip(HEADER_BYTES).zip(payload) {
        *to = from;
        length += 1;
    }
    let length =
        seal_frame(Class::Telemetry, sample.counter, length, &mut buffer, out).ok_or(BufferTooSmall)?;
    out.get(..length).ok_or(BufferTooSmall)
}

/// Decodes a sample from a frame's content.
///
/// # Errors
/// [`DecodeError`] if it is another message.
pub fn decode_sample(content: &[u8]) -> Result<Sample, DecodeError> {
    let envelope = parse(content).map_err(|_| DecodeError::UnexpectedClass)?;
    if envelope.class != Class::Telemetry {
        return Err(DecodeError::UnexpectedClass);
    }
    let counter = envelope.counter;
    let not_understood = DecodeError::Unsupported { id: counter };
    let (fixed, words) = envelope.payload.split_first_chunk::<FIXED_BYTES>().ok_or(not_understood)?;
    let [id_low, id_high, a, b, c, d] = *fixed;
    let (words, rest) = words.as_chunks::<4>();
    if !rest.is_empty() || words.len() > MAX_TELEMETRY_WORDS {
        return Err(not_understood);
    }
    let words = words.iter().map(|word| u32::from_le_bytes(*word)).collect();
    let (id, tick) = (u16::from_le_bytes([id_low, id_high]), u32::from_le_bytes([a, b, c, d]));
    Ok(Sample { counter, id, tick, words })
}

/// A [`Request::Telemetry`](super::Request::Telemetry) and its id.
pub(super) struct Wanted {
    pub(super) id: u16,
    pub(super) place: u8,
    pub(super) signal: TypeRef,
    pub(super) every_ticks: u32,
}

/// A telemetry stream to one client, until the client ends it or is silent. Indices beyond one stream belong
/// to the next stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stream {
    /// Id of the request; 0: none.
    id: u16,
    signals: [Option<TypeRef>; MAX_TELEMETRY_SIGNALS],
    words: u8,
    every_ticks: u32,
    counter: u16,
    /// Ticks until the client counts as gone.
    patience_ticks: u32,
}

impl Stream {
    pub(super) const NONE: Self = Self {
        id: 0,
        signals: [None; MAX_TELEMETRY_SIGNALS],
        words: 0,
        every_ticks: 0,
        counter: 0,
        patience_ticks: 0,
    };

    /// Handles a client's request; returns the words of a sample.
    pub(super) fn ask(
        &mut self,
        wanted: Wanted,
        place: usize,
        patience_ticks: u32,
        data_base: &DataBase,
    ) -> Result<u8, Refusal> {
        let Wanted { id, signal, every_ticks, .. } = wanted;
        let [client, holder] = [id, self.id].map(request_client);
        if holder != NO_CLIENT && holder != client {
            return Err(Refusal::Telemetry { client: holder });
        }
        if client == NO_CLIENT || patience_ticks == 0 {
            return Err(Refusal::NotFound);
        }
        let mut next = if place == 0 { Self::NONE } else { *self };
        *next.signals.get_mut(place).ok_or(Refusal::TooLong)? = Some(signal);
        let mut words = 0;
        for signal in next.signals.iter().flatten() {
            words += data_base.words(data_base.slot(*signal).ok_or(Refusal::NotFound)?).len();
        }
        let words = u8::try_from(words).unwrap_or(u8::MAX);
        if usize::from(words) > MAX_TELEMETRY_WORDS {
            return Err(Refusal::TooLong);
        }
        *self = if every_ticks == 0 {
            Self::NONE
        } else {
            Self { id, words, every_ticks, counter: 0, patience_ticks, ..next }
        };
        Ok(self.words)
    }

    /// Records activity of a client.
    pub(super) fn hear(&mut self, id: u16, patience_ticks: u32) {
        if request_client(id) == request_client(self.id) {
            self.patience_ticks = patience_ticks;
        }
    }

    /// Counts a tick; returns a sample if one is due.
    pub(super) fn sample(&mut self, tick: u32, data_base: &DataBase) -> Option<Sample> {
        if self.id == 0 {
            return None;
        }
        let Some(patience) = self.patience_ticks.checked_sub(1) else {
            *self = Self::NONE;
            return None;
        };
        self.patience_ticks = patience;
        // Based on the tick number, so that all streams of a client sample the same ticks.
        if !tick.is_multiple_of(self.every_ticks) {
            return None;
        }
        let mut words = Vec::new();
        for signal in self.signals.iter().flatten() {
            let found = data_base.slot(*signal).map(|slot| data_base.words(slot)).unwrap_or_default();
            let _ = words.extend_from_slice(found);
        }
        // The scheme's signals changed: the stream ends.
        if words.len() != usize::from(self.words) {
            *self = Self::NONE;
            return None;
        }
        let counter = self.counter;
        self.counter = counter.wrapping_add(1);
        Some(Sample { counter, id: self.id, tick, words })
    }
}
