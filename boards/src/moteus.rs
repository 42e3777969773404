//! Moteus drives as a board's joints: ids and limits.

use dimsart_core::{InputLimits, OutputLimits, SafeValue};

/// Up to three drives on a CAN FD bus, limited by an STM32G4's CAN buffers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moteus<const JOINTS: usize> {
    /// Id of the board on the bus, 0 to 126.
    pub host: u8,
    /// `id.id` of each joint's drive, 0 to 126: unique, and different from the host's.
    pub ids: [u8; JOINTS],
    /// Time after which a drive without commands stops, `s`.
    pub timeout_s: f32,
    /// Maximum number of consecutive ticks without a reply.
    pub missing_ticks: u8,
    /// Maximum torque command at the output, `N·m`, either sign: at most what `servo.max_current_A` allows.
    pub max_torque_nm: f32,
    /// Maximum speed of the output, either direction, `rad/s`.
    pub max_speed_rad_per_s: f32,
}

/// Rise time from zero to maximum torque.
const RISE_S: f32 = 0.01;

impl<const JOINTS: usize> Moteus<JOINTS> {
    /// Checks the values; in a constant, at compile time.
    ///
    /// # Panics
    /// For more than three joints, or an invalid or duplicate id.
    #[must_use]
    pub const fn checked(self) -> Self {
        assert!(JOINTS >= 1 && JOINTS <= 3);
        let mut rest: &[u8] = &self.ids;
        while let [id, others @ ..] = rest {
            assert!(*id <= 126 && self.host <= 126 && *id != self.host);
            let mut behind = others;
            while let [other, more @ ..] = behind {
                assert!(*id != *other);
                behind = more;
            }
            rest = others;
        }
        self
    }

    /// Returns the limits of torque commands, `N·m`: 10 ms from zero to maximum; safe value 0.
    #[must_use]
    pub const fn limits(&self) -> InputLimits {
        let max = self.max_torque_nm;
        InputLimits { min: -max, max, rate_per_s: max / RISE_S, safe_value: SafeValue::Zero }
    }

    /// Returns the limits of position measurements: any angle, and 1.5 times the maximum speed.
    #[must_use]
    pub const fn position_limits(&self) -> OutputLimits {
        OutputLimits { rate_per_s: 1.5 * self.max_speed_rad_per_s, ..OutputLimits::NONE }
    }
}

#[cfg(test)]
mod tests {
    use std::panic::catch_unwind;

    use super::*;

    const DRIVES: Moteus<2> = Moteus {
        host: 0,
        ids: [1, 2],
        timeout_s: 0.02,
        missing_ticks: 3,
        max_torque_nm: 2.0,
        max_speed_rad_per_s: 50.0,
    };

    #[test]
    fn drives_that_cannot_be_told_apart_are_refused() {
        assert_eq!(DRIVES.checked(), DRIVES);
        for (host, ids) in [(0, [1, 1]), (0, [0, 1]), (2, [1, 2]), (0, [1, 127]), (127, [1, 2])] {
            assert!(catch_unwind(|| Moteus { host, ids, ..DRIVES }.checked()).is_err(), "{host} {ids:?}");
        }
        assert!(
            catch_unwind(|| Moteus {
                host: 0,
                ids: [1, 2, 3, 4],
                timeout_s: 0.02,
                missing_ticks: 3,
                max_torque_nm: 1.0,
                max_speed_rad_per_s: 1.0
            }
            .checked())
            .is_err()
        );
    }

    #[test]
    fn a_torque_rises_within_its_range_in_ten_milliseconds() {
        let InputLimits { min, max, rate_per_s, safe_value } = DRIVES.limits();
        assert!((max - 2.0).abs() < 1e-6 && (min + 2.0).abs() < 1e-6 && (rate_per_s - 200.0).abs() < 1e-3);
        assert_eq!(safe_value, SafeValue::Zero);
        assert!((DRIVES.position_limits().rate_per_s - 75.0).abs() < 1e-3);
    }
}
