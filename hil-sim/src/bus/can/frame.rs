//! CAN frames and their bits on the wire, including stuff bits.
//!
//! Classic CAN (ISO 11898-1): five equal bits are followed by a bit of opposite value, from the start of the frame to
//! the end of its CRC-15. CAN FD: the same up to the end of the data; then a fixed stuff bit precedes the stuff count
//! and follows every fourth bit of the stuff count and the CRC (17 bits up to 16 bytes of data, otherwise 21 bits).
//! CAN FD uses its data bit rate from the bit-rate switch (BRS) to the CRC delimiter.

use crc::{CRC_15_CAN, Crc};

static CRC: Crc<u16> = Crc::<u16>::new(&CRC_15_CAN);

/// Maximum data of a classic frame, bytes.
pub const CLASSIC_BYTES: usize = 8;
/// Interframe space in bits, at the nominal rate.
pub const INTERFRAME_BITS: u32 = 3;
/// Data lengths of CAN FD, bytes, by code.
const FD_LENGTHS: [usize; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64];
/// Maximum data with the shorter CRC of CAN FD, bytes.
const SHORT_CRC_BYTES: usize = 16;
/// CRC delimiter, acknowledge and its delimiter, end of frame.
const TAIL_BITS: u32 = 10;

/// Identifier; lower identifiers have priority.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Identifier {
    /// 11 bits.
    Standard(u16),
    /// 29 bits.
    Extended(u32),
}

impl Identifier {
    /// Arbitration order: base identifier, identifier extension, remaining bits.
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
    /// Classic CAN: up to 8 bytes, one bit rate.
    Classic,
    /// CAN FD: up to 64 bytes, with a data bit rate.
    Fd,
}

/// A data frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CanFrame {
    /// Identifier.
    pub identifier: Identifier,
    format: Format,
    data: Vec<u8>,
}

/// Bits of a frame by bit rate, without the interframe space.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WireBits {
    /// Nominal rate, from the start; for classic frames all bits except the tail.
    pub head: u32,
    /// Data rate.
    pub fast: u32,
    /// Nominal rate after the data.
    pub tail: u32,
}

impl WireBits {
    /// Sum.
    #[must_use]
    pub fn sum(self) -> u32 {
        self.head + self.fast + self.tail
    }
}

impl CanFrame {
    /// Creates a frame; `None` for an invalid length.
    #[must_use]
    pub fn new(identifier: Identifier, format: Format, data: &[u8]) -> Option<Self> {
        let fits = match format {
            Format::Classic => data.len() <= CLASSIC_BYTES,
            Format::Fd => FD_LENGTHS.contains(&data.len()),
        };
        fits.then(|| Self { identifier, format, data: data.to_vec() })
    }

    /// Returns its data.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        &self.data
    }

    /// Returns the bits of this frame, including its stuff bits.
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
                // A fixed stuff bit follows the data.
                let all = stuffed(&bits, bits.len().saturating_sub(1)) + 1;
                let head = stuffed(&bits, head.saturating_sub(1)) + 1;
                WireBits { head, fast: all - head + fd_crc_field(self.data.len()) + 1, tail: TAIL_BITS - 1 }
            }
        }
    }

    /// Bits up to the end of the data, before stuffing, and how many of them have the nominal rate in CAN FD.
    fn bits(&self) -> (Vec<bool>, usize) {
        let mut bits = Vec::with_capacity(64 + 8 * self.data.len());
        push(&mut bits, 0, 1);
        match self.identifier {
            // Remote request bit or its substitute, and identifier extension.
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

    /// Returns the maximum bits of a frame of this kind and length.
    ///
    /// Stuff bits: one after the first five bits and one after every further four (Davis, Burns, Bril and Lukkien
    /// 2007). CAN FD: stuff bits after a bit of the data phase have the data rate.
    #[must_use]
    pub fn max_wire_bits(identifier: Identifier, format: Format, bytes: usize) -> WireBits {
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

/// Appends the lowest `count` bits of `value`, most significant first.
fn push(bits: &mut Vec<bool>, value: u32, count: u32) {
    bits.extend((0..count).rev().map(|bit| value >> bit & 1 == 1));
}

/// Bits on the wire of the first `count` bits, including a stuff bit after the last.
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

/// CRC of bits; leading zeros have no effect as it starts from 0.
fn crc_15(bits: &[bool]) -> u16 {
    let padding = std::iter::repeat_n(false, bits.len().next_multiple_of(8) - bits.len());
    let padded: Vec<bool> = padding.chain(bits.iter().copied()).collect();
    let byte = |bits: &[bool]| bits.iter().fold(0, |byte, bit| byte << 1 | u8::from(*bit));
    let bytes: Vec<u8> = padded.chunks(8).map(byte).collect();
    CRC.checksum(&bytes)
}

#[cfg(test)]
mod tests;
