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
mod tests {
    use super::*;
    use proptest::prelude::{any, prop_assert, proptest};

    fn classic(identifier: Identifier, data: &[u8]) -> CanFrame {
        CanFrame::new(identifier, Format::Classic, data).unwrap()
    }

    fn identifier(number: u32) -> Identifier {
        if number & 1 == 0 {
            Identifier::Standard(u16::try_from(number >> 1 & 0x7FF).unwrap())
        } else {
            Identifier::Extended(number >> 3)
        }
    }

    /// (55 + 10 s) and (80 + 10 s) bits with the space behind the frame: Davis et al. 2007, equations 1 and 2.
    #[test]
    fn the_longest_classic_frames_are_those_of_the_literature() {
        for bytes in 0_u32..=8 {
            for (identifier, base) in [(Identifier::Standard(0), 55), (Identifier::Extended(0), 80)] {
                let most = CanFrame::most_wire_bits(identifier, Format::Classic, bytes as usize).sum();
                assert_eq!(most + INTERFRAME_BITS, base + 10 * bytes);
            }
        }
    }

    /// 32 nominal bits with the space behind the frame, as Bordoloi and Samii 2014 count; their 28 fast bits besides
    /// 10 a byte lack what ISO 11898-1:2015 added: the stuff count and one fixed stuff bit.
    #[test]
    fn the_longest_fd_frames_are_as_the_standard_counts_them() {
        let bits = |bytes| CanFrame::most_wire_bits(Identifier::Standard(0), Format::Fd, bytes);
        assert_eq!(bits(8).head + bits(8).tail + INTERFRAME_BITS, 32);
        // ESI, length code, 2 stuff bits; stuff count, CRC and their stuff bits; CRC delimiter.
        assert_eq!([0, 8, 16].map(|bytes| bits(bytes).fast), [0, 80, 160].map(|data| 7 + data + 27 + 1));
        assert_eq!([20, 64].map(|bytes| bits(bytes).fast), [200, 640].map(|data| 7 + data + 32 + 1));
    }

    /// 111 bits of 8 bytes without a stuff bit, with the space behind: alternating bits need none but in the CRC.
    #[test]
    fn stuff_bits_are_those_of_the_very_bits() {
        let frame = classic(Identifier::Standard(0x555), &[0x55; 8]);
        let (bits, _) = frame.bits();
        assert_eq!(bits.len() + 15 + 13, 111);
        let least = frame.wire_bits().sum() + INTERFRAME_BITS;
        assert!((111..=114).contains(&least), "{least}");
        assert_eq!(stuffed(&[false; 17], 17), 17 + 3);
        // A stuff bit begins a run of its own.
        assert_eq!(stuffed(&[false, false, false, false, false, true, true, true, true], 9), 9 + 2);
    }

    /// The catalogue's check value: the CRC of "123456789" is 0x059E.
    #[test]
    fn the_crc_does_not_see_leading_zeros() {
        let mut bits = vec![false; 3];
        b"123456789".iter().for_each(|byte| push(&mut bits, u32::from(*byte), 8));
        assert_eq!(crc_15(&bits), 0x059E);
    }

    #[test]
    fn arbitration_goes_bit_by_bit() {
        let ordered = [
            Identifier::Standard(1),
            Identifier::Extended(1 << 18),
            Identifier::Extended((1 << 18) + 1),
            Identifier::Standard(2),
            Identifier::Standard(0x7FF),
            Identifier::Extended(0x1FFF_FFFF),
        ];
        assert!(ordered.is_sorted());
    }

    #[test]
    fn no_frame_has_a_length_that_does_not_exist() {
        let any = Identifier::Standard(1);
        assert_eq!(CanFrame::new(any, Format::Classic, &[0; 9]), None);
        assert_eq!(CanFrame::new(any, Format::Fd, &[0; 9]), None);
        assert!(CanFrame::new(any, Format::Fd, &[0; 64]).is_some());
    }

    /// The worst pattern: five equal bits, then four of the other value by turns, stuff bits going on with them.
    #[test]
    fn the_longest_can_be_reached_but_for_the_crc() {
        for bytes in 1..=8 {
            // Identifier 0 and the length code leave a run that the data takes up.
            let patterns = [0x0F, 0xF0, 0x1E, 0xE1, 0x3C, 0xC3, 0x78, 0x87];
            let frames = (0..=255)
                .flat_map(|first| patterns.map(|rest| [first, rest, rest, rest, rest, rest, rest, rest]));
            let best = frames
                .map(|data| classic(Identifier::Standard(0), &data[..bytes]).wire_bits().sum())
                .max()
                .unwrap();
            let most = CanFrame::most_wire_bits(Identifier::Standard(0), Format::Classic, bytes).sum();
            // The CRC's own bits, at most three stuff bits, cannot be chosen; the length code ends a run early.
            assert!(best + 4 >= most, "{bytes} bytes: {best} of {most}");
        }
    }

    proptest! {
        #[test]
        fn no_frame_is_longer_than_the_longest(number in any::<u32>(), data in any::<[u8; 64]>(), code in 0_usize..16,
            repeated in any::<bool>())
        {
            let format = if code > 8 || number & 2 == 0 { Format::Fd } else { Format::Classic };
            let bytes = if format == Format::Fd { FD_LENGTHS[code] } else { code };
            let data = if repeated { [data[0]; 64] } else { data };
            let frame = CanFrame::new(identifier(number), format, &data[..bytes]).unwrap();
            let (bits, most) = (frame.wire_bits(), CanFrame::most_wire_bits(identifier(number), format, bytes));
            prop_assert!(bits.head <= most.head && bits.sum() <= most.sum() && bits.tail == most.tail, "{bits:?} {most:?}");
        }
    }
}
