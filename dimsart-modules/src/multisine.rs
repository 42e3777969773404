//! Multisine: a sum of tones at multiples of a base frequency with Schroeder phases, which keep the crest factor low.
//!
//! `out = OFFSET + A Σ cos(2 π n p + φ_n)`, `φ_n = -π n (n - 1) / N`, `n = 1 … N`; `p = FREQUENCY t` in periods
//! (Schroeder, *IEEE Trans. Information Theory* 16(1), 1970). `A` is the amplitude of each tone. Each tone is computed
//! from the one before by a rotation: from `n` to `n + 1` by `2 π (p - n / N)`.
//!
//! Tones at or above half the sample rate alias. The signal starts with a step to the value given by the phases: use it
//! to excite a force, not a position.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all MULTISINE_MOD AMPLITUDE 1\nall MULTISINE_MOD TONES 1
//!             all MOD_ENG MOD_ON MULTISINE_MOD\nall MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION], rows)?;
//! assert_eq!(bench.tick(&[0.0], "SIGNAL_OUT"), Some(1.0));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use core::f32::consts::TAU;

use dimsart_core::{Context, DeviceDescriptor, Module, Output, Unit, math, types, words};

/// Maximum number of tones.
const TONES: u32 = 32;

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Base frequency: frequency of the first tone.
        frequency_hz: f32 = real("FREQUENCY", Unit::Hertz, 1e-4..=1e4, 1.0),
        /// Number of tones.
        tones: u32 = count("TONES", Unit::One, 1..=TONES, 10),
        periods_per_tick: f32,
        /// Cosine and sine of `2 π / N`.
        turn: [f32; 2],
    }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Amplitude of each tone.
        amplitude: f32 = per_axis("AMPLITUDE", Unit::Any, -1e6..=1e6, 0.0),
        /// Offset added to the signal.
        offset: f32 = per_axis("OFFSET", Unit::Any, -1e6..=1e6, 0.0),
    }
    /// State common to all axes.
    pub struct State { periods: math::CompensatedSum }
    /// Ports.
    pub ports Ports { output: Output = output("SIGNAL_OUT", types::SIGNAL_OUT) }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Multisine;

impl Module for Multisine {
    const NAME: &'static str = "MULTISINE_MOD";
    const SUMMARY: &'static str = "Generates a multisine: a sum of tones with a low crest factor.";
    type Settings = Settings;
    type Gains = Gains;
    type State = State;
    type AxisState = ();
    type Ports = Ports;

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.periods_per_tick = math::fraction(settings.frequency_hz * device.sample_period_s());
        #[expect(clippy::cast_precision_loss, reason = "at most 32")]
        let (sine, cosine) = math::sin_cos(TAU / settings.tones as f32);
        settings.turn = [cosine, sine];
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Settings { tones, periods_per_tick, turn: [cosine, sine], .. } = context.settings();
        let State { mut periods } = context.state();
        let (first_sine, first_cosine) = math::sin_cos(TAU * periods.value());
        let back = [cosine, -sine];
        let mut tone = [first_cosine, first_sine];
        let mut step = times(tone, back);
        let mut sum = 0.0;
        for number in 0..TONES {
            sum += if number < tones { tone[0] } else { 0.0 };
            tone = times(tone, step);
            step = times(step, back);
        }
        context.map_axes([], [context.ports().output], |Gains { amplitude, offset }, (), []| {
            [offset + amplitude * sum]
        });
        periods.add_wrapped(periods_per_tick);
        context.set_state(State { periods });
    }
}

/// Returns the product of two complex numbers.
#[inline(always)]
fn times([a, b]: [f32; 2], [c, d]: [f32; 2]) -> [f32; 2] {
    [a * c - b * d, a * d + b * c]
}
