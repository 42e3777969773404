//! Packets in classic CAN frames of at most 8 bytes, one word per frame.
//!
//! ```text
//! CRC-8 | index (high 4 bits), counter (low 4 bits) | head u16, frames 0 to 2 | word u32, while there are words
//! head 0   the counter, its low 4 bits replaced by the index of the last frame
//! head 1   echo
//! head 2   content
//! ```
//! A word is never split, so every CAN tool can display it. A packet has one frame per word, and at least 3.
//!
//! Freshness and tag of an authenticated packet take one more word, and a head in each of frames 3 and 4:
//! such a packet has at least 5 frames. The class is not sent: both ends know whether packets are
//! authenticated. Counter 0 marks a handshake.
//!
//! Little endian. The envelope is removed and restored by the receiver.
//!
//! The CRC-8 (polynomial 0x2F, Hamming distance 4 here) covers the bytes after it and two bytes that are not
//! sent: the frame's [`data_id`] and, from frame 1 on, the upper 8 bits of the packet's 12-bit counter. A
//! frame of another channel or packet is therefore rejected, until the counter repeats after 4096 packets.
//! The scheme follows AUTOSAR profile 22 (same polynomial, 4-bit counter, list of 16 data ids) with a
//! different layout.

use heapless::Vec;

use dimsart_core::checksum::CRC_8;
use dimsart_core::envelope::{AUTHENTICATED_FLAG, CRC_BYTES, Class, HEADER_BYTES, append_crc, verify};

/// Maximum data of a classic CAN frame, bytes.
pub const MAX_DATA_BYTES: usize = 8;
/// Maximum number of words in a packet on classic CAN.
pub const MAX_WORDS: usize = 16;

const PACKET: u8 = Class::Packet as u8;
const HANDSHAKE: u8 = Class::Handshake as u8;
/// Number of frames with a part of the header: counter, echo, content.
const HEAD_FRAMES: u8 = 3;
/// The same for an authenticated packet, which ends with a part of the tag.
const TAGGED_HEAD_FRAMES: u8 = 5;
/// Bytes of the tag in heads.
const TAG_END_BYTES: usize = 4;
/// Bytes of a packet's payload before the words: echo and content.
const ECHO_AND_CONTENT_BYTES: usize = 4;
const BUFFER_BYTES: usize = HEADER_BYTES + ECHO_AND_CONTENT_BYTES + 4 * MAX_WORDS + TAG_END_BYTES + CRC_BYTES;

/// Returns the data id of a channel's frames, selected by the packet's counter: `(channel + i * (2 * (channel
/// / 256) + 1)) mod 256`, where `i` is the counter's low 4 bits.
///
/// The 16 data ids of a channel differ; two channels below 2048 share at most one.
#[must_use]
pub fn data_id(channel: u16, counter: u16) -> u8 {
    let [low, high] = channel.to_le_bytes();
    let step = high.wrapping_mul(2).wrapping_add(1);
    let [index, _] = (counter & 0xF).to_le_bytes();
    low.wrapping_add(index.wrapping_mul(step))
}

/// Splits the content of a packet or handshake into frames. `None` if it is invalid, of another channel, or
/// has more than [`MAX_WORDS`] words.
#[must_use]
pub fn frames(content: &[u8], channel: u16) -> Option<Frames<'_>> {
    let covered = verify(content, channel).ok()?;
    let (&[class, low, high], payload) = covered.split_first_chunk::<HEADER_BYTES>()?;
    let number = u16::from_le_bytes([low, high]);
    let is_packet = class & !AUTHENTICATED_FLAG == PACKET && number != 0;
    let is_handshake = class == HANDSHAKE && number == 0;
    if !is_packet && !is_handshake {
        return None;
    }
    let (&[echo_low, echo_high, content_low, content_high], words) =
        payload.split_first_chunk::<ECHO_AND_CONTENT_BYTES>()?;
    let heads = head_frames(class, number);
    let (words, &[a, b, c, d]) = if heads == TAGGED_HEAD_FRAMES {
        words.split_last_chunk::<TAG_END_BYTES>()?
    } else {
        (words, &[0; 4])
    };
    let (words, rest) = words.as_chunks::<4>();
    let count = u8::try_from(words.len()).ok().filter(|count| usize::from(*count) <= MAX_WORDS)?;
    if !rest.is_empty() {
        return None;
    }
    let last = count.max(heads) - 1;
    let counter = number & !0xF | u16::from(last);
    let head_bytes =
        [counter.to_le_bytes(), [echo_low, echo_high], [content_low, content_high], [a, b], [c, d]];
    Some(Frames { channel, counter: number, index: 0, last, heads, head_bytes, words })
}

/// Returns the number of frames with a head, by class and counter.
fn head_frames(class: u8, number: u16) -> u8 {
    if class & AUTHENTICATED_FLAG != 0 && number != 0 { TAGGED_HEAD_FRAMES } else { HEAD_FRAMES }
}

/// The data of a packet's frames, in sending order. See [`frames`].
#[derive(Debug, Clone)]
pub struct Frames<'c> {
    channel: u16,
    counter: u16,
    index: u8,
    last: u8,
    heads: u8,
    head_bytes: [[u8; 2]; TAGGED_HEAD_FRAMES as usize],
    words: &'c [[u8; 4]],
}

