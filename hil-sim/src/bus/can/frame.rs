//! A CAN frame and the bits it takes on the wire, stuff bits included.
//!
//! Classic CAN (ISO 11898-1): five equal bits are followed by one of the other value, from the start of the frame to
//! the end of its CRC-15. CAN FD: the same up to the end of the data; a stuff bit of its own then precedes the stuff
//! count and follows every fourth bit of it and of the CRC, 17 bits long up to 16 bytes and 21 bits beyond. From the
//! bit-rate switch (BRS) to the CRC delimiter, CAN FD has its fast bit rate.

use crc::{CRC_15_CAN, Crc};

static CRC: Crc<u16> = Crc::<u16>::new(&CRC_15_CAN);

/// Most bytes of a classic frame.
pub const CLASSIC_BYTES: usize = 8;
/// Bits between two frames, at the nominal rate.
pub const INTERFRAME_BITS: u32 = 3;
/// The lengths that a CAN FD frame can have, bytes, by their code.
const FD_LENGTHS: [usize; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64];
/// Bytes up to which CAN FD has the shorter CRC.
const SHORT_CRC_BYTES: usize = 16;
/// CRC delimiter, acknowledge and its delimiter, end of frame.
const TAIL_BITS: u32 = 10;

/// Who sends what: the lower, the earlier it is sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Identifier {
    /// 11 bits.
    Standard(u16),
    /// 29 bits.
    Extended(u32),
}

impl Identifier {
    /// What arbitration compares, bit after bit: base, then whether it goes on, then the rest.
    #[must_use]
    pub fn priority(self) -> u32 {
        match self {
            Self::Standard(base) => u32::from(base & 0x7FF) << 19,
            Self::Extended(all) => (all >> 18 & 0x7FF) << 19 | 1 << 18 | all & 0x3_FFFF,
        }
    }
}

impl PartialOrd for Identifier {
    fn partial_cmp(&self, other: &Self) -> Option<core::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Identifier {
    fn cmp(&self, other: &Self) -> core::cmp::Ordering {
        self.priority().cmp(&other.priority())
    }
}

impl core::fmt::Display for Identifier {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Standard(base) => write!(f, "0x{base:03X}"),
            Self::Extended(all) => write!(f, "0x{all:08X}"),
        }
    }
}

/// Classic CAN or CAN FD with its bit-rate switch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Up to 8 bytes, one bit rate.
    Classic,
    /// Up to 64 bytes, the data at a rate of its own.
    Fd,
}

/// A data frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CanFrame {
    /// Its identifier.
    pub identifier: Identifier,
    format: Format,
    data: Vec<u8>,
}

/// Bits of a frame by the rate they have on the wire, without the space behind it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WireBits {
    /// At the nominal rate, from the start on; all but the tail of a classic frame.
    pub head: u32,
    /// At the data rate.
    pub fast: u32,
    /// At the nominal rate again.
    pub tail: u32,
}

impl WireBits {
    /// All of them.
    #[must_use]
    pub fn sum(self) -> u32 {
        self.head + self.fast + self.tail
    }
}

impl CanFrame {
    /// A frame of this data; none for a length that no such frame has.
    #[must_use]
    pub fn new(identifier: Identifier, format: Format, data: &[u8]) -> Option<Self> {
        let fits = match format {
            Format::Classic => data.len() <= CLASSIC_BYTES,
            Format::Fd => FD_LENGTHS.contains(&data.len()),
        };
        fits.then(|| Self { identifier, format, data: data.to_vec() })
    }

