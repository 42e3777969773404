//! What is sent to a drive.

use super::NOP;
use super::register::{
    COMMAND_POSITION, COMMAND_TORQUE, INTEGRAL_SCALE, MODE, POSITION, PROPORTIONAL_SCALE, TIMEOUT, VOLTAGE,
};

/// Kinds of subframes; the lowest two bits say how many registers.
const WRITE_INT8: u8 = 0x00;
const WRITE_FLOAT: u8 = 0x0c;
const READ_INT8: u8 = 0x10;
const READ_FLOAT: u8 = 0x1c;

/// Mode; position, velocity and torque; voltage, temperature and fault.
const QUERY: [u8; 6] = [READ_INT8 | 1, MODE, READ_FLOAT | 3, POSITION, READ_INT8 | 3, VOLTAGE];

const MODE_STOPPED: u8 = 0;
const MODE_POSITION: u8 = 10;
/// As a commanded position, where the joint is: the integer that is no number.
const HERE: u8 = i8::MIN.cast_unsigned();

/// Bytes of the longest frame.
const MOST_BYTES: usize = 32;

/// Data of a CAN FD frame, of a length that CAN FD has. Each asks for what [`MoteusState`](crate::MoteusState) shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MoteusFrame {
    bytes: [u8; MOST_BYTES],
    length: usize,
}

impl MoteusFrame {
    /// Asks, and commands nothing: a timeout that runs goes on.
    #[must_use]
    pub fn query() -> Self {
        Self::asking([])
    }

    /// Opens all switches; clears a fault and a timeout.
    #[must_use]
    pub fn stop() -> Self {
        Self::asking([WRITE_INT8 | 1, MODE, MODE_STOPPED])
    }

    /// A torque at the output, `N m`, for `timeout_s` after it has come, > 0. The drive holds it within its own limits.
    ///
    /// It is [`stop`](Self::stop) where the torque is not finite, and where the timeout is not finite and above 0: to the
    /// drive, 0 is its configured timeout and NaN is none at all. As every stop, that clears a fault, too.
    ///
    /// There is no mode of torque: it is the position mode without any part of its position controller.
    #[must_use]
    pub fn torque(torque_nm: f32, timeout_s: f32) -> Self {
        if !(torque_nm.is_finite() && timeout_s.is_finite() && timeout_s > 0.0) {
            return Self::stop();
        }
        let [torque_0, torque_1, torque_2, torque_3] = torque_nm.to_le_bytes();
        let [timeout_0, timeout_1, timeout_2, timeout_3] = timeout_s.to_le_bytes();
        #[rustfmt::skip]
        let subframes = [
            // The mode first: it sets all that is commanded back.
            WRITE_INT8 | 1, MODE, MODE_POSITION,
            // Position and velocity.
            WRITE_INT8 | 2, COMMAND_POSITION, HERE, 0,
            WRITE_FLOAT | 1, COMMAND_TORQUE, torque_0, torque_1, torque_2, torque_3,
            // Of the proportional and of the derivative part.
            WRITE_INT8 | 2, PROPORTIONAL_SCALE, 0, 0,
            WRITE_FLOAT | 1, TIMEOUT, timeout_0, timeout_1, timeout_2, timeout_3,
            WRITE_INT8 | 1, INTEGRAL_SCALE, 0,
        ];
        Self::asking(subframes)
    }

    /// What goes into the frame: 6, 12 or 32 bytes.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }

    /// With the question behind what is commanded.
    fn asking<const LENGTH: usize>(command: [u8; LENGTH]) -> Self {
        const { assert!(LENGTH + QUERY.len() <= MOST_BYTES) };
        let mut bytes = [NOP; MOST_BYTES];
        bytes.iter_mut().zip(command.into_iter().chain(QUERY)).for_each(|(place, byte)| *place = byte);
        // The lengths that a CAN FD frame can have.
        let mut lengths = (0..=8).chain([12, 16, 20, 24]);
        let length = lengths.find(|length| *length >= LENGTH + QUERY.len()).unwrap_or(MOST_BYTES);
        Self { bytes, length }
    }
}
