//! Frames to a drive.

use super::NOP;
use super::register::{
    COMMAND_POSITION, COMMAND_TORQUE, INTEGRAL_SCALE, MODE, POSITION, PROPORTIONAL_SCALE, TIMEOUT, VOLTAGE,
};

/// Subframe types; the lowest two bits are the number of registers.
const WRITE_INT8: u8 = 0x00;
const WRITE_FLOAT: u8 = 0x0c;
const READ_INT8: u8 = 0x10;
const READ_FLOAT: u8 = 0x1c;

/// Mode; position, velocity and torque; voltage, temperature and fault.
const QUERY: [u8; 6] = [READ_INT8 | 1, MODE, READ_FLOAT | 3, POSITION, READ_INT8 | 3, VOLTAGE];

const MODE_STOPPED: u8 = 0;
const MODE_POSITION: u8 = 10;
/// Commanded position NaN (minimum integer): the present position.
const HERE: u8 = i8::MIN.cast_unsigned();

/// Maximum frame length, bytes.
const MAX_BYTES: usize = 32;

/// Data of a CAN FD frame, padded to a valid length. Each frame queries the contents of
/// [`MoteusState`](crate::MoteusState).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MoteusFrame {
    bytes: [u8; MAX_BYTES],
    length: usize,
}

impl MoteusFrame {
    /// Creates a query without a command; a running timeout continues.
    #[must_use]
    pub fn query() -> Self {
        Self::asking([])
    }

    /// Creates a stop: opens all switches, clears a fault or timeout.
    #[must_use]
    pub fn stop() -> Self {
        Self::asking([WRITE_INT8 | 1, MODE, MODE_STOPPED])
    }

    /// Creates a torque command at the output, `N m`, valid for `timeout_s` after reception, > 0. The drive applies its
    /// own limits.
    ///
    /// Returns [`stop`](Self::stop), which also clears a fault, if the torque is NaN or infinite or the timeout is not
    /// finite and above 0: the drive would take 0 for its configured timeout and NaN for no timeout.
    ///
    /// moteus has no torque mode: the command uses the position mode with all position gains at 0.
    #[must_use]
    pub fn torque(torque_nm: f32, timeout_s: f32) -> Self {
        if !(torque_nm.is_finite() && timeout_s.is_finite() && timeout_s > 0.0) {
            return Self::stop();
        }
        let [torque_0, torque_1, torque_2, torque_3] = torque_nm.to_le_bytes();
        let [timeout_0, timeout_1, timeout_2, timeout_3] = timeout_s.to_le_bytes();
        #[rustfmt::skip]
        let subframes = [
            // The mode must be first: it resets all commands.
            WRITE_INT8 | 1, MODE, MODE_POSITION,
            // Position and velocity.
            WRITE_INT8 | 2, COMMAND_POSITION, HERE, 0,
            WRITE_FLOAT | 1, COMMAND_TORQUE, torque_0, torque_1, torque_2, torque_3,
            // Scales of the proportional and derivative gain.
            WRITE_INT8 | 2, PROPORTIONAL_SCALE, 0, 0,
            WRITE_FLOAT | 1, TIMEOUT, timeout_0, timeout_1, timeout_2, timeout_3,
            WRITE_INT8 | 1, INTEGRAL_SCALE, 0,
        ];
        Self::asking(subframes)
    }

    /// Returns the data: 6, 12 or 32 bytes.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }

    /// Creates a frame of a command followed by the query.
    fn asking<const LENGTH: usize>(command: [u8; LENGTH]) -> Self {
        const { assert!(LENGTH + QUERY.len() <= MAX_BYTES) };
        let mut bytes = [NOP; MAX_BYTES];
        bytes.iter_mut().zip(command.into_iter().chain(QUERY)).for_each(|(place, byte)| *place = byte);
        // Valid CAN FD lengths.
        let mut lengths = (0..=8).chain([12, 16, 20, 24]);
        let length = lengths.find(|length| *length >= LENGTH + QUERY.len()).unwrap_or(MAX_BYTES);
        Self { bytes, length }
    }
}