    /// Its data.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        &self.data
    }

    /// What this very frame takes, with the stuff bits of its own bits.
    #[must_use]
    pub fn wire_bits(&self) -> WireBits {
        let (mut bits, head) = self.bits();
        match self.format {
            Format::Classic => {
                let crc = crc_15(&bits);
                push(&mut bits, u32::from(crc), 15);
                let stuffed = stuffed(&bits, bits.len());
                WireBits { head: stuffed, fast: 0, tail: TAIL_BITS }
            }
            Format::Fd => {
                // What follows the data is a fixed stuff bit, whatever came before.
                let all = stuffed(&bits, bits.len().saturating_sub(1)) + 1;
                let head = stuffed(&bits, head.saturating_sub(1)) + 1;
                WireBits { head, fast: all - head + fd_crc_field(self.data.len()) + 1, tail: TAIL_BITS - 1 }
            }
        }
    }

    /// Bits from the start to the end of the data, before stuffing, and how many of them have the nominal rate
    /// in a CAN FD frame.
    fn bits(&self) -> (Vec<bool>, usize) {
        let mut bits = Vec::with_capacity(64 + 8 * self.data.len());
        push(&mut bits, 0, 1);
        match self.identifier {
            // Remote request or its substitute, and whether the identifier goes on.
            Identifier::Standard(base) => push(&mut bits, u32::from(base) << 2, 13),
            Identifier::Extended(all) => {
                push(&mut bits, all >> 18, 11);
                push(&mut bits, 0b11, 2);
                push(&mut bits, all << 1, 19);
            }
        }
        let code = FD_LENGTHS.iter().position(|length| *length == self.data.len()).unwrap_or(0);
        let code = u32::try_from(code).unwrap_or(0);
        match (self.format, self.identifier) {
            (Format::Classic, Identifier::Standard(_)) => push(&mut bits, code, 5),
            (Format::Classic, Identifier::Extended(_)) => push(&mut bits, code, 6),
            // FDF, reserved, BRS.
            (Format::Fd, _) => push(&mut bits, 0b101, 3),
        }
        let head = bits.len();
        if self.format == Format::Fd {
            push(&mut bits, code, 5);
        }
        self.data.iter().for_each(|byte| push(&mut bits, u32::from(*byte), 8));
        (bits, head)
    }

    /// The most that any frame of this kind and length takes.
    ///
    /// Stuff bits: one after the first five bits and after every four more (Davis, Burns, Bril and Lukkien 2007). CAN
    /// FD: those that follow a bit of the fast part are fast.
    #[must_use]
    pub fn most_wire_bits(identifier: Identifier, format: Format, bytes: usize) -> WireBits {
        let count = |bytes: usize| u32::try_from(8 * bytes).unwrap_or(u32::MAX);
        let stuffed = |bits: u32| bits + bits.saturating_sub(1) / 4;
        let is_extended = matches!(identifier, Identifier::Extended(_));
        match format {
            Format::Classic => {
                let bits = if is_extended { 54 } else { 34 } + count(bytes);
                WireBits { head: stuffed(bits), fast: 0, tail: TAIL_BITS }
            }
            Format::Fd => {
                let head = if is_extended { 36 } else { 17 };
                let all = stuffed(head + 5 + count(bytes) - 1) + 1;
                let head = stuffed(head - 1) + 1;
                WireBits { head, fast: all - head + fd_crc_field(bytes) + 1, tail: TAIL_BITS - 1 }
            }
        }
    }
}

/// Stuff count (4 bits) and CRC with their fixed stuff bits.
fn fd_crc_field(bytes: usize) -> u32 {
    let bits = 4 + if bytes <= SHORT_CRC_BYTES { 17 } else { 21 };
    bits + 1 + bits / 4
}

/// Appends the lowest `count` bits of `value`, the highest first.
fn push(bits: &mut Vec<bool>, value: u32, count: u32) {
    bits.extend((0..count).rev().map(|bit| value >> bit & 1 == 1));
}

/// Bits on the wire of the first `count` bits, the stuff bit after the last of them included.
fn stuffed(bits: &[bool], count: usize) -> u32 {
    let (mut sent, mut run, mut last) = (0, 0, true);
    for bit in bits.iter().take(count) {
        run = if *bit == last { run + 1 } else { 1 };
        last = *bit;
        sent += 1;
        if run == 5 {
            sent += 1;
            (last, run) = (!last, 1);
        }
    }
    sent
}

/// The CRC of bits that begin with any number of zeros more: it starts from zero, so they do not change it.
fn crc_15(bits: &[bool]) -> u16 {
    let padding = std::iter::repeat_n(false, bits.len().next_multiple_of(8) - bits.len());
    let padded: Vec<bool> = padding.chain(bits.iter().copied()).collect();
    let byte = |bits: &[bool]| bits.iter().fold(0, |byte, bit| byte << 1 | u8::from(*bit));
    let bytes: Vec<u8> = padded.chunks(8).map(byte).collect();
    CRC.checksum(&bytes)
}

#[cfg(test)]
mod tests;
