//! Absolute encoders on SPI or I²C, implemented from their data sheets independently of `drive`.

use chips::stm32g4::{I2cDevice, I2cEvent, SpiDevice, SpiEvent};

/// ams AS5047P. State: angle of 14 bits, DIAAGC, next word to send, ERRFL.
pub(crate) struct As5047pModel;

impl As5047pModel {
    /// DIAAGC: started (LF), with medium gain.
    const GOOD: u32 = 0x180;
    /// The magnetic field is too weak (MAGL).
    pub(crate) const WEAK: u32 = 1 << 11;

    pub(crate) fn device() -> SpiDevice {
        SpiDevice {
            name: "AS5047P",
            mode: 1,
            max_clock_hz: 10e6,
            min_select_s: 350e-9,
            min_release_s: 350e-9,
            state: [0, Self::GOOD, 0, 0],
            on_event: Self::behave,
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

/// `MagnTek` MT6701. State: angle of 14 bits, status of 4 bits, frame being sent, number of sent bits.
pub(crate) struct Mt6701Model;

impl Mt6701Model {
    /// The magnetic field is too weak.
    pub(crate) const WEAK: u32 = 0b0010;

    pub(crate) fn device() -> SpiDevice {
        SpiDevice {
            name: "MT6701",
            mode: 1,
            max_clock_hz: 8e6,
            min_select_s: 100e-9,
            min_release_s: 100e-9,
            state: [0; 4],
            on_event: Self::behave,
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

/// ams AS5600. State: angle of 12 bits, status, register pointer, CONF.
pub(crate) struct As5600Model;

impl As5600Model {
    /// Magnet detected (MD), but too weak (ML).
    pub(crate) const GOOD: u32 = 1 << 5;
    pub(crate) const WEAK: u32 = Self::GOOD | 1 << 4;
    /// The next byte selects the register.
    const OPEN: u32 = 1 << 8;

    pub(crate) fn device() -> I2cDevice {
        I2cDevice {
            name: "AS5600",
            address: 0x36,
            max_clock_hz: 1e6,
            min_low_s: 500e-9,
            min_high_s: 260e-9,
            min_setup_s: 50e-9 + 120e-9,
            state: [0, Self::GOOD, 0, 0],
            on_event: Self::behave,
        }
    }

    /// Number of averaged samples (CONF, SF).
    pub(crate) fn filtered_samples(device: &I2cDevice) -> usize {
        16 >> (device.state[3] >> 8 & 3)
    }

    fn behave([angle, status, register, conf]: &mut [u32; 4], event: I2cEvent) -> u32 {
        match event {
            I2cEvent::Started { is_read } => {
                *register |= if is_read { 0 } else { Self::OPEN };
                1
            }
            I2cEvent::Written { byte } if *register & Self::OPEN != 0 => {
                *register = byte.into();
                1
            }
            I2cEvent::Written { byte } => {
                match register {
                    0x07 => *conf = *conf & 0xFF | u32::from(byte) << 8,
                    0x08 => *conf = *conf & 0xFF00 | u32::from(byte),
                    _ => {}
                }
                *register += 1;
                1
            }
            I2cEvent::Read => {
                let byte = match *register {
                    0x07 => *conf >> 8,
                    0x08 => *conf & 0xFF,
                    0x0B => *status,
                    // Both bytes are of the same angle.
                    0x0C => {
                        *conf = *conf & 0xFFFF | *angle << 16;
                        *angle >> 8
                    }
                    0x0D => *conf >> 16 & 0xFF,
                    _ => 0,
                };
                *register += 1;
                byte
            }
        }
    }
}
