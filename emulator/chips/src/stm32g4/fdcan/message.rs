//! A frame: its format in message RAM, and its bits on the wire.
//!
//! Bits without stuff bits, from the start of the frame to the end of its data:
//!
//! | | 11-bit identifier | 29-bit identifier |
//! |---|---|---|
//! | classic | 19 + 8 n | 39 + 8 n |
//! | FD before and after the rate switch | 17, 5 + 8 n | 36, 5 + 8 n |
//!
//! A classic frame continues with 15 bits of CRC; up to the end of the CRC, five equal bits are followed by a
//! stuff bit of the opposite value. An FD frame has stuff bits up to the end of its data, then a fixed stuff
//! bit, 4 bits of stuff count, 17 bits of CRC (21 above 16 bytes) and a fixed stuff bit after every fourth of
//! these bits. Both end with CRC delimiter, acknowledge, acknowledge delimiter and 7 bits of end of frame
//! (ISO 11898-1:2015).

/// Number of data bytes by length code.
pub(crate) const LENGTHS: [usize; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64];
const CLASSIC_BYTES: usize = 8;
/// Maximum number of data bytes of an FD frame with the shorter CRC.
const SHORT_CRC_BYTES: usize = 16;
const CRC_15: u16 = 0x4599;
/// Acknowledge, acknowledge delimiter, end of frame.
const END_BITS: u32 = 9;

// Bits of the first word of an element in message RAM.
const ESI: u32 = 31;
const XTD: u32 = 30;
const RTR: u32 = 29;
// Bits of the second word.
const FDF: u32 = 21;
const BRS: u32 = 20;
const DLC: u32 = 16;

/// A frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    /// Identifier of 11 or 29 bits.
    pub identifier: u32,
    /// Whether the identifier has 29 bits.
    pub is_extended: bool,
    /// Whether it is a remote frame, which requests data and contains none.
    pub is_remote: bool,
    /// Whether it is a CAN FD frame.
    pub is_fd: bool,
    /// Whether its data is sent at the data bit rate.
    pub switches_rate: bool,
    /// Whether its sender has reported to be error-passive.
    pub is_sender_error_passive: bool,
    /// Length code, 0 to 15.
    pub code: u8,
    /// Its data.
    pub data: Vec<u8>,
}

/// Bits of a frame on the wire by their bit rate, without the intermission.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WireBits {
    /// At the nominal rate, from the start of the frame.
    pub head: u32,
    /// At the data rate.
    pub fast: u32,
    /// At the nominal rate again.
    pub tail: u32,
}

impl Message {
    /// Parses a frame from words of message RAM: two header words, then the data. FD format and rate switch
    /// are removed if the controller does not allow them.
    pub(super) fn from_words(word: impl Fn(usize) -> u32, allows_fd: bool, allows_switch: bool) -> Self {
        let (first, second) = (word(0), word(1));
        let has = |word: u32, bit: u32| word >> bit & 1 == 1;
        let is_extended = has(first, XTD);
        let is_fd = has(second, FDF) && allows_fd;
        let is_remote = has(first, RTR) && !is_fd;
        let code = (second >> DLC).to_le_bytes()[0] & 0xF;
        let most = if is_fd { usize::MAX } else { CLASSIC_BYTES };
        let length = LENGTHS.get(usize::from(code)).copied().unwrap_or(0).min(most);
        let bytes = (2..18).flat_map(|place| word(place).to_le_bytes());
        Self {
            identifier: if is_extended { first & 0x1FFF_FFFF } else { first >> 18 & 0x7FF },
            is_extended,
            is_remote,
            is_fd,
            switches_rate: is_fd && has(second, BRS) && allows_switch,
            is_sender_error_passive: has(first, ESI) && is_fd,
            code,
            data: bytes.take(if is_remote { 0 } else { length }).collect(),
        }
    }

