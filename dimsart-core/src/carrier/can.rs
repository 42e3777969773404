//! A packet in classic CAN frames of at most 8 bytes.
//!
//! ```text
//! every frame   CRC-8 | index (high 4 bits), counter (low 4 bits) | up to 6 bytes
//! frame 0       counter with the number of frames that follow in its low 4 bits u16 | echo u16 | content u16
//! frames 1..    the words, 6 bytes a frame, the last one as long as it has to be
//! ```
//! Little endian; up to 15 frames follow the first. The envelope is taken off and sealed anew on the other side.
//!
//! The CRC-8 (polynomial 0x2F, Hamming distance 4 here) covers all behind it and two bytes that are not sent: the
//! frame's [`data_id`], and in frames 1.. the 8 bits of the packet's counter above the 4 that are sent. So a frame
//! of another channel or another packet is refused, until a counter comes again after 4096 packets. This is done in
//! the manner of AUTOSAR's profile 22 (same polynomial, a 4-bit counter, a list of 16 data ids), but laid out
//! differently.

use heapless::Vec;

use crate::checksum::CRC_8;
use crate::envelope::{CRC_BYTES, Class, HEADER_BYTES, open, seal};

/// Most data of a classic CAN frame, bytes.
pub const MAX_DATA_BYTES: usize = 8;
/// Most words of a packet that classic CAN carries.
pub const MAX_WORDS: usize = (MAX_FOLLOWING as usize) * PART_BYTES / 4;

/// Most frames behind the first.
const MAX_FOLLOWING: u8 = 15;
/// What a frame carries of a packet, bytes.
const PART_BYTES: usize = 6;
/// Of a packet's payload, before the words: echo and content.
const ECHO_AND_CONTENT_BYTES: usize = 4;
const BUFFER_BYTES: usize = HEADER_BYTES + ECHO_AND_CONTENT_BYTES + 4 * MAX_WORDS + CRC_BYTES;

/// The data id of a channel's frames, chosen by the packet's counter: `(channel + i * (2 * (channel / 256) + 1)) mod
/// 256` with `i` the counter's low 4 bits.
///
/// The 16 of a channel all differ, and two channels below 2048 have at most one of them in common.
#[must_use]
pub fn data_id(channel: u16, counter: u16) -> u8 {
    let [low, high] = channel.to_le_bytes();
    let step = high.wrapping_mul(2).wrapping_add(1);
    let [index, _] = (counter & 0xF).to_le_bytes();
    low.wrapping_add(index.wrapping_mul(step))
}

/// The frames of a packet's content, which must be whole. None when it is no packet of this channel or has more than
/// [`MAX_WORDS`] words.
#[must_use]
pub fn frames(content: &[u8], channel: u16) -> Option<Frames<'_>> {
    let packet = open(content, channel).ok().filter(|envelope| envelope.class == Class::Packet)?;
    let ([echo_low, echo_high, content_low, content_high], words) =
        packet.payload.split_first_chunk::<ECHO_AND_CONTENT_BYTES>()?;
    let following = u16::try_from(words.len().div_ceil(PART_BYTES)).ok()?;
    if words.len() > 4 * MAX_WORDS || !words.len().is_multiple_of(4) {
        return None;
    }
    let [low, high] = (packet.counter & !0xF | following).to_le_bytes();
    let first = [low, high, *echo_low, *echo_high, *content_low, *content_high];
    Some(Frames { channel, counter: packet.counter, index: 0, first, words })
}

/// The data of a packet's frames, in the order that they are to be sent in. See [`frames`].
#[derive(Debug, Clone)]
pub struct Frames<'c> {
    channel: u16,
    counter: u16,
    index: u8,
    first: [u8; PART_BYTES],
    words: &'c [u8],
}

impl Iterator for Frames<'_> {
    type Item = Vec<u8, MAX_DATA_BYTES>;

    fn next(&mut self) -> Option<Self::Item> {
        let part = if self.index == 0 {
            &self.first
        } else {
            let (part, rest) = self.words.split_at_checked(PART_BYTES).unwrap_or((self.words, &[]));
            self.words = rest;
            part
        };
        if part.is_empty() {
            return None;
        }
        let [low, _] = (self.counter & 0xF).to_le_bytes();
        let mut frame = Vec::from_array([0, self.index << 4 | low]);
        frame.extend_from_slice(part).ok()?;
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

/// Takes the frames of one sender and gives the contents in them.
///
/// It holds one packet. A frame that is damaged, repeated or not the next one of the packet is dropped, and a packet
/// that misses one never comes: only whole packets do.
#[derive(Debug)]
pub struct Assembler {
    channel: u16,
    counter: u16,
    /// Index of the frame that is to come; 0 while no packet is begun.
    next: u8,
    /// Index of the packet's last frame.
    last: u8,
    /// Bytes of echo, content and words so far.
    length: usize,
    /// With room for the envelope around them.
    buffer: [u8; BUFFER_BYTES],
    dropped: u32,
}

impl Default for Assembler {
    fn default() -> Self {
        Self::new()
    }
}

impl Assembler {
    /// One that has seen nothing yet.
    #[must_use]
    pub const fn new() -> Self {
        let buffer = [0; BUFFER_BYTES];
        Self { channel: 0, counter: 0, next: 0, last: 0, length: 0, buffer, dropped: 0 }
    }

    /// Takes a frame's data that came in on a channel; gives the content of the packet that it ended, if any.
    pub fn take(&mut self, data: &[u8], channel: u16) -> Option<&[u8]> {
        if self.add(data, channel).is_none() {
            self.dropped = self.dropped.saturating_add(1);
            return None;
        }
        if self.next <= self.last {
            return None;
        }
        self.next = 0;
        seal(Class::Packet, self.channel, self.counter, self.length, &mut self.buffer)
    }

    /// Frames dropped so far. Stops at its largest number.
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.dropped
    }

    /// None when the frame is not what has to come now; nothing has changed then.
    fn add(&mut self, data: &[u8], channel: u16) -> Option<()> {
        let (&[found, tag], part) = data.split_first_chunk::<2>()?;
        let (index, low) = (tag >> 4, u16::from(tag & 0xF));
        let covered = data.get(1..)?;
        if index == 0 {
            let &[counter_low, counter_high, ref echo_and_content @ ..] = part.as_array::<PART_BYTES>()?;
            let head = u16::from_le_bytes([counter_low, counter_high]);
            let (counter, [last, _]) = (head & !0xF | low, (head & 0xF).to_le_bytes());
            if found != crc(channel, counter, index, covered) {
                return None;
            }
            (self.channel, self.counter) = (channel, counter);
            (self.next, self.last, self.length) = (0, last, 0);
            return self.append(echo_and_content);
        }
        let is_next = index == self.next && channel == self.channel && low == self.counter & 0xF;
        let is_full = part.len() == PART_BYTES;
        let is_whole = (self.length + part.len()).is_multiple_of(4);
        let fits = if index == self.last { is_whole } else { is_full };
        if !is_next || !fits || found != crc(channel, self.counter, index, covered) {
            return None;
        }
        self.append(part)
    }

    fn append(&mut self, part: &[u8]) -> Option<()> {
        let start = HEADER_BYTES + self.length;
        self.buffer.get_mut(start..start + part.len())?.copy_from_slice(part);
        self.length += part.len();
        self.next += 1;
        Some(())
    }
}
