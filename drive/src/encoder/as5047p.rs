//! ams AS5047P encoder: 14 bits over SPI, each frame with a parity bit.
//!
//! Source: data sheet (ams AS5047P, "SPI Interface (slave)" and "Register Description") and public drivers.

use crate::{Angle, Rotor};

/// An AS5047P.
///
/// The chip replies in the next frame: the three frames of a reading return the last reply of the reading before, the
/// angle, and the diagnosis.
#[derive(Debug, Clone, Copy)]
pub struct As5047p;

impl As5047p {
    /// Counts per turn.
    pub const COUNTS_PER_TURN: u32 = 1 << 14;
    /// Maximum clock, `Hz`. SPI mode 1 (idle low, sampled on the falling edge), most significant bit first.
    pub const MAX_CLOCK_HZ: u32 = 10_000_000;
    /// Minimum time from chip select to the first clock edge, and between two frames with the chip deselected, `ns`.
    /// The three frames take 7 µs at the maximum clock: the chip can be read every 50 µs.
    pub const MIN_SELECT_NS: u32 = 350;
    /// Frames of a reading, each with its own chip select: read the compensated angle, the diagnosis, and the error
    /// register, which clears it. Otherwise one corrupted command would flag all later replies.
    pub const REQUEST: [[u8; 2]; 3] = [read(0x3FFF), read(0x3FFC), read(0x0001)];

    /// Decodes the replies to the frames of [`REQUEST`](Self::REQUEST).
    ///
    /// A corrupted reply, a missing chip and a chip that is still starting return [`Rotor::Lost`]. The first reading
    /// after power-on is valid, because the first reply is ignored.
    #[must_use]
    pub fn decode([_, angle, diagnosis]: [[u8; 2]; 3]) -> Rotor {
        let (Some(angle), Some(diagnosis)) = (data(angle), data(diagnosis)) else { return Rotor::Lost };
        if diagnosis & STARTED == 0 {
            return Rotor::Lost;
        }
        if diagnosis & (TOO_WEAK | TOO_STRONG | OVERFLOW) != 0 {
            return Rotor::BadMagnet;
        }
        Rotor::Angle(Angle(u32::from(angle) << 18))
    }
}

/// Read bit of a command.
const READ: u16 = 1 << 14;
/// Error bit of a reply: a command was corrupted.
const ERROR: u16 = 1 << 14;
/// Diagnosis: magnet too weak (MAGL).
const TOO_WEAK: u16 = 1 << 11;
/// Diagnosis: magnet too strong (MAGH).
const TOO_STRONG: u16 = 1 << 10;
/// Diagnosis: angle computation overflow (COF).
const OVERFLOW: u16 = 1 << 9;
/// Diagnosis: offset compensation finished (LF); 0 on a line stuck low.
const STARTED: u16 = 1 << 8;

/// Returns the read command of a register, with even parity.
const fn read(address: u16) -> [u8; 2] {
    let command = READ | address;
    if has_even_parity(command) { command } else { command | 1 << 15 }.to_be_bytes()
}

/// Returns the 14 data bits of a reply; `None` for a parity error or the error bit.
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

    /// Returns 14 bits as the chip sends them.
    fn reply(data: u16) -> [u8; 2] {
        (data | u16::from(data.count_ones() % 2 == 1) << 15).to_be_bytes()
    }

    /// Started, with a mid-range gain.
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
            let expected = Rotor::Angle(Angle::from_counts(u32::from(count), As5047p::COUNTS_PER_TURN));
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
