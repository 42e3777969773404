//! A second-order filter that keeps its accuracy at low frequencies: the state-variable filter by the trapezoidal rule.
//!
//! Of `s² + k ω s + ω²` by Tustin's rule, prewarped at `ω`: `g = tan(ω h/2)`. Its state is that of two integrators, so that
//! the gain at 0 Hz is exactly 1, where the coefficients of a direct form lose their digits (Zavalishin, *The Art of VA
//! Filter Design*, chapter 4).

use core::f32::consts::PI;

use crate::{math, words};

words! {
    /// Coefficients of a tick.
    pub(super) struct Coefficients { a1: f32, a2: f32, a3: f32 }
    /// State of the integrators.
    pub(super) struct Integrators { band: f32, low: f32 }
}

/// Tangent of half the angle of a frequency in a tick; of the highest frequency that Tustin's rule has, 0.49 of the ticks'
/// frequency, where it is more.
pub(super) fn warped(frequency_hz: f32, period_s: f32) -> f32 {
    math::tan(PI * (frequency_hz * period_s).min(0.49))
}

impl Coefficients {
    /// With the tangent `g` and `k`, twice the damping.
    pub(super) fn new(g: f32, k: f32) -> Self {
        let a1 = 1.0 / (1.0 + g * (g + k));
        Self { a1, a2: g * a1, a3: g * g * a1 }
    }
}

impl Integrators {
    /// As an input leaves them that has been the same for ever.
    pub(super) fn at_rest(level: f32) -> Self {
        Self { band: 0.0, low: level }
    }

    /// What passes the band-pass `ω s / (s² + k ω s + ω²)` and the low-pass `ω² / (s² + k ω s + ω²)` in this tick.
    #[inline(always)]
    pub(super) fn step(&mut self, Coefficients { a1, a2, a3 }: Coefficients, x: f32) -> (f32, f32) {
        let beyond = x - self.low;
        let band = a1 * self.band + a2 * beyond;
        let low = self.low + (a2 * self.band + a3 * beyond);
        *self = Self { band: 2.0 * band - self.band, low: 2.0 * low - self.low };
        (band, low)
    }
}
