//! ams AS5600: 12 bits over I²C, for slow joints.
//!
//! After the data sheet (ams AS5600, "I²C Interface" and "Register Description") and its public drivers.

use crate::{Angle, Rotor};

/// An AS5600.
///
/// It cannot keep up with a period of 50 µs: at the fastest clock a reading takes 57 µs, and the chip samples only every
/// 150 µs, and filters that. Nothing but the acknowledge bits guards the bytes.
#[derive(Debug, Clone, Copy)]
pub struct As5600;

impl As5600 {
    /// Angles that it tells apart in a turn.
    pub const COUNTS_PER_TURN: u32 = 1 << 12;
    /// Its address on the bus, 7 bits.
    pub const ADDRESS: u8 = 0x36;
    /// The fastest clock, `Hz`: Fast-mode Plus.
    pub const MOST_CLOCK_HZ: u32 = 1_000_000;
    /// Least time that the clock is low, and high, and from the data's change to the clock's rise with the longest rise of the
    /// data, `ns` (NXP UM10204, Fast-mode Plus).
    pub const LEAST_NS: [u32; 3] = [500, 260, 50 + 120];
    /// Least time between two readings that can differ, `s`.
    pub const SAMPLE_S: f32 = 150e-6;
    /// How old the angle is that it says, once it is [set up](Self::SETUP), in the mean, `s`: half a sample for waiting, and half a
    /// sample for a mean over two. The latter is taken from the data sheet's step response of 0.286 ms, and was never measured.
    pub const AGE_S: f32 = Self::SAMPLE_S;
    /// Write this once after power-on: the fastest of its filters, over two samples (CONF, SF). The one that it starts with makes
    /// the angle 2.2 ms late.
    pub const SETUP: [u8; 2] = [0x07, 0x03];
    /// Write this, then read three bytes after a repeated start: the status, and the two bytes of the raw angle.
    pub const REQUEST: [u8; 1] = [0x0B];

    /// What the three bytes say.
    ///
    /// A line that is always low or always high is [`Rotor::Lost`]; a wrong bit of the angle is not found. Without an
    /// acknowledge there are no bytes: that is [`Rotor::Lost`] too, by the caller.
    #[must_use]
    pub fn decode([status, high, low]: [u8; 3]) -> Rotor {
        match status & (DETECTED | TOO_WEAK | TOO_STRONG) {
            DETECTED => Rotor::At(Angle((u32::from(high) << 8 | u32::from(low)) << 20)),
            0 if [status, high, low] == [0; 3] => Rotor::Lost,
            both if both & TOO_WEAK != 0 && both & TOO_STRONG != 0 => Rotor::Lost,
            _ => Rotor::BadMagnet,
        }
    }
}

/// There is a magnet (MD).
const DETECTED: u8 = 1 << 5;
/// It is too weak (ML).
const TOO_WEAK: u8 = 1 << 4;
/// It is too strong (MH).
const TOO_STRONG: u8 = 1 << 3;

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(status: u8, count: u16) -> Rotor {
        let [high, low] = count.to_be_bytes();
        As5600::decode([status, high, low])
    }

    #[test]
    fn every_angle_comes_through() {
        for count in 0..1 << 12 {
            let expected = Rotor::At(Angle::from_counts(u32::from(count), As5600::COUNTS_PER_TURN));
            assert_eq!(decode(DETECTED, count), expected);
            // The data sheet leaves the other bits open.
            assert_eq!(decode(DETECTED | 0b1100_0111, 0xF000 | count), expected);
        }
    }

    #[test]
    fn a_chip_that_is_not_there_is_lost() {
        assert_eq!(decode(0, 0), Rotor::Lost);
        assert_eq!(decode(0xFF, 0xFFFF), Rotor::Lost);
    }

    #[test]
    fn a_bad_magnet_is_told() {
        assert_eq!(decode(0, 5), Rotor::BadMagnet);
        assert_eq!(decode(TOO_WEAK, 0), Rotor::BadMagnet);
        assert_eq!(decode(DETECTED | TOO_WEAK, 5), Rotor::BadMagnet);
        assert_eq!(decode(DETECTED | TOO_STRONG, 5), Rotor::BadMagnet);
        assert_eq!(decode(DETECTED | TOO_WEAK | TOO_STRONG, 5), Rotor::Lost, "both cannot be");
    }

    #[test]
    fn a_wrong_bit_of_the_status_that_counts_is_found() {
        for flag in [DETECTED, TOO_WEAK, TOO_STRONG] {
            assert_eq!(decode(DETECTED ^ flag, 5), Rotor::BadMagnet);
        }
    }
}
