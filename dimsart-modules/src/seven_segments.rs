//! Rest-to-rest move with limits of velocity, acceleration and jerk: seven segments of constant jerk (Biagiotti &
//! Melchiorri, *Trajectory Planning for Automatic Machines and Robots*, section 3.4).
//!
//! The velocity rises in a ramp `T_a`, whose first and last parts `T_j` have jerk, stays constant for `T_v`, and falls
//! symmetrically.

use dimsart_core::{math, words};

words! {
    /// Times of the segments; all zero for no move.
    pub(super) struct SevenSegments {
        jerk: f32,
        /// `T_j`.
        jerk_s: f32,
        /// `T_a`.
        ramp_s: f32,
        /// `T_v`.
        keeping_s: f32,
    }
}

/// Maximum velocity, acceleration and jerk, all above 0.
pub(super) struct Limits {
    pub(super) velocity: f32,
    pub(super) acceleration: f32,
    pub(super) jerk: f32,
}

impl SevenSegments {
    /// Plans the fastest move over a distance above 0.
    pub(super) fn over(distance: f32, &Limits { velocity, acceleration, jerk }: &Limits) -> Self {
        let to_full_s = acceleration / jerk;
        let (jerk_s, ramp_s) = if velocity > acceleration * to_full_s {
            (to_full_s, to_full_s + velocity / acceleration)
        } else {
            let jerk_s = math::sqrt(velocity / jerk);
            (jerk_s, 2.0 * jerk_s)
        };
        let segments = Self { jerk, jerk_s, ramp_s, keeping_s: 0.0 };
        if distance >= segments.distance() {
            return Self { keeping_s: distance / segments.top() - ramp_s, ..segments };
        }
        let half_s = 0.5 * to_full_s;
        if distance >= 2.0 * acceleration * to_full_s * to_full_s {
            let ramp_s = half_s + math::sqrt(half_s * half_s + distance / acceleration);
            return Self { jerk_s: to_full_s, ramp_s, ..segments };
        }
        let jerk_s = cube_root(distance / (2.0 * jerk)).min(to_full_s);
        Self { jerk_s, ramp_s: 2.0 * jerk_s, ..segments }
    }

    /// Returns the duration, s.
    pub(super) fn duration_s(&self) -> f32 {
        2.0 * self.ramp_s + self.keeping_s
    }

    /// Returns the distance.
    pub(super) fn distance(&self) -> f32 {
        self.top() * (self.ramp_s + self.keeping_s)
    }

    /// Returns the peak velocity.
    fn top(&self) -> f32 {
        self.jerk * self.jerk_s * (self.ramp_s - self.jerk_s)
    }

    /// Returns the same move up to `time_s`, followed by braking to rest.
    pub(super) fn cut_at(self, time_s: f32) -> Self {
        let Self { jerk_s, ramp_s, keeping_s, .. } = self;
        if time_s < jerk_s {
            Self { jerk_s: time_s, ramp_s: 2.0 * time_s, keeping_s: 0.0, ..self }
        } else if time_s < ramp_s - jerk_s {
            Self { ramp_s: time_s + jerk_s, keeping_s: 0.0, ..self }
        } else {
            Self { keeping_s: keeping_s.min((time_s - ramp_s).max(0.0)), ..self }
        }
    }

    /// Returns position, velocity and acceleration `time_s` after the start, for the first half. The second half is
    /// symmetric.
    pub(super) fn first_half(&self, time_s: f32) -> [f32; 3] {
        let Self { jerk, jerk_s, ramp_s, .. } = *self;
        if time_s < jerk_s {
            let acceleration = jerk * time_s;
            let velocity = 0.5 * acceleration * time_s;
            return [velocity * time_s * (1.0 / 3.0), velocity, acceleration];
        }
        if time_s < ramp_s - jerk_s {
            let (acceleration, half_s) = (jerk * jerk_s, 0.5 * jerk_s);
            let position = acceleration * (time_s * (0.5 * time_s - half_s) + jerk_s * jerk_s * (1.0 / 6.0));
            return [position, acceleration * (time_s - half_s), acceleration];
        }
        let (top, left_s) = (self.top(), (ramp_s - time_s).max(0.0));
        let acceleration = jerk * left_s;
        let missing = 0.5 * acceleration * left_s;
        let position = top * (time_s - 0.5 * ramp_s) + missing * left_s * (1.0 / 3.0);
        [position, top - missing, acceleration]
    }
}

/// Returns the cube root of `x > 0` with a relative error below 3e-7.
fn cube_root(x: f32) -> f32 {
    // A third of the exponent is within 6 %; each Newton step squares the error.
    let mut root = f32::from_bits(x.to_bits() / 3 + 0x2A51_4067);
    for _ in 0..3 {
        root = (2.0 * root + x / (root * root)) * (1.0 / 3.0);
    }
    root
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_cube_root_is_exact_to_a_few_in_ten_million() {
        let mut x = 1e-20_f32;
        while x < 1e20 {
            let exact = f64::from(x).cbrt();
            let error = (f64::from(super::cube_root(x)) / exact - 1.0).abs();
            assert!(error < 3e-7, "{x}: {error}");
            x *= 1.37;
        }
    }
}
