//! What a hand is told to do for some time.
//!
//! A least-jerk move: `from + (to - from) (10 t³ - 15 t⁴ + 6 t⁵)`, `t` from 0 to 1 (Flash and Hogan 1985).

use super::parameter::{ParameterError, finite, not_negative, require};

/// What the hand does from `start_s` to `end_s`, `s`. In no phase, it is as in [`Release`](Self::Release).
///
/// A phase acts in whole periods: those whose middle lies in `start_s <= t < end_s`. Within a period the target
/// moves on a straight line between where the script has it at both ends.
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "the fields are named in full, and in their variant's line")]
pub enum HandPhase {
    /// Moves the target from `from_m` to `to_m` with the least jerk: at rest at both ends, peak speed
    /// `1.875 (to_m - from_m)/(end_s - start_s)` (Flash and Hogan 1985).
    Move { start_s: f64, end_s: f64, from_m: f64, to_m: f64 },
    /// Keeps the target at `target_m`.
    Hold { start_s: f64, end_s: f64, target_m: f64 },
    /// Moves the target as `center_m + amplitude_m sin(2 π frequency_hz (t - start_s))`.
    Sine { start_s: f64, end_s: f64, center_m: f64, amplitude_m: f64, frequency_hz: f64 },
    /// Pushes with `force_n`, the spring off.
    Push { start_s: f64, end_s: f64, force_n: f64 },
    /// Lets go: neither spring nor push.
    Release { start_s: f64, end_s: f64 },
}

impl HandPhase {
    /// When it starts and ends, `s`.
    #[must_use]
    pub fn span_s(&self) -> (f64, f64) {
        match *self {
            Self::Move { start_s, end_s, .. }
            | Self::Hold { start_s, end_s, .. }
            | Self::Sine { start_s, end_s, .. }
            | Self::Push { start_s, end_s, .. }
            | Self::Release { start_s, end_s } => (start_s, end_s),
        }
    }

    /// Says whether a hand can do this.
    pub(super) fn check(&self) -> Result<(), ParameterError> {
        let (start_s, end_s) = self.span_s();
        finite("start_s", start_s)?;
        require("end_s", end_s, end_s > start_s, &format!("> start_s = {start_s}, or inf"))?;
        match *self {
            Self::Move { from_m, to_m, .. } => {
                finite("end_s", end_s)?;
                finite("from_m", from_m)?;
                finite("to_m", to_m)
            }
            Self::Hold { target_m, .. } => finite("target_m", target_m),
            Self::Sine { center_m, amplitude_m, frequency_hz, .. } => {
                finite("center_m", center_m)?;
                finite("amplitude_m", amplitude_m)?;
                not_negative("frequency_hz", frequency_hz)
            }
            Self::Push { force_n, .. } => finite("force_n", force_n),
            Self::Release { .. } => Ok(()),
        }
    }

    /// Target at `time_s`, `m`; none if the spring is off.
    pub(super) fn target_m(&self, time_s: f64) -> Option<f64> {
        match *self {
            Self::Move { start_s, end_s, from_m, to_m } => {
                let t = ((time_s - start_s) / (end_s - start_s)).clamp(0.0, 1.0);
                Some(from_m + (to_m - from_m) * (t * t * t * (10.0 + t * (-15.0 + 6.0 * t))))
            }
            Self::Hold { target_m, .. } => Some(target_m),
            Self::Sine { start_s, center_m, amplitude_m, frequency_hz, .. } => {
                let angle = core::f64::consts::TAU * frequency_hz * (time_s - start_s);
                Some(center_m + amplitude_m * libm::sin(angle))
            }
            Self::Push { .. } | Self::Release { .. } => None,
        }
    }
}
