//! Absolute encoders on an SPI, by their data sheets: what `drive` reads is written here anew.

use chips::stm32g4::{SpiDevice, SpiEvent};

/// ams AS5047P. State: its angle of 14 bits, DIAAGC, what it sends next, ERRFL.
pub(crate) struct As5047pModel;

impl As5047pModel {
    /// DIAAGC: started (LF), with a gain in the middle.
    const GOOD: u32 = 0x180;
    /// The magnet is too weak (MAGL).
    pub(crate) const WEAK: u32 = 1 << 11;

    pub(crate) fn new() -> SpiDevice {
        SpiDevice {
            name: "AS5047P",
            mode: 1,
            most_clock_hz: 10e6,
            least_select_s: 350e-9,
            least_release_s: 350e-9,
            state: [0, Self::GOOD, 0, 0],
            behaviour: Self::behave,
        }
    }

    fn behave([angle, diagnosis, next, errors]: &mut [u32; 4], event: SpiEvent) -> u32 {
        let SpiEvent::Frame { bits, sent } = event else { return 0 };
        let answer = *next;
        // Framing error, parity error, invalid command.
        *errors |= u32::from(bits != 16) | u32::from(sent.count_ones() % 2 == 1) << 2;
        let data = match (sent >> 14 & 1, sent & 0x3FFF) {
            (1, 0x3FFF) => *angle,
            (1, 0x3FFC) => *diagnosis,
            (1, 1) => std::mem::take(errors),
            _ => {
                *errors |= 2;
                0
            }
        };
        let frame = data | u32::from(*errors != 0) << 14;
        *next = frame | (frame.count_ones() % 2) << 15;
        answer
    }
}

/// `MagnTek` MT6701. State: its angle of 14 bits, its status of 4, the frame that it sends, bits of it that are sent.
pub(crate) struct Mt6701Model;

impl Mt6701Model {
    /// The field is too weak.
    pub(crate) const WEAK: u32 = 0b0010;

    pub(crate) fn new() -> SpiDevice {
        SpiDevice {
            name: "MT6701",
            mode: 1,
            most_clock_hz: 8e6,
            least_select_s: 100e-9,
            least_release_s: 100e-9,
            state: [0; 4],
            behaviour: Self::behave,
        }
    }

    fn behave([angle, status, frame, sent_bits]: &mut [u32; 4], event: SpiEvent) -> u32 {
        match event {
            SpiEvent::Selected => {
                let content = *angle << 4 | *status;
                // x⁶ + x + 1.
                let sum = (0..18).rev().fold(0, |sum, bit| {
                    let feedback = (sum >> 5 ^ content >> bit) & 1;
                    (sum << 1 & 0x3F) ^ (0x03 * feedback)
                });
                (*frame, *sent_bits) = (content << 6 | sum, 0);
                0
            }
            SpiEvent::Frame { bits, .. } => {
                *sent_bits += bits;
                24u32.checked_sub(*sent_bits).map_or(0, |left| *frame >> left & ((1 << bits) - 1))
            }
            SpiEvent::Released => 0,
        }
    }
}
