//! Faults and limits reported by a drive.

use core::fmt;

/// Number in a drive's fault register: a fault in mode [`Fault`](crate::MoteusMode::Fault), in any other mode an active
/// limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MoteusFault(u8);

impl MoteusFault {
    /// Converts a number of the drive; `None` for 0.
    #[must_use]
    pub fn from_number(number: u8) -> Option<Self> {
        (number != 0).then_some(Self(number))
    }

    /// Returns the number.
    #[must_use]
    pub fn number(self) -> u8 {
        self.0
    }

    /// Checks for a limit: the drive keeps running with less than the commanded torque.
    #[must_use]
    pub fn is_limit(self) -> bool {
        (96..=103).contains(&self.0)
    }

    /// Returns the recommended action.
    #[must_use]
    pub fn remedy(self) -> &'static str {
        self.texts().1
    }

    /// Returns cause and action.
    fn texts(self) -> (&'static str, &'static str) {
        match self.0 {
            1..=7 => ("internal transfer error", "check the wiring of encoders and serial ports"),
            32 => ("calibration found no magnet", "check magnet and encoder, then calibrate again"),
            33 => ("gate driver fault", "check the supply for dips and the phases for shorts"),
            34 => ("overvoltage", "reduce braking, or check `servo.max_voltage`"),
            35 => ("implausible encoder readings", "check the encoder's magnet and wiring"),
            36 => ("motor not configured", "run `moteus_tool --calibrate` with the joint free"),
            37 => ("control cycle overrun", "update the drive's firmware, or lower its update rate"),
            38 => ("overtemperature", "let the drive cool, reduce the load or improve cooling"),
            39 => (
                "position out of bounds",
                "move the joint inside, or check `servopos.position_min` and `_max`",
            ),
            40 => ("undervoltage", "check supply, fuse and wiring under load"),
            41 => ("configuration changed while running", "stop the drive, then command it again"),
            42 => ("no valid rotor angle", "check the commutation encoder and its wiring"),
            43 => ("no valid output angle", "check the output encoder and its wiring"),
            44 => ("gate driver not enabled", "check the supply; replace the drive if the fault persists"),
            45 => ("stop position combined with limits", "use the stop position or the limits, not both"),
            46 => ("timing violation", "update the drive's firmware; report the fault to the manufacturer"),
            47 => ("back-EMF feed-forward without acceleration limit", "set `servo.bemf_feedforward` to 0"),
            48 => ("position bounds out of range", "check `servopos.position_min` and `_max`"),
            96 => ("velocity limit active", "move slower, or check `servo.max_velocity`"),
            97 => ("power limit active", "reduce the load, or check `servo.max_power_W`"),
            98 => ("voltage limit active", "move slower, or raise the supply voltage"),
            99 => ("current limit active", "reduce the torque, or check `servo.max_current_A`"),
            100 => ("board temperature limit active", "let the drive cool, or improve cooling"),
            101 => ("motor temperature limit active", "let the motor cool, or reduce the torque"),
            102 => ("commanded torque limit active", "command a higher maximum torque"),
            103 => ("position bounds active", "check `servopos.position_min` and `_max`"),
            _ => ("unknown fault", "look up the number in the moteus register reference"),
        }
    }
}

impl fmt::Display for MoteusFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.texts().0, self.0)
    }
}
