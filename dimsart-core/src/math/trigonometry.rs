//! Sine, cosine, tangent and arctangent, by the polynomials of Moshier's Cephes library in plain arithmetic.

use core::f32::consts::{FRAC_2_PI, FRAC_PI_2, FRAC_PI_4, PI};

/// A quarter turn in three parts: multiples of the first two are exact.
const QUARTER_RAD: [f32; 3] = [1.570_312_5, 4.837_513e-4, 7.549_79e-8];
/// Tangents of 1/16 and 3/16 of a turn, the limits of the arctangent's middle range.
const TAN_PI_8: f32 = 0.414_213_56;
const TAN_3_PI_8: f32 = 2.414_213_6;

/// Sine and cosine of `x` in `rad`; absolute error below 2e-7 within ±8000 rad, more beyond. NaN for NaN and
/// infinity.
#[inline(never)]
#[must_use]
pub fn sin_cos(x: f32) -> (f32, f32) {
    let [high, middle, low] = QUARTER_RAD;
    let scaled = x * FRAC_2_PI;
    #[expect(clippy::cast_possible_truncation, reason = "a cast saturates")]
    let quarter = (scaled + if scaled < 0.0 { -0.5 } else { 0.5 }) as i32;
    #[expect(clippy::cast_precision_loss, reason = "exact where the result is")]
    let quarters = quarter as f32;
    let rest = ((x - quarters * high) - quarters * middle) - quarters * low;
    let square = rest * rest;
    let sin = rest + rest * square * (-1.666_665_5e-1 + square * (8.332_161e-3 + square * -1.951_529_6e-4));
    let cos = 1.0 - 0.5 * square
        + square * square * (4.166_664_6e-2 + square * (-1.388_731_6e-3 + square * 2.443_315_7e-5));
    match quarter & 3 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// Sine of `x` in `rad`; see [`sin_cos`].
#[must_use]
pub fn sin(x: f32) -> f32 {
    sin_cos(x).0
}

/// Cosine of `x` in `rad`; see [`sin_cos`].
#[must_use]
pub fn cos(x: f32) -> f32 {
    sin_cos(x).1
}

/// Tangent of `x` in `rad`; relative error below 5e-7 away from its zeros and poles.
#[must_use]
pub fn tan(x: f32) -> f32 {
    let (sin, cos) = sin_cos(x);
    sin / cos
}

/// Angle of the point (`x`, `y`) from the x axis, `-π` to `π` rad; absolute error below 4e-7, 0 at the
/// origin.
#[inline(never)]
#[must_use]
pub fn atan2(y: f32, x: f32) -> f32 {
    let (width, height) = (x.abs(), y.abs());
    if width == 0.0 && height == 0.0 {
        return 0.0;
    }
    // Half of height and width avoids an overflow of the tangent in the middle range.
    let (angle_rad, tangent) = if height > TAN_3_PI_8 * width {
        (FRAC_PI_2, -width / height)
    } else if height > TAN_PI_8 * width {
        (FRAC_PI_4, (height - width) / (height + width))
    } else {
        (0.0, height / width)
    };
    let square = tangent * tangent;
    let series =
        ((8.053_744_5e-2 * square - 1.387_768_6e-1) * square + 1.997_771_1e-1) * square - 3.333_295e-1;
    let angle_rad = angle_rad + (series * square * tangent + tangent);
    let angle_rad = if x < 0.0 { PI - angle_rad } else { angle_rad };
    if y < 0.0 { -angle_rad } else { angle_rad }
}

#[cfg(test)]
mod tests {
    #[test]
    fn sine_and_cosine_are_exact_to_two_in_ten_million() {
        for step in -400_000_i32..400_000 {
            let x = step as f32 * 0.02 + 1e-4;
            let ((sin, cos), (exact_sin, exact_cos)) = (super::sin_cos(x), f64::from(x).sin_cos());
            let error = (f64::from(sin) - exact_sin).abs().max((f64::from(cos) - exact_cos).abs());
            assert!(error < 2e-7, "{x}: {error}");
        }
        assert!(super::sin(f32::INFINITY).is_nan() && super::cos(f32::NAN).is_nan());
    }

    #[test]
    fn the_angle_of_a_point_is_exact_in_every_quadrant_and_at_every_distance() {
        for distance in [1e-30_f32, 1e-3, 1.0, 1e15] {
            for step in -10_000_i32..=10_000 {
                let (y, x) = (step as f32 * 3.14e-4).sin_cos();
                let (y, x) = (distance * y, distance * x);
                let error = (f64::from(super::atan2(y, x)) - f64::from(y).atan2(f64::from(x))).abs();
                assert!(error < 4e-7, "{y} {x}: {error}");
            }
        }
        let angles = [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (-1.0, 0.0)].map(|(y, x)| super::atan2(y, x));
        let quarter = core::f32::consts::FRAC_PI_2;
        assert_eq!(angles.map(f32::to_bits), [0.0, 0.0, quarter, -quarter].map(f32::to_bits));
        assert!(super::atan2(f32::NAN, 1.0).is_nan());
    }

    #[test]
    fn the_tangent_is_good_to_five_in_ten_million() {
        for step in 1..1500_u16 {
            let x = f32::from(step) * 1e-3;
            let exact = f64::from(x).tan();
            let error = ((f64::from(super::tan(x)) - exact) / exact).abs();
            assert!(error < 5e-7 / (1.6 - f64::from(x)), "{x}: {error}");
        }
    }
}
