//! Wrapping angle, with sine and cosine.

use core::f32::consts::{FRAC_1_PI, PI};

/// 2³¹: half a turn.
const HALF_TURN: f32 = 2_147_483_648.0;

/// Angle in units of 2⁻³² turn: wraps without a comparison, and keeps its precision over any number of turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Angle(pub u32);

impl Angle {
    /// Converts from `rad`, clamped to ±π.
    #[inline]
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "a cast saturates")]
    pub fn from_rad(angle_rad: f32) -> Self {
        Self(((angle_rad * (FRAC_1_PI * HALF_TURN)) as i32).cast_unsigned())
    }

    /// Converts from turns, at least 0; whole turns are dropped.
    #[inline]
    #[must_use]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
    pub fn from_turns(turns: f32) -> Self {
        let half_turns = 2.0 * turns;
        let odd = half_turns as u32;
        Self((odd << 31).wrapping_add(((half_turns - odd as f32) * HALF_TURN) as u32))
    }

    /// Converts from an encoder count; `counts_per_turn` is at least 2.
    #[must_use]
    pub fn from_counts(count: u32, counts_per_turn: u32) -> Self {
        let turn = (u64::from(count) << 32).checked_div(u64::from(counts_per_turn)).unwrap_or(0);
        let [low, _] = [turn & u64::from(u32::MAX), turn >> 32].map(u32::try_from);
        Self(low.unwrap_or(0))
    }

    /// Returns the angle in `rad`, from -π to below π.
    #[inline]
    #[must_use]
    pub fn to_rad(self) -> f32 {
        self.0.cast_signed() as f32 * (PI / HALF_TURN)
    }

    /// Returns the angle plus `angle_rad`, -π to π.
    #[inline]
    #[must_use]
    pub fn add_rad(self, angle_rad: f32) -> Self {
        Self(self.0.wrapping_add(Self::from_rad(angle_rad).0))
    }

    /// Returns the difference `self - other`.
    #[inline]
    #[must_use]
    pub fn wrapping_sub(self, other: Self) -> Self {
        Self(self.0.wrapping_sub(other.0))
    }

    /// Returns the electrical angle for a number of pole pairs.
    #[inline]
    #[must_use]
    pub fn to_electrical(self, pole_pairs: u8) -> Self {
        Self(self.0.wrapping_mul(u32::from(pole_pairs)))
    }

    /// Returns sine and cosine, absolute error below 2e-7.
    #[inline(always)]
    #[must_use]
    pub fn sin_cos(self) -> (f32, f32) {
        let quarter = self.0.wrapping_add(1 << 29) >> 30;
        let (sin, cos) = sin_cos_near_zero(Self(self.0.wrapping_sub(quarter << 30)).to_rad());
        match quarter & 3 {
            0 => (sin, cos),
            1 => (cos, -sin),
            2 => (-sin, -cos),
            _ => (-cos, sin),
        }
    }
}

/// Returns sine and cosine of an angle within ±π/4 `rad`.
///
/// Uses the polynomials of Moshier's Cephes library (`sinf`, `cosf`) in plain arithmetic: bit-identical on all
/// platforms and faster than a coprocessor including the transfers.
#[inline(always)]
pub(crate) fn sin_cos_near_zero(angle_rad: f32) -> (f32, f32) {
    let square = angle_rad * angle_rad;
    let sin = angle_rad
        + angle_rad * square * (-1.666_665_5e-1 + square * (8.332_161e-3 + square * -1.951_529_6e-4));
    let cos = 1.0 - 0.5 * square
        + square * square * (4.166_664_6e-2 + square * (-1.388_731_6e-3 + square * 2.443_315_7e-5));
    (sin, cos)
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;

    #[test]
    fn sine_and_cosine_are_exact_to_two_in_ten_million() {
        let mut worst = 0.0_f64;
        for step in 0..1_000_000_u32 {
            let angle = Angle(step.wrapping_mul(4_295 + 2));
            let (sin, cos) = angle.sin_cos();
            let (exact_sin, exact_cos) = (f64::from(angle.0) / f64::from(u32::MAX).mul_add(1.0, 1.0)
                * core::f64::consts::TAU)
                .sin_cos();
            worst = worst.max((f64::from(sin) - exact_sin).abs()).max((f64::from(cos) - exact_cos).abs());
        }
        assert!(worst < 2e-7, "{worst}");
    }

    #[test]
    fn angles_wrap_and_counts_are_shares_of_a_turn() {
        assert_eq!(Angle::from_counts(1024, 4096), Angle(1 << 30));
        assert_eq!(Angle::from_counts(4096 + 1024, 4096), Angle(1 << 30));
        assert_eq!(Angle::from_counts(3, 0), Angle(0));
        assert!(Angle(3 << 30).add_rad(PI).wrapping_sub(Angle(1 << 30)).to_rad().abs() < 1e-6);
        assert!((Angle(u32::MAX).to_electrical(7).to_rad()).abs() < 1e-7);
        for degrees in -179..180_i16 {
            let angle_rad = f32::from(degrees).to_radians();
            assert!((Angle::from_rad(angle_rad).to_rad() - angle_rad).abs() < 1e-6, "{degrees}");
        }
        assert_eq!(Angle::from_rad(f32::NAN), Angle(0));
    }
}