impl Iterator for Frames<'_> {
    type Item = Vec<u8, MAX_DATA_BYTES>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.index > self.last {
            return None;
        }
        let [low, _] = (self.counter & 0xF).to_le_bytes();
        let mut frame = Vec::from_array([0, self.index << 4 | low]);
        let place = usize::from(self.index);
        if self.index < self.heads {
            frame.extend_from_slice(self.head_bytes.get(place)?).ok()?;
        }
        frame.extend_from_slice(self.words.get(place).map_or(&[], <[u8; 4]>::as_slice)).ok()?;
        let crc = crc(self.channel, self.counter, self.index, frame.get(1..)?);
        *frame.first_mut()? = crc;
        self.index += 1;
        Some(frame)
    }
}

fn crc(channel: u16, counter: u16, index: u8, covered: &[u8]) -> u8 {
    let [above, _] = (counter >> 4).to_le_bytes();
    let mut digest = CRC_8.digest();
    digest.update(&[data_id(channel, counter), if index == 0 { 0 } else { above }]);
    digest.update(covered);
    digest.finalize()
}

/// Reassembles the contents from one sender's frames.
///
/// Buffers one packet. A damaged, duplicate or out-of-order frame is dropped; only complete packets are
/// returned.
#[derive(Debug)]
pub struct Assembler {
    /// Class of the packets.
    class: u8,
    channel: u16,
    counter: u16,
    /// Index of the expected frame; 0 between packets.
    next: u8,
    /// Index of the packet's last frame.
    last: u8,
    /// Words received.
    words: usize,
    /// With room for the envelope.
    buffer: [u8; BUFFER_BYTES],
    tag_end: [u8; TAG_END_BYTES],
    dropped: u32,
}

impl Default for Assembler {
    fn default() -> Self {
        Self::new()
    }
}

impl Assembler {
    /// Creates an empty assembler.
    #[must_use]
    pub const fn new() -> Self {
        Self::of_class(PACKET)
    }

    /// Like [`new`](Self::new), for authenticated packets.
    #[must_use]
    pub const fn authenticated() -> Self {
        Self::of_class(PACKET | AUTHENTICATED_FLAG)
    }

    const fn of_class(class: u8) -> Self {
        let (buffer, tag_end) = ([0; BUFFER_BYTES], [0; TAG_END_BYTES]);
        Self { class, channel: 0, counter: 0, next: 0, last: 0, words: 0, buffer, tag_end, dropped: 0 }
    }

    /// Adds a frame received on a channel; returns the packet or handshake that it completes, if any.
    pub fn push(&mut self, data: &[u8], channel: u16) -> Option<&[u8]> {
        if self.add(data, channel).is_none() {
            self.dropped = self.dropped.saturating_add(1);
            return None;
        }
        if self.next <= self.last {
            return None;
        }
        self.next = 0;
        let mut length = ECHO_AND_CONTENT_BYTES + 4 * self.words;
        if head_frames(self.class, self.counter) == TAGGED_HEAD_FRAMES {
            let place = HEADER_BYTES + length;
            self.buffer.get_mut(place..place + TAG_END_BYTES)?.copy_from_slice(&self.tag_end);
            length += TAG_END_BYTES;
        }
        let class = if self.counter == 0 { HANDSHAKE } else { self.class };
        let [low, high] = self.counter.to_le_bytes();
        *self.buffer.first_chunk_mut()? = [class, low, high];
        append_crc(self.channel, HEADER_BYTES + length, &mut self.buffer)
    }

    /// Returns the number of dropped frames (saturating).
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.dropped
    }

    /// Adds the expected frame; `None`, without a change, for any other.
    fn add(&mut self, data: &[u8], channel: u16) -> Option<()> {
        let (&[found, tag], rest) = data.split_first_chunk::<2>()?;
        let (index, low) = (tag >> 4, u16::from(tag & 0xF));
        // The counter is unknown at frame 0, which always has a head.
        let heads = head_frames(self.class, self.counter);
        let (head, word) = if index < heads { rest.split_at_checked(2)? } else { rest.split_at(0) };
        let (mut counter, mut last, mut words) = (self.counter, self.last, self.words);
        if let (0, &[counter_low, counter_high]) = (index, head) {
            counter = u16::from_le_bytes([counter_low, counter_high]) & !0xF | low;
            (last, words) = (counter_low & 0xF, 0);
        } else if index != self.next || channel != self.channel || low != counter & 0xF {
            return None;
        }
        let is_in_place = match word.len() {
            0 => index < heads,
            4 => usize::from(index) == words,
            _ => false,
        };
        let is_too_short = last + 1 < head_frames(self.class, counter);
        if !is_in_place || is_too_short || found != crc(channel, counter, index, data.get(1..)?) {
            return None;
        }
        (self.channel, self.counter, self.last) = (channel, counter, last);
        self.write(index, head, word)?;
        self.words = words + word.len() / 4;
        self.next = index + 1;
        Some(())
    }

    fn write(&mut self, index: u8, head: &[u8], word: &[u8]) -> Option<()> {
        let index = usize::from(index);
        if let Some(place) = index.checked_sub(usize::from(HEAD_FRAMES)).filter(|_| !head.is_empty()) {
            self.tag_end.get_mut(2 * place..2 * place + head.len())?.copy_from_slice(head);
        } else if let Some(place) = index.checked_sub(1).map(|place| HEADER_BYTES + 2 * place) {
            self.buffer.get_mut(place..place + head.len())?.copy_from_slice(head);
        }
        let place = HEADER_BYTES + ECHO_AND_CONTENT_BYTES + 4 * index;
        self.buffer.get_mut(place..place + word.len())?.copy_from_slice(word);
        Some(())
    }
}