    /// First word of an element of an RX FIFO or of the TX event FIFO.
    pub(super) fn first_word(&self) -> u32 {
        let identifier = if self.is_extended { self.identifier } else { self.identifier << 18 };
        identifier
            | u32::from(self.is_extended) << XTD
            | u32::from(self.is_remote) << RTR
            | u32::from(self.is_sender_error_passive) << ESI
    }

    /// Bits of the second word that describe the frame.
    pub(super) fn second_word(&self) -> u32 {
        u32::from(self.is_fd) << FDF | u32::from(self.switches_rate) << BRS | u32::from(self.code) << DLC
    }

    /// Arbitration bits as a number: the lowest value wins.
    #[must_use]
    pub fn priority(&self) -> u32 {
        let remote = u32::from(self.is_remote);
        if self.is_extended {
            let (base, rest) = (self.identifier >> 18, self.identifier & 0x3_FFFF);
            base << 21 | 0b11 << 19 | rest << 1 | remote
        } else {
            self.identifier << 21 | remote << 20
        }
    }

    /// Bits of this frame on the wire, with its stuff bits.
    #[must_use]
    pub fn wire_bits(&self) -> WireBits {
        let (mut bits, head) = self.bits();
        if !self.is_fd {
            let crc = crc_15(&bits);
            push(&mut bits, crc.into(), 15);
            return WireBits { head: stuffed(&bits, bits.len()), fast: 0, tail: 1 + END_BITS };
        }
        // The fixed stuff bit replaces a stuff bit after the last bit.
        let data = stuffed(&bits, bits.len().saturating_sub(1)) + 1;
        let checked = 4 + if self.data.len() <= SHORT_CRC_BYTES { 17 } else { 21 };
        let all = data + 1 + checked + checked / 4;
        let head = if self.switches_rate { stuffed(&bits, head.saturating_sub(1)) + 1 } else { all + 1 };
        WireBits { head, fast: all + 1 - head, tail: END_BITS }
    }

    /// Bits from the start of the frame to the end of the data without stuff bits, and their number before
    /// the rate switch.
    fn bits(&self) -> (Vec<bool>, usize) {
        let mut bits = Vec::with_capacity(64 + 8 * self.data.len());
        push(&mut bits, 0, 1);
        let remote = u32::from(self.is_remote);
        if self.is_extended {
            push(&mut bits, self.identifier >> 18, 11);
            push(&mut bits, 0b11, 2);
            push(&mut bits, self.identifier, 18);
            push(&mut bits, remote, 1);
        } else {
            push(&mut bits, self.identifier, 11);
            push(&mut bits, remote << 1, 2);
        }
        if self.is_fd {
            push(&mut bits, 0b100 | u32::from(self.switches_rate), 3);
        } else {
            push(&mut bits, 0, if self.is_extended { 2 } else { 1 });
        }
        let head = bits.len();
        if self.is_fd {
            push(&mut bits, self.is_sender_error_passive.into(), 1);
        }
        push(&mut bits, self.code.into(), 4);
        self.data.iter().for_each(|byte| push(&mut bits, u32::from(*byte), 8));
        (bits, head)
    }
}

fn push(bits: &mut Vec<bool>, value: u32, count: u32) {
    bits.extend((0..count).rev().map(|bit| value >> bit & 1 == 1));
}

/// Number of bits on the wire for the first `count` bits, with a stuff bit that the last of them requires.
fn stuffed(bits: &[bool], count: usize) -> u32 {
    let (mut sent, mut run, mut last) = (0, 0, true);
    for bit in bits.iter().take(count) {
        run = if *bit == last { run + 1 } else { 1 };
        (last, sent) = (*bit, sent + 1);
        if run == 5 {
            (last, run, sent) = (!last, 1, sent + 1);
        }
    }
    sent
}

fn crc_15(bits: &[bool]) -> u16 {
    bits.iter().fold(0, |crc, bit| {
        let is_divided = *bit != (crc >> 14 & 1 == 1);
        let shifted = crc << 1 & 0x7FFF;
        if is_divided { shifted ^ CRC_15 } else { shifted }
    })
}
