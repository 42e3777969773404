//! Helper of first-order lags.

use dimsart_core::math;

/// Returns `1 - exp(-x)`: the share of a step that a first-order lag completes in `x >= 0` time constants. The relative
/// error is below 1e-6, also for small `x`, where the difference would cancel.
pub(super) fn share(x: f32) -> f32 {
    if x > 0.25 {
        return 1.0 - math::exp(-x);
    }
    x * (1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0 * (1.0 - x / 6.0)))))
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_share_is_exact_to_a_millionth_of_itself() {
        let mut x = 1e-9_f32;
        while x < 50.0 {
            let exact = -(-f64::from(x)).exp_m1();
            let error = (f64::from(super::share(x)) - exact) / exact;
            assert!(error.abs() < 1e-6, "{x}: {error}");
            x *= 1.1;
        }
    }
}
