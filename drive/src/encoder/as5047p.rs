//! ams AS5047P: 14 bits over SPI, each frame with a parity bit.
//!
//! After the data sheet (ams AS5047P, "SPI Interface (slave)" and "Register Description") and its public drivers.

use crate::{Angle, Rotor};

/// An AS5047P.
///
/// A reply comes with the next frame. So the three frames of a reading bring what the last reading asked for last, then
/// the angle, then how the magnet is.
#[derive(Debug, Clone, Copy)]
pub struct As5047p;

impl As5047p {
    /// Angles that it tells apart in a turn.
    pub const COUNTS_PER_TURN: u32 = 1 << 14;
    /// The fastest clock, `Hz`. It idles low, and bits are taken at its falling edge (SPI mode 1), the highest bit first.
    pub const MOST_CLOCK_HZ: u32 = 10_000_000;
    /// Least time from selecting the chip to the first edge of the clock, and from one frame to the next with the chip not
    /// selected, `ns`. The three frames take 7 µs at the fastest clock: it can be read every 50 µs.
    pub const LEAST_SELECT_NS: u32 = 350;
    /// The frames of a reading, each selected by itself: read the compensated angle, its diagnosis, and the errors, which
    /// forgets them. Without that one damaged command would mark all replies after it.
    pub const REQUEST: [[u8; 2]; 3] = [read(0x3FFF), read(0x3FFC), read(0x0001)];

    /// What the replies to the frames of [`REQUEST`](Self::REQUEST) say.
    ///
    /// A damaged one, and a chip that is not there or still starting, is [`Rotor::Lost`]. The first reading after power-on
    /// is whole: its first reply is not looked at.
    #[must_use]
    pub fn decode([_, angle, diagnosis]: [[u8; 2]; 3]) -> Rotor {
        let (Some(angle), Some(diagnosis)) = (data(angle), data(diagnosis)) else { return Rotor::Lost };
        if diagnosis & STARTED == 0 {
            return Rotor::Lost;
        }
        if diagnosis & (TOO_WEAK | TOO_STRONG | OVERFLOW) != 0 {
            return Rotor::BadMagnet;
        }
        Rotor::At(Angle(u32::from(angle) << 18))
    }
}

/// Of a command that reads.
const READ: u16 = 1 << 14;
/// Of a reply: a command was damaged.
const ERROR: u16 = 1 << 14;
/// Of the diagnosis: the magnet is too weak (MAGL).
const TOO_WEAK: u16 = 1 << 11;
/// It is too strong (MAGH).
const TOO_STRONG: u16 = 1 << 10;
/// The angle could not be computed (COF).
const OVERFLOW: u16 = 1 << 9;
/// The offsets are compensated (LF). A line that is always low lacks it.
const STARTED: u16 = 1 << 8;

/// The command that reads a register, with even parity.
const fn read(address: u16) -> [u8; 2] {
    let command = READ | address;
    if has_even_parity(command) { command } else { command | 1 << 15 }.to_be_bytes()
}

/// The 14 bits of a reply, unless it is damaged or says that a command was.
fn data(reply: [u8; 2]) -> Option<u16> {
    let reply = u16::from_be_bytes(reply);
    (has_even_parity(reply) && reply & ERROR == 0).then_some(reply & 0x3FFF)
}

const fn has_even_parity(frame: u16) -> bool {
    frame.count_ones().is_multiple_of(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As the chip sends 14 bits.
    fn reply(data: u16) -> [u8; 2] {
        (data | u16::from(data.count_ones() % 2 == 1) << 15).to_be_bytes()
    }

    /// Started, with a gain in the middle.
    const GOOD: u16 = STARTED | 0x80;

    #[test]
    fn commands_have_even_parity_and_the_addresses_of_the_data_sheet() {
        assert_eq!(As5047p::REQUEST, [[0xFF, 0xFF], [0xFF, 0xFC], [0x40, 0x01]]);
        for command in As5047p::REQUEST {
            assert!(u16::from_be_bytes(command).count_ones().is_multiple_of(2));
        }
    }

    #[test]
    fn every_angle_comes_through() {
        for count in 0..1 << 14 {
            let expected = Rotor::At(Angle::from_counts(u32::from(count), As5047p::COUNTS_PER_TURN));
            assert_eq!(As5047p::decode([[0xFF; 2], reply(count), reply(GOOD)]), expected);
        }
    }

    #[test]
    fn every_wrong_bit_is_found() {
        for (angle, bit) in
            [0, 1, 0x1234, 0x3FFF].into_iter().flat_map(|angle| (0..16).map(move |bit| (angle, bit)))
        {
            let wrong = |reply: [u8; 2]| (u16::from_be_bytes(reply) ^ 1 << bit).to_be_bytes();
            assert_eq!(As5047p::decode([[0; 2], wrong(reply(angle)), reply(GOOD)]), Rotor::Lost);
            assert_eq!(As5047p::decode([[0; 2], reply(angle), wrong(reply(GOOD))]), Rotor::Lost);
        }
    }

    #[test]
    fn a_chip_that_is_not_there_or_got_a_damaged_command_is_lost() {
        assert_eq!(As5047p::decode([[0; 2]; 3]), Rotor::Lost);
        assert_eq!(As5047p::decode([[0xFF; 2]; 3]), Rotor::Lost);
        assert_eq!(As5047p::decode([[0; 2], reply(5), reply(GOOD ^ STARTED)]), Rotor::Lost);
        assert_eq!(As5047p::decode([[0; 2], reply(5 | ERROR), reply(GOOD)]), Rotor::Lost);
        assert_eq!(As5047p::decode([[0; 2], reply(5), reply(GOOD | ERROR)]), Rotor::Lost);
    }

    #[test]
    fn a_bad_magnet_is_told() {
        for flag in [TOO_WEAK, TOO_STRONG, OVERFLOW] {
            assert_eq!(As5047p::decode([[0; 2], reply(5), reply(GOOD | flag)]), Rotor::BadMagnet);
        }
    }
}
