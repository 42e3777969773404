//! Notch filter for a signal of any unit, for example against a joint's resonance.
//!
//! `(s² + ω²) / (s² + (ω/Q) s + ω²)` by Tustin's rule, prewarped at `ω = 2 pi FREQUENCY`. The width between the -3 dB
//! frequencies, `FREQUENCY / QUALITY`, is prewarped too (Orfanidis, *Introduction to Signal Processing*, section 11.3;
//! the same design as `scipy.signal.iirnotch`). It is computed as `y = x - k b`, where `b` is the band-pass output of a
//! state-variable filter and `k = tan(ω h / 2Q) (1 + g²) / g`, `g = tan(ω h / 2)`.
//!
//! Initial state: steady state for the first input. The frequency is clamped to 0.49 of the module's rate;
//! `dimsart check` refuses a higher one.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all NOTCH_MOD FREQUENCY 250
//!             all MOD_ENG MOD_ON NOTCH_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::SIGNAL], rows)?;
//! // A quarter of 1 kHz: 1, 0, -1, 0. It is rejected after the transient.
//! let wave = [1.0, 0.0, -1.0, 0.0].into_iter().cycle().take(400);
//! let last = wave.filter_map(|x| bench.tick(&[x], "SIGNAL_OUT")).last().unwrap_or(1.0);
//! assert!(last.abs() < 1e-5, "{last}");
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use crate::filtered::FilterPorts;
use crate::state_variable::{Coefficients, Integrators, warped};
use dimsart_core::{Context, DeviceDescriptor, Module, Unit, words};

words! {
    /// Parameters of one axis.
    pub parameters Gains {
        /// Frequency to reject.
        frequency_hz: f32 = per_axis("FREQUENCY", Unit::Hertz, 1e-3..=1e5, 50.0),
        /// Quality factor: FREQUENCY divided by the -3 dB width.
        quality: f32 = per_axis("QUALITY", Unit::One, 1.0..=1000.0, 10.0),
        k: f32,
        coefficients: Coefficients,
    }
    /// State of one axis.
    pub struct AxisState { integrators: Integrators }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Notch;

impl Module for Notch {
    const NAME: &'static str = "NOTCH_MOD";
    const SUMMARY: &'static str = "Notch filter: rejects one frequency.";
    type Settings = ();
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = FilterPorts;

    fn prepare_axis(_: &(), gains: &mut Gains, device: &DeviceDescriptor) {
        let h = device.sample_period_s();
        let g = warped(gains.frequency_hz, h);
        gains.k = warped(gains.frequency_hz / gains.quality, h) * (1.0 + g * g) / g;
        gains.coefficients = Coefficients::new(g, gains.k);
    }

    fn begin(context: &Context<'_, Self>) {
        context
            .begin_axes([context.ports().input], |_, [x]| AxisState { integrators: Integrators::at_rest(x) });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let FilterPorts { input, output } = context.ports();
        context.map_axes([input], [output], |gains, axis, [x]| {
            let (band, _) = axis.integrators.step(gains.coefficients, x);
            [x - gains.k * band]
        });
    }
}
