//! Vectors in the stator and rotor frames, and the rotation between them.

use crate::angle::{Angle, sin_cos_near_zero};

/// `1/√3`.
pub(crate) const FRAC_1_SQRT_3: f32 = 0.577_350_26;
/// `√3/2`.
const FRAC_SQRT_3_2: f32 = 0.866_025_4;

/// Vector in the stator frame: `alpha` along phase U, `beta` a quarter of an electrical turn ahead.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AlphaBeta {
    /// Component along phase U.
    pub alpha: f32,
    /// Component a quarter of an electrical turn ahead.
    pub beta: f32,
}

/// Vector in the rotor frame: `d` along the magnets, `q` a quarter of an electrical turn ahead.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Dq {
    /// Component along the flux of the magnets.
    pub d: f32,
    /// Component that produces torque.
    pub q: f32,
}

/// Sine and cosine of the angle between stator and rotor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rotation {
    sin: f32,
    cos: f32,
}

impl AlphaBeta {
    /// Converts from three phases (Clarke); drops the common mode.
    #[inline]
    #[must_use]
    pub fn from_phases([u, v, w]: [f32; 3]) -> Self {
        Self { alpha: u - (u + v + w) * (1.0 / 3.0), beta: (v - w) * FRAC_1_SQRT_3 }
    }

    /// Scales the vector.
    #[inline]
    #[must_use]
    pub fn scaled(self, factor: f32) -> Self {
        Self { alpha: factor * self.alpha, beta: factor * self.beta }
    }

    /// Converts to three phases, whose sum is 0.
    #[inline]
    #[must_use]
    pub fn to_phases(self) -> [f32; 3] {
        let (half, side) = (-0.5 * self.alpha, FRAC_SQRT_3_2 * self.beta);
        [self.alpha, half + side, half - side]
    }
}

impl Rotation {
    /// Creates the rotation to an electrical angle.
    #[inline]
    #[must_use]
    pub fn from_angle(angle: Angle) -> Self {
        let (sin, cos) = angle.sin_cos();
        Self { sin, cos }
    }

    /// Rotates further by `angle_rad`, within ±π/4 electrical `rad`.
    #[inline]
    #[must_use]
    pub fn advanced_by(self, angle_rad: f32) -> Self {
        let (sin, cos) = sin_cos_near_zero(angle_rad);
        Self { sin: self.sin * cos + self.cos * sin, cos: self.cos * cos - self.sin * sin }
    }

    /// Converts to the rotor frame (Park).
    #[inline]
    #[must_use]
    pub fn park(self, AlphaBeta { alpha, beta }: AlphaBeta) -> Dq {
        Dq { d: alpha * self.cos + beta * self.sin, q: beta * self.cos - alpha * self.sin }
    }

    /// Converts from the rotor frame (inverse Park).
    #[inline]
    #[must_use]
    pub fn unpark(self, Dq { d, q }: Dq) -> AlphaBeta {
        AlphaBeta { alpha: d * self.cos - q * self.sin, beta: d * self.sin + q * self.cos }
    }

    /// Converts from the rotor frame, for `d = 0`.
    #[inline]
    #[must_use]
    pub fn unpark_q(self, q: f32) -> AlphaBeta {
        AlphaBeta { alpha: -q * self.sin, beta: q * self.cos }
    }
}

#[cfg(test)]
mod tests {
    use core::f32::consts::TAU;

    use super::*;

    #[test]
    fn a_balanced_system_is_a_vector_of_its_peak_that_stands_still_in_the_rotor() {
        for step in 0..360_u16 {
            let angle_rad = f32::from(step).to_radians();
            let phases = [0.0, 1.0, 2.0].map(|phase| 3.0 * (angle_rad - phase * TAU / 3.0).cos());
            let wrapped = Angle(0).add_rad(angle_rad / 2.0).add_rad(angle_rad / 2.0);
            let Dq { d, q } = Rotation::from_angle(wrapped).park(AlphaBeta::from_phases(phases));
            assert!((d - 3.0).abs() < 5e-6 && q.abs() < 5e-6, "{step}: {d} {q}");
            let back = Rotation::from_angle(wrapped).unpark(Dq { d, q }).to_phases();
            assert_eq!(
                Rotation::from_angle(wrapped).unpark_q(2.0),
                Rotation::from_angle(wrapped).unpark(Dq { d: 0.0, q: 2.0 })
            );
            assert!(phases.iter().zip(back).all(|(one, other)| (one - other).abs() < 1e-5), "{back:?}");
        }
    }
}
