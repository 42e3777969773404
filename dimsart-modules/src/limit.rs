//! Limiter for the value and the rate of change of a signal of any unit.
//!
//! `out += limit(clamp(in, LOW, HIGH) - out, RATE h)`, summed without rounding loss. If `LOW` is above `HIGH`, `HIGH`
//! applies.
//!
//! Initial state: the first input, clamped; on takeover, the last command, so that a step between modules becomes a
//! ramp.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all LIMIT_MOD HIGH 2\nall LIMIT_MOD RATE 1000
//!             all MOD_ENG MOD_ON LIMIT_MOD\nall MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::SIGNAL], rows)?;
//! assert_eq!([0.0, 5.0, 5.0, 5.0].map(|x| bench.tick(&[x], "SIGNAL_OUT")), [0.0, 1.0, 2.0, 2.0].map(Some));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use crate::filtered::FilterPorts;
use crate::take_over::first;
use dimsart_core::math::{self, CompensatedSum};
use dimsart_core::{Context, DeviceDescriptor, Module, Unit, words};

words! {
    /// Parameters of one axis.
    pub parameters Gains {
        /// Minimum output.
        low: f32 = per_axis("LOW", Unit::Any, -1e9..=1e9, -1e9),
        /// Maximum output.
        high: f32 = per_axis("HIGH", Unit::Any, -1e9..=1e9, 1e9),
        /// Maximum rate of change per second, in either direction.
        rate: f32 = per_axis("RATE", Unit::Any, 0.0..=1e15, 1e15),
        /// `RATE h`.
        step: f32,
    }
    /// State of one axis.
    pub struct AxisState { output: CompensatedSum }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Limit;

impl Module for Limit {
    const NAME: &'static str = "LIMIT_MOD";
    const SUMMARY: &'static str = "Limits the value and rate of change of a signal.";
    type Settings = ();
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = FilterPorts;

    fn prepare_axis((): &(), gains: &mut Gains, device: &DeviceDescriptor) {
        gains.step = gains.rate * device.sample_period_s();
    }

    fn begin(context: &Context<'_, Self>) {
        let FilterPorts { input, output } = context.ports();
        let takes_over = context.takes_over();
        context.begin_axes([input, output.last()], |gains, [x, last]| AxisState {
            output: CompensatedSum::new(first(takes_over, last, math::clamp(x, gains.low, gains.high))),
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let FilterPorts { input, output } = context.ports();
        context.map_axes([input], [output], |gains, axis, [x]| {
            let wanted = math::clamp(x, gains.low, gains.high);
            axis.output.move_towards(wanted, gains.step);
            [axis.output.value()]
        });
    }
}
