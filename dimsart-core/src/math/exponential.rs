//! Exponential function, by the polynomial of Moshier's Cephes library in plain arithmetic.

use core::f32::consts::LOG2_E;

/// `e` to the power of `x`, relative error below 3e-7; `x` is limited to ±87, NaN stays NaN.
#[inline(never)]
#[must_use]
pub fn exp(x: f32) -> f32 {
    if x.is_nan() {
        return x;
    }
    let x = super::limit(x, 87.0);
    let scaled = x * LOG2_E;
    #[expect(clippy::cast_possible_truncation, reason = "within ±126")]
    let power = (scaled + if scaled < 0.0 { -0.5 } else { 0.5 }) as i16;
    let powers = f32::from(power);
    // ln 2 in two parts: multiples of the first part are exact.
    let rest = x - powers * 0.693_359_4 + powers * 2.121_944_4e-4;
    let series = ((((1.987_569_1e-4 * rest + 1.398_2e-3) * rest + 8.333_452e-3) * rest + 4.166_579_6e-2)
        * rest
        + 1.666_666_5e-1)
        * rest
        + 0.5;
    let fraction = series * rest * rest + rest + 1.0;
    fraction * f32::from_bits(u32::from((power + 127).unsigned_abs()) << 23)
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_power_is_exact_to_three_in_ten_million_and_held_where_there_is_no_number() {
        for step in -8700..=8700_i16 {
            let x = f32::from(step) * 0.01;
            let exact = f64::from(x).exp();
            let error = ((f64::from(super::exp(x)) - exact) / exact).abs();
            assert!(error < 3e-7, "{x}: {error}");
        }
        assert_eq!(super::exp(1e9).to_bits(), super::exp(87.0).to_bits());
        assert_eq!(super::exp(-1e9).to_bits(), super::exp(-87.0).to_bits());
        assert_eq!(super::exp(0.0).to_bits(), 1.0_f32.to_bits());
        assert!(super::exp(f32::NAN).is_nan());
    }
}
