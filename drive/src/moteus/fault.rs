//! Why a drive is off, or does less than is commanded.

use core::fmt;

/// What a drive's fault register shows, by its number: a fault in the mode [`Fault`](crate::MoteusMode::Fault), in any
/// other what limits the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MoteusFault(u8);

impl MoteusFault {
    /// Of a number of the drive; none for 0.
    #[must_use]
    pub fn from_number(number: u8) -> Option<Self> {
        (number != 0).then_some(Self(number))
    }

    /// As the drive says it.
    #[must_use]
    pub fn number(self) -> u8 {
        self.0
    }

    /// Whether the drive goes on, and only does less than is commanded.
    #[must_use]
    pub fn is_limit(self) -> bool {
        (96..=103).contains(&self.0)
    }

    /// What to do about it.
    #[must_use]
    pub fn remedy(self) -> &'static str {
        self.texts().1
    }

    /// What it is, and what to do.
    fn texts(self) -> (&'static str, &'static str) {
        match self.0 {
            1..=7 => ("a transfer inside it failed", "look at the wires of encoders and serial ports"),
            32 => ("calibration saw no magnet", "look at magnet and encoder, and calibrate again"),
            33 => ("the gate driver reports a fault", "look at supply and phase wires for dips and shorts"),
            34 => ("the supply is too high", "brake less, or look at `servo.max_voltage`"),
            35 => ("the encoder's readings fit no magnet", "look at the encoder's magnet and wires"),
            36 => ("the motor is not configured", "run `moteus_tool --calibrate` with the joint free"),
            37 => ("a period of it took too long", "update its firmware, or lower its update rate"),
            38 => ("it is too hot", "let it cool, command less, or cool it better"),
            39 => (
                "the joint is outside its bounds",
                "turn it inside, or look at `servopos.position_min`, `_max`",
            ),
            40 => ("the supply is too low", "look at supply, fuse and wires under load"),
            41 => ("its configuration was changed while it ran", "stop it, and command again"),
            42 => ("no encoder shows the rotor's angle", "look at the commutation encoder and its wires"),
            43 => ("no encoder shows the output's angle", "look at the output's encoder and its wires"),
            44 => ("the gate driver does not turn on", "look at the supply; else replace the board"),
            45 => ("a stop position came together with limits", "take one of them away"),
            46 => ("a check of its timing failed", "update its firmware, and tell its maker"),
            47 => ("back-EMF fed forward without a limit of acceleration", "set `servo.bemf_feedforward` 0"),
            48 => ("its bounds are beyond what it counts", "look at `servopos.position_min`, `_max`"),
            96 => ("its limit of velocity holds it", "move slower, or look at `servo.max_velocity`"),
            97 => ("its limit of power holds it", "ask for less, or look at `servo.max_power_W`"),
            98 => ("the supply's voltage holds it", "move slower, or raise the supply"),
            99 => ("its limit of current holds it", "ask for less, or look at `servo.max_current_A`"),
            100 => ("the board's temperature holds it", "let it cool, or cool it better"),
            101 => ("the motor's temperature holds it", "let the motor cool, or ask for less"),
            102 => ("the commanded most torque holds it", "command a larger most torque"),
            103 => ("its bounds of position hold it", "look at `servopos.position_min`, `_max`"),
            _ => ("a fault unknown here", "look its number up in the drive's register reference"),
        }
    }
}

impl fmt::Display for MoteusFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.texts().0, self.0)
    }
}
