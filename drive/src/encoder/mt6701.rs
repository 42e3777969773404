//! `MagnTek` MT6701 encoder: 14 bits over SSI, with a CRC that detects up to two wrong bits.
//!
//! Source: data sheet (`MagnTek` MT6701, section on SSI, figures 24 and 25) and public drivers.

use crc::{Algorithm, Crc};

use crate::{Angle, Rotor};

/// An MT6701. It has no commands: select it and clock in its bytes.
#[derive(Debug, Clone, Copy)]
pub struct Mt6701;

impl Mt6701 {
    /// Counts per turn.
    pub const COUNTS_PER_TURN: u32 = 1 << 14;
    /// Maximum safe clock, `Hz`; drivers state 8 MHz to 25 MHz. SPI mode 1 (idle low, sampled on the falling edge), most
    /// significant bit first.
    pub const MAX_CLOCK_HZ: u32 = 8_000_000;
    /// Minimum time from chip select to the first clock edge, `ns`. The three bytes take 3.2 µs at the maximum clock:
    /// the chip can be read every 50 µs.
    pub const MIN_SELECT_NS: u32 = 100;

    /// Decodes the three bytes.
    ///
    /// Corrupted bytes return [`Rotor::Lost`], as does a missing chip with a pull-up on the data line. With a
    /// pull-down, a missing chip reads as a valid angle of 0; only a rotor that seems to stand still reveals it.
    #[must_use]
    pub fn decode(bytes: [u8; 3]) -> Rotor {
        if CRC.checksum(&bytes) != 0 {
            return Rotor::Lost;
        }
        let [high, middle, low] = bytes.map(u32::from);
        let frame = high << 16 | middle << 8 | low;
        if frame & (TRACK_LOST | FIELD) != 0 {
            return Rotor::BadMagnet;
        }
        Rotor::Angle(Angle(frame >> 10 << 18))
    }
}

/// Loss of track (Mg\[3\]). The bit between this and `FIELD` is the push button.
const TRACK_LOST: u32 = 1 << 9;
/// Field too strong or too weak if not 0 (Mg\[1:0\]).
const FIELD: u32 = 0b11 << 6;

/// x⁶ + x + 1, initial value 0, over angle and status; 0 over the whole frame including the CRC.
static CRC: Crc<u8> = Crc::<u8>::new(&Algorithm {
    width: 6,
    poly: 0x03,
    init: 0,
    refin: false,
    refout: false,
    xorout: 0,
    check: 0x11,
    residue: 0,
});

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a frame of 14 bits of angle and 4 of status, with the CRC computed bit by bit as in the data sheet.
    fn frame(angle: u32, status: u32) -> u32 {
        let content = angle << 4 | status;
        let sum = (0..18).rev().fold(0, |sum, bit| {
            let feedback = (sum >> 5 ^ content >> bit) & 1;
            (sum << 1 & 0x3F) ^ (0x03 * feedback)
        });
        content << 6 | sum
    }

    fn decode(frame: u32) -> Rotor {
        let [_, bytes @ ..] = frame.to_be_bytes();
        Mt6701::decode(bytes)
    }

    #[test]
    fn a_frame_of_a_real_chip_is_understood() {
        // From the public drivers: a chip at 7982.
        assert_eq!(decode(0x7C_B827), Rotor::Angle(Angle::from_counts(7982, Mt6701::COUNTS_PER_TURN)));
        assert_eq!(frame(7982, 0), 0x7C_B827);
    }

    #[test]
    fn the_sum_is_that_of_its_parameters() {
        assert_eq!(CRC.checksum(b"123456789"), CRC.algorithm.check);
    }

    #[test]
    fn every_angle_comes_through() {
        for count in 0..1 << 14 {
            let expected = Rotor::Angle(Angle::from_counts(count, Mt6701::COUNTS_PER_TURN));
            assert_eq!(decode(frame(count, 0)), expected);
            assert_eq!(decode(frame(count, 0b0100)), expected, "the push button is ignored");
        }
    }

    #[test]
    fn every_one_and_two_wrong_bits_are_found() {
        for (count, one, other) in [0, 1, 7982, 0x3FFF]
            .into_iter()
            .flat_map(|count| (0..24 * 24).map(move |bits| (count, bits / 24, bits % 24)))
        {
            let wrong = if one == other { 1 << one } else { 1 << one | 1 << other };
            assert_eq!(decode(frame(count, 0) ^ wrong), Rotor::Lost, "{count}, bits {one} and {other}");
        }
    }

    #[test]
    fn a_chip_that_is_not_there_is_lost_on_a_line_that_is_pulled_up() {
        assert_eq!(decode(0xFF_FFFF), Rotor::Lost);
        // Also the valid frame of angle 0, which must be accepted.
        assert_eq!(decode(0), Rotor::Angle(Angle(0)));
    }

    #[test]
    fn a_bad_magnet_is_told() {
        for status in [0b0001, 0b0010, 0b0011, 0b1000] {
            assert_eq!(decode(frame(5, status)), Rotor::BadMagnet, "{status:04b}");
        }
    }
}
