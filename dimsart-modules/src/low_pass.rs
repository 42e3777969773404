//! Low-pass filter of first or second order for a signal of any unit.
//!
//! | `ORDER` | Law, with `ω = 2 pi FREQUENCY` |
//! |---|---|
//! | `FIRST` | `1 / (1 + s/ω)` with its exact pole: `y += (1 - exp(-ω h)) (x - y)` |
//! | `SECOND` | `ω² / (s² + 2 DAMPING ω s + ω²)` by Tustin's rule, prewarped at `ω` |
//!
//! Åström & Wittenmark, *Computer-Controlled Systems*, sections 2.3 and 8.2. Initial state: steady state for the first
//! input; on takeover, for the last output. `SECOND` clamps its frequency to 0.49 of the module's rate; `dimsart check`
//! refuses a higher one.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all LOWPASS_MOD FREQUENCY 15.915494
//!             all MOD_ENG MOD_ON LOWPASS_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::SIGNAL], rows)?;
//! assert_eq!(bench.tick(&[1.0], "SIGNAL_OUT"), Some(1.0));
//! // A step to 2 with a time constant of 10 ms: 1/e remains after 10 ticks.
//! let last = (0..10).filter_map(|_| bench.tick(&[2.0], "SIGNAL_OUT")).last().unwrap_or_default();
//! assert!((2.0 - last - 0.3679).abs() < 1e-4, "{last}");
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use core::f32::consts::{FRAC_1_SQRT_2, TAU};

use crate::filtered::FilterPorts;
use crate::lag;
use crate::state_variable::{Coefficients, Integrators, warped};
use crate::take_over::first;
use dimsart_core::math::CompensatedSum;
use dimsart_core::{Context, DeviceDescriptor, Module, ParameterSet, Parameters, Unit, choice, words};

choice! {
    /// Order of the filter.
    pub enum Order { First = "FIRST", Second = "SECOND" }
}

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Order of the filter.
        order: Order = choice("ORDER"),
    }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Corner frequency.
        frequency_hz: f32 = per_axis("FREQUENCY", Unit::Hertz, 1e-3..=1e5, 100.0),
        /// Damping ratio of SECOND; 1 is critical.
        damping: f32 = per_axis("DAMPING", Unit::One, 0.01..=100.0, FRAC_1_SQRT_2),
        /// `1 - exp(-ω h)`.
        share: f32,
        coefficients: Coefficients,
    }
    /// State of one axis.
    pub struct AxisState { first: CompensatedSum, second: Integrators }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct LowPass;

impl Module for LowPass {
    const NAME: &'static str = "LOWPASS_MOD";
    const SUMMARY: &'static str = "Low-pass filter of first or second order.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = FilterPorts;

    fn parameters(settings: &mut Settings, gains: &mut Gains, visit: &mut Parameters<'_>) {
        settings.visit(visit);
        gains.visit(visit);
    }

    fn prepare_axis(_: &Settings, gains: &mut Gains, device: &DeviceDescriptor) {
        let h = device.sample_period_s();
        gains.share = lag::share(TAU * gains.frequency_hz * h);
        gains.coefficients = Coefficients::new(warped(gains.frequency_hz, h), 2.0 * gains.damping);
    }

    fn begin(context: &Context<'_, Self>) {
        let FilterPorts { input, output } = context.ports();
        let takes_over = context.takes_over();
        context.begin_axes([input, output.last()], |_, [x, last]| {
            let level = first(takes_over, last, x);
            AxisState { first: CompensatedSum::new(level), second: Integrators::at_rest(level) }
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let FilterPorts { input, output } = context.ports();
        let Settings { order } = context.settings();
        context.map_axes([input], [output], |gains, axis, [x]| match order {
            Order::First => [axis.first.add(gains.share * (x - axis.first.value()))],
            Order::Second => [axis.second.step(gains.coefficients, x).1],
        });
    }
}
