//! Cascade of up to four second-order sections: any filter of up to eight poles.
//!
//! Each section is `y = (b0 + b1 z⁻¹ + b2 z⁻²) / (1 + a1 z⁻¹ + a2 z⁻²) x`, computed in transposed direct form II of the
//! delta operator `δ = z - 1` (Middleton & Goodwin, *Digital Control and Estimation*, chapter 13), which keeps its
//! precision for poles near 1: `y = b0 x + s1`, `δ s1 = (2 b0 + b1) x - (2 + a1) y + s2`,
//! `δ s2 = (b0 + b1 + b2) x - (1 + a1 + a2) y`. A row of `SOS` is a section in scipy's `output="sos"` order,
//! `b0 b1 b2 a0 a1 a2`. `a0` is 1; with 0, the section is skipped; any other value is refused.
//!
//! Each section starts in steady state for its first input; a section with a pole at 1 starts with zero state.
//! Coefficients are set one by one: to change a running filter, send them in one transaction.
//!
//! Coefficients are `f32`. Rounding `a1` and `a2` by half a digit changes the gain at 0 Hz by the relative error
//! `(d a1 + d a2) / (1 + a1 + a2)`. If the sum over all sections can exceed 1 %, the filter is refused with this
//! figure. For a corner below about a thousandth of the tick frequency, use `LOWPASS_MOD` or a larger `EVERY_TICKS`.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! // scipy.signal.butter(1, 0.5, output="sos")
//! let rows = "all BIQUAD_MOD SOS[0][0] 0.5
//!             all BIQUAD_MOD SOS[0][1] 0.5
//!             all BIQUAD_MOD SOS[0][3] 1
//!             all MOD_ENG MOD_ON BIQUAD_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::SIGNAL], rows)?;
//! let steps = [0.0, 1.0, 1.0].map(|x| bench.tick(&[x], "SIGNAL_OUT"));
//! assert_eq!(steps, [Some(0.0), Some(0.5), Some(1.0)]);
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use crate::filtered::FilterPorts;
use dimsart_core::{Context, Module, ParameterError, Unit, words};

/// Maximum error of the gain at 0 Hz due to rounded coefficients.
const MAX_ERROR_PERCENT: f32 = 1.0;

/// Maximum number of sections.
const SECTIONS: usize = 4;

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Sections, one per row: b0 b1 b2 a0 a1 a2; a0 is 1, or 0 to skip the section.
        sections: [[f32; 6]; SECTIONS] = matrix("SOS", Unit::One, -1e6..=1e6, 0.0),
    }
    /// State of one axis: two words per section.
    pub struct AxisState { sections: [[f32; 2]; SECTIONS] }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Biquad;

impl Module for Biquad {
    const NAME: &'static str = "BIQUAD_MOD";
    const SUMMARY: &'static str = "Filter of up to four second-order sections (scipy SOS format).";
    type Settings = Settings;
    type Gains = ();
    type State = ();
    type AxisState = AxisState;
    type Ports = FilterPorts;

    fn validate(settings: &Settings) -> Result<(), ParameterError> {
        let is_wrong = |[_, _, _, a0, _, _]: &[f32; 6]| a0 * (a0 - 1.0) != 0.0;
        if settings.sections.iter().any(is_wrong) {
            return Err(ParameterError::OutOfRange);
        }
        let percent = 100.0 * settings.sections.iter().map(gain_error).sum::<f32>();
        if percent > MAX_ERROR_PERCENT { Err(ParameterError::imprecise(percent)) } else { Ok(()) }
    }

    fn begin(context: &Context<'_, Self>) {
        let Settings { sections } = context.settings();
        context.begin_axes([context.ports().input], |(), [x]| {
            let mut axis = AxisState::default();
            let mut level = x;
            for ([b0, b1, b2, a0, a1, a2], memory) in sections.into_iter().zip(&mut axis.sections) {
                let Differences { b1, b2, a1, a2 } = Differences::of([b0, b1, b2, a1, a2]);
                let output = level * b2 / a2;
                if a0 > 0.0 && output.is_finite() {
                    *memory = [output - b0 * level, a1 * output - b1 * level];
                    level = output;
                }
            }
            axis
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let FilterPorts { input, output } = context.ports();
        let Settings { sections } = context.settings();
        context.map_axes([input], [output], |(), axis, [x]| {
            let mut x = x;
            for ([b0, b1, b2, a0, a1, a2], memory) in sections.into_iter().zip(&mut axis.sections) {
                if a0 > 0.0 {
                    let Differences { b1, b2, a1, a2 } = Differences::of([b0, b1, b2, a1, a2]);
                    let [s1, s2] = *memory;
                    let y = b0 * x + s1;
                    *memory = [s1 + (b1 * x - a1 * y + s2), s2 + (b2 * x - a2 * y)];
                    x = y;
                }
            }
            [x]
        });
    }
}

/// Coefficients of powers of `δ`; exact differences for poles near 1.
struct Differences {
    b1: f32,
    b2: f32,
    a1: f32,
    a2: f32,
}

impl Differences {
    #[inline(always)]
    fn of([b0, b1, b2, a1, a2]: [f32; 5]) -> Self {
        Self { b1: 2.0 * b0 + b1, b2: b0 + b1 + b2, a1: 2.0 + a1, a2: (2.0 + a1) + (a2 - 1.0) }
    }
}

/// Returns the relative error of a section's gain at 0 Hz if `a1` and `a2` are off by half of their last digit. Returns
/// 0 for a section with a pole at 1, without numerator, or with `a0` 0.
fn gain_error(&[b0, b1, b2, a0, a1, a2]: &[f32; 6]) -> f32 {
    let Differences { a2: sum, .. } = Differences::of([b0, b1, b2, a1, a2]);
    let last_digits = 0.5 * f32::EPSILON * (power_of_two(a1) + power_of_two(a2));
    if a0 == 0.0 || sum == 0.0 || b0 == 0.0 && b1 == 0.0 && b2 == 0.0 { 0.0 } else { last_digits / sum.abs() }
}

/// Returns the largest power of two up to `|x|`.
fn power_of_two(x: f32) -> f32 {
    f32::from_bits(x.to_bits() & 0x7F80_0000)
}
