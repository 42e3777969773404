//! Any filter of up to eight poles: up to four sections of second order, one behind the other.
//!
//! Of each section `y = (b0 + b1 z⁻¹ + b2 z⁻²) / (1 + a1 z⁻¹ + a2 z⁻²) x`, in the transposed direct form II of the difference
//! `δ = z - 1` (Middleton & Goodwin, *Digital Control and Estimation*, chapter 13), in which poles near 1 lose no digits:
//! `y = b0 x + s1`, `δ s1 = (2 b0 + b1) x - (2 + a1) y + s2`, `δ s2 = (b0 + b1 + b2) x - (1 + a1 + a2) y`. A row of `SOS` is a section as scipy's `output="sos"` gives it, `b0 b1 b2 a0 a1 a2`, and as there `a0` is 1;
//! no other value is taken but 0, which leaves the section out.
//!
//! Every section begins as if the first input had been the same for ever; with no memory where that would not end, for a
//! pole at 1. The entries come one by one: change those of a filter that runs in one transaction.
//!
//! Coefficients are `f32`, and half of the last digit of `a1` and `a2` changes the gain at 0 Hz by
//! `(d a1 + d a2) / (1 + a1 + a2)` of itself. Where the sections together may be off by more than 1 %, they are refused with
//! the figure: a corner below about a thousandth of the ticks' frequency is `LOWPASS_MOD`'s, or that of a filter with a
//! larger `EVERY_TICKS`.
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

use crate::filtered::Filtered;
use dimsart_core::{Context, Module, ParameterError, Unit, words};

/// Most that the gain at 0 Hz may be off by rounded coefficients.
const MOST_ERROR_PERCENT: f32 = 1.0;

/// Most sections.
const SECTIONS: usize = 4;

words! {
    /// Of all axes.
    pub parameters Settings {
        /// Sections, a row each: b0 b1 b2 a0 a1 a2; a0 is 1, or 0 for none.
        sections: [[f32; 6]; SECTIONS] = matrix("SOS", Unit::One, -1e6..=1e6, 0.0),
    }
    /// Of an axis: of each section.
    pub struct Axis { sections: [[f32; 2]; SECTIONS] }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Biquad;

impl Module for Biquad {
    const NAME: &'static str = "BIQUAD_MOD";
    const SUMMARY: &'static str = "Filter of up to four sections of second order, as scipy designs them.";
    type Settings = Settings;
    type Gains = ();
    type State = ();
    type Axis = Axis;
    type Ports = Filtered;

    fn validate(settings: &Settings) -> Result<(), ParameterError> {
        let is_wrong = |[_, _, _, a0, _, _]: &[f32; 6]| a0 * (a0 - 1.0) != 0.0;
        if settings.sections.iter().any(is_wrong) {
            return Err(ParameterError::OutOfRange);
        }
        let percent = 100.0 * settings.sections.iter().map(gain_error).sum::<f32>();
        if percent > MOST_ERROR_PERCENT { Err(ParameterError::imprecise(percent)) } else { Ok(()) }
    }

    fn begin(context: &Context<'_, Self>) {
        let Settings { sections } = context.settings();
        context.begin_axes([context.ports().input], |(), [x]| {
            let mut axis = Axis::default();
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
        let Filtered { input, output } = context.ports();
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

/// Coefficients of powers of `δ`. Those of poles near 1 are exact differences.
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

/// By how much of itself the gain of a section at 0 Hz is off where `a1` and `a2` are by half of their last digit. One with a
/// pole at 1 has no gain there, and one that is still to get its last coefficient none that matters.
fn gain_error(&[b0, b1, b2, a0, a1, a2]: &[f32; 6]) -> f32 {
    let Differences { a2: sum, .. } = Differences::of([b0, b1, b2, a1, a2]);
    let last_digits = 0.5 * f32::EPSILON * (power_of_two(a1) + power_of_two(a2));
    if a0 == 0.0 || sum == 0.0 || b0 == 0.0 && b1 == 0.0 && b2 == 0.0 { 0.0 } else { last_digits / sum.abs() }
}

/// The largest power of two that a number reaches.
fn power_of_two(x: f32) -> f32 {
    f32::from_bits(x.to_bits() & 0x7F80_0000)
}
