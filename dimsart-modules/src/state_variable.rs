//! State-variable filter by the trapezoidal rule: a second-order filter that keeps its precision at low frequencies.
//!
//! Discretises `s² + k ω s + ω²` by Tustin's rule, prewarped at `ω`: `g = tan(ω h/2)`. The state is that of two
//! integrators, so the gain at 0 Hz is exactly 1, where the coefficients of a direct form lose precision; the slower
//! integrator is a compensated sum (Zavalishin, *The Art of VA Filter Design*, chapter 4).

use core::f32::consts::PI;

use dimsart_core::math::{self, CompensatedSum};
use dimsart_core::words;

words! {
    /// Coefficients of a tick.
    pub(super) struct Coefficients { loss: f32, gain: f32, double_gain: f32 }
    /// State of the integrators.
    pub(super) struct Integrators { band: f32, low: CompensatedSum }
}

/// Returns `tan(ω h/2)`, the prewarped frequency, clamped to 0.49 of the tick rate.
pub(super) fn warped(frequency_hz: f32, period_s: f32) -> f32 {
    math::tan(PI * (frequency_hz * period_s).min(0.49))
}

impl Coefficients {
    /// Computes the coefficients from `g` and `k`, twice the damping ratio.
    pub(super) fn new(g: f32, k: f32) -> Self {
        let share = 1.0 / (1.0 + g * (g + k));
        Self { loss: g * (g + k) * share, gain: g * share, double_gain: g * g * share }
    }
}

impl Integrators {
    /// Returns the steady state for a constant input.
    pub(super) fn at_rest(level: f32) -> Self {
        Self { band: 0.0, low: CompensatedSum::new(level) }
    }

    /// Returns the outputs of the band-pass `ω s / (s² + k ω s + ω²)` and the low-pass `ω² / (s² + k ω s + ω²)`: the
    /// mean of the integrators before and after this tick.
    #[inline(always)]
    pub(super) fn step(&mut self, coefficients: Coefficients, x: f32) -> (f32, f32) {
        let Coefficients { loss, gain, double_gain } = coefficients;
        let Self { band, low } = *self;
        let low = low.value();
        let band_step = gain * (x - low) - loss * band;
        let low_step = gain * band + double_gain * (x - low);
        self.band += 2.0 * band_step;
        self.low.add(2.0 * low_step);
        (band + band_step, low + low_step)
    }
}
