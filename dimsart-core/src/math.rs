//! Mathematical functions with identical results on every target.
//!
//! They use `micromath` where it is accurate enough or can be refined, otherwise polynomials in plain IEEE
//! 754 arithmetic.

mod exponential;
mod trigonometry;

pub use exponential::exp;
pub use trigonometry::{atan2, cos, sin, sin_cos, tan};

use micromath::F32Ext;

/// Square root, relative error below 2e-7; 0 for negative input, NaN for NaN.
///
/// Three Newton steps refine micromath's estimate (6 % error).
#[must_use]
pub fn sqrt(x: f32) -> f32 {
    if x <= 0.0 || x == f32::INFINITY {
        return x.max(0.0);
    }
    let mut root = F32Ext::sqrt(x);
    for _ in 0..3 {
        root = 0.5 * (root + x / root);
    }
    root
}

/// Minimum of two numbers; `b` if either is NaN. `f32::min` leaves the sign of zero to the target.
#[inline(always)]
#[must_use]
pub fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Maximum of two numbers; `b` if either is NaN.
#[inline(always)]
#[must_use]
pub fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Limits `x` to at least `low`, then to at most `high`; NaN stays NaN.
#[inline(always)]
#[must_use]
pub fn clamp(x: f32, low: f32, high: f32) -> f32 {
    let x = if x < low { low } else { x };
    if x > high { high } else { x }
}

/// Fractional part of `x`, which is at least 0. Exact: `x % 1.0` with a tenth of the code.
#[must_use]
pub fn fraction(x: f32) -> f32 {
    // From this value on, every `f32` is a whole number.
    const ALL_WHOLE: f32 = 8_388_608.0;
    if x < ALL_WHOLE { x - F32Ext::trunc(x) } else { 0.0 }
}

/// Limits `x` to `±limit`, `limit` at least 0; NaN stays NaN. `f32::clamp` would panic on invalid bounds.
#[inline]
#[must_use]
pub fn limit(x: f32, limit: f32) -> f32 {
    if x > limit {
        limit
    } else if x < -limit {
        -limit
    } else {
        x
    }
}

crate::words! {
    /// Kahan sum: compensates the rounding errors.
    pub struct CompensatedSum { sum: f32, lost: f32 }
}

impl CompensatedSum {
    /// Creates a sum that starts at `value`.
    #[must_use]
    pub const fn new(value: f32) -> Self {
        Self { sum: value, lost: 0.0 }
    }

    /// Returns the sum.
    #[must_use]
    pub const fn value(&self) -> f32 {
        self.sum
    }

    /// Adds a fraction of a turn and subtracts a completed turn, which is exact.
    #[inline(always)]
    pub fn add_wrapped(&mut self, share: f32) {
        if self.add(share) >= 1.0 {
            self.sum -= 1.0;
        }
    }

    /// Adds a step and limits the sum to `most`.
    #[inline(always)]
    pub fn add_clamped(&mut self, step: f32, most: f32) {
        if self.add(step) > most {
            *self = Self::new(most);
        }
    }

    /// Moves towards a value, by at most `most`.
    #[inline(always)]
    pub fn move_towards(&mut self, value: f32, most: f32) {
        let change = value - self.sum;
        // Exact on arrival: adding the step would round.
        if change.abs() <= most {
            *self = Self::new(value);
        } else {
            self.add(limit(change, most));
        }
    }

    /// Adds a step and returns the sum.
    pub fn add(&mut self, step: f32) -> f32 {
        let step = step - self.lost;
        let sum = self.sum + step;
        self.lost = (sum - self.sum) - step;
        self.sum = sum;
        sum
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_compensated_sum_of_a_million_small_steps_is_exact() {
        let mut sum = super::CompensatedSum::new(100.0);
        (0..1_000_000).for_each(|_| {
            sum.add(1.0e-6);
        });
        assert!((f64::from(sum.value()) - 101.0).abs() < 1.0e-5, "{}", sum.value());
    }

    #[test]
    fn a_limit_holds_both_ways_and_lets_nan_through() {
        let limited = [-3.0, -1.0, 0.5, 3.0].map(|x| super::limit(x, 1.0).to_bits());
        assert_eq!(limited, [-1.0_f32, -1.0, 0.5, 1.0].map(f32::to_bits));
        assert!(super::limit(f32::NAN, 1.0).is_nan());
    }

    #[test]
    fn a_fraction_is_what_the_remainder_by_one_is_bit_by_bit() {
        let mut x = 1.0e-30_f32;
        while x < f32::MAX {
            assert_eq!(super::fraction(x).to_bits(), (x % 1.0).to_bits(), "{x}");
            x *= 1.000_7;
        }
        assert_eq!(super::fraction(f32::MAX).to_bits(), 0.0_f32.to_bits());
        assert_eq!(super::fraction(0.0).to_bits(), 0.0_f32.to_bits());
    }

    #[test]
    fn sqrt_is_good_to_two_ulp_over_all_magnitudes() {
        let mut x = 1.0e-30_f32;
        while x < 1.0e30 {
            let exact = f64::from(x).sqrt();
            let error = (f64::from(super::sqrt(x)) - exact) / exact;
            assert!(error.abs() < 2.0e-7, "sqrt({x}) off by {error}");
            x *= 1.37;
        }
        assert_eq!(super::sqrt(-1.0).to_bits(), 0.0_f32.to_bits());
        assert!(super::sqrt(f32::NAN).is_nan());
    }
}
