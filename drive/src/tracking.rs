//! Tracking observer: angle and speed of the rotor from a quantised, noisy encoder.
//!
//! An alpha-beta observer with both poles at `w0`: `alpha = 2 w0 T`, `beta = (w0 T)²`, critically damped. The error is
//! 0 at constant speed and `acceleration / w0²` at constant acceleration.

use crate::Angle;

/// Angle and speed observer.
#[derive(Debug, Clone)]
pub struct AngleObserver {
    period_s: f32,
    angle_gain: f32,
    /// Speed gain, 1/s.
    speed_gain: f32,
    angle: Angle,
    speed_rad_per_s: f32,
    /// Predicted angle in the next period.
    expected: Angle,
}

impl AngleObserver {
    /// Creates an observer with period `period_s` and poles at `bandwidth_rad_per_s`, well below `1/period_s`; at rest
    /// at angle 0.
    #[inline]
    #[must_use]
    pub fn new(period_s: f32, bandwidth_rad_per_s: f32) -> Self {
        let share = bandwidth_rad_per_s * period_s;
        Self {
            period_s,
            angle_gain: 2.0 * share,
            speed_gain: share * share / period_s,
            angle: Angle(0),
            speed_rad_per_s: 0.0,
            expected: Angle(0),
        }
    }

    /// Initialises at an angle, after a motion of `moved_rad` in the last period.
    pub fn begin(&mut self, angle: Angle, moved_rad: f32) {
        self.angle = angle;
        self.speed_rad_per_s = moved_rad / self.period_s;
        self.expected = angle.add_rad(moved_rad);
    }

    /// Returns the difference of a measured angle from the prediction, `rad`.
    #[inline]
    #[must_use]
    pub fn prediction_error_rad(&self, measured: Angle) -> f32 {
        measured.wrapping_sub(self.expected).to_rad()
    }

    /// Advances one period with the prediction error; 0 without a measurement.
    #[inline]
    pub fn step(&mut self, prediction_error_rad: f32) {
        self.angle = self.expected.add_rad(self.angle_gain * prediction_error_rad);
        self.speed_rad_per_s += self.speed_gain * prediction_error_rad;
        self.expected = self.angle.add_rad(self.speed_rad_per_s * self.period_s);
    }

    /// Returns the angle of the last step.
    #[inline]
    #[must_use]
    pub fn angle(&self) -> Angle {
        self.angle
    }

    /// Returns the speed of the last step, `rad/s`.
    #[inline]
    #[must_use]
    pub fn speed_rad_per_s(&self) -> f32 {
        self.speed_rad_per_s
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::cast_possible_truncation, reason = "compared with fewer digits than an f32")]

    use core::f32::consts::TAU;

    use super::*;

    const PERIOD_S: f32 = 5e-5;
    const BANDWIDTH: f32 = 2_000.0;

    fn follow(angle_rad: impl Fn(f64) -> f64, counts: u32, periods: u32) -> (f32, f32) {
        let mut tracking = AngleObserver::new(PERIOD_S, BANDWIDTH);
        for period in 0..periods {
            let turns = angle_rad(f64::from(period) * f64::from(PERIOD_S)) / core::f64::consts::TAU;
            #[expect(clippy::cast_sign_loss, reason = "a turn has few counts")]
            let count = (turns.rem_euclid(1.0) * f64::from(counts)) as u32;
            let prediction_error_rad = tracking.prediction_error_rad(Angle::from_counts(count, counts));
            tracking.step(prediction_error_rad);
        }
        let last = angle_rad(f64::from(periods - 1) * f64::from(PERIOD_S));
        let exact = Angle(0).add_rad(last.rem_euclid(core::f64::consts::TAU) as f32 / 2.0);
        let exact = exact.add_rad(last.rem_euclid(core::f64::consts::TAU) as f32 / 2.0);
        (tracking.angle().wrapping_sub(exact).to_rad(), tracking.speed_rad_per_s())
    }

    #[test]
    fn constant_speed_leaves_the_encoder_s_step_as_the_only_error() {
        for speed in [-600.0, -3.0, 40.0, 1_000.0] {
            let (error_rad, found) = follow(|time_s| f64::from(speed) * time_s, 4096, 4_000);
            let count_rad = TAU / 4096.0;
            assert!(error_rad.abs() < 1.1 * count_rad, "{speed}: {error_rad}");
            assert!((found - speed).abs() < 1.5 + 0.002 * speed.abs(), "{speed}: {found}");
        }
    }

    #[test]
    fn constant_acceleration_leaves_what_the_poles_say() {
        let acceleration = 50_000.0;
        let (error_rad, _) = follow(|time_s| 0.5 * acceleration * time_s * time_s, 1 << 24, 400);
        // After the correction step: the lag of the formula minus the correction.
        let expected_rad = -(acceleration as f32) / (BANDWIDTH * BANDWIDTH);
        assert!((error_rad / expected_rad - 1.0).abs() < 0.25, "{error_rad} {expected_rad}");
    }
}
