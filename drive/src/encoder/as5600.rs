//! ams AS5600 encoder: 12 bits over I²C, for slow joints.
//!
//! Source: data sheet (ams AS5600, "I²C Interface" and "Register Description") and public drivers.

use crate::{Angle, Rotor};

/// An AS5600.
///
/// Too slow for a period of 50 µs: a reading takes 57 µs at the maximum clock, and the chip samples every 150 µs and
/// filters the samples. The bytes have no checksum, only acknowledge bits.
#[derive(Debug, Clone, Copy)]
pub struct As5600;

impl As5600 {
    /// Counts per turn.
    pub const COUNTS_PER_TURN: u32 = 1 << 12;
    /// I²C address, 7 bits.
    pub const ADDRESS: u8 = 0x36;
    /// Maximum clock, `Hz`: Fast-mode Plus.
    pub const MAX_CLOCK_HZ: u32 = 1_000_000;
    /// Minimum clock low time, clock high time, and data setup time including the maximum rise time of the data, `ns`
    /// (NXP UM10204, Fast-mode Plus).
    pub const MIN_I2C_TIMES_NS: [u32; 3] = [500, 260, 50 + 120];
    /// Sample period of the chip, `s`.
    pub const SAMPLE_S: f32 = 150e-6;
    /// Mean age of the angle after [setup](Self::SETUP), `s`: half a sample period of waiting plus half of filtering
    /// over two samples. The filter delay is from the data sheet's step response of 0.286 ms; it has not been measured.
    pub const MEAN_LATENCY_S: f32 = Self::SAMPLE_S;
    /// Write once after power-on: selects the fastest filter, over two samples (CONF, SF). The default filter delays
    /// the angle by 2.2 ms.
    pub const SETUP: [u8; 2] = [0x07, 0x03];
    /// Write, then read three bytes after a repeated start: the status and the two bytes of the raw angle.
    pub const REQUEST: [u8; 1] = [0x0B];

    /// Decodes the three bytes.
    ///
    /// A line stuck low or high returns [`Rotor::Lost`]; a wrong bit of the angle is not detected. Without an
    /// acknowledge there are no bytes: the caller reports [`Rotor::Lost`].
    #[must_use]
    pub fn decode([status, high, low]: [u8; 3]) -> Rotor {
        match status & (DETECTED | TOO_WEAK | TOO_STRONG) {
            DETECTED => Rotor::Angle(Angle((u32::from(high) << 8 | u32::from(low)) << 20)),
            0 if [status, high, low] == [0; 3] => Rotor::Lost,
            both if both & TOO_WEAK != 0 && both & TOO_STRONG != 0 => Rotor::Lost,
            _ => Rotor::BadMagnet,
        }
    }
}

/// Magnet detected (MD).
const DETECTED: u8 = 1 << 5;
/// Magnet too weak (ML).
const TOO_WEAK: u8 = 1 << 4;
/// Magnet too strong (MH).
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
            let expected = Rotor::Angle(Angle::from_counts(u32::from(count), As5600::COUNTS_PER_TURN));
            assert_eq!(decode(DETECTED, count), expected);
            // The other bits are unspecified.
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
        assert_eq!(decode(DETECTED | TOO_WEAK | TOO_STRONG, 5), Rotor::Lost, "contradicting flags");
    }

    #[test]
    fn a_wrong_bit_of_the_status_that_counts_is_found() {
        for flag in [DETECTED, TOO_WEAK, TOO_STRONG] {
            assert_eq!(decode(DETECTED ^ flag, 5), Rotor::BadMagnet);
        }
    }
}
