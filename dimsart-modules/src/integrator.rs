//! Integrator by the trapezoidal rule.
//!
//! `y += h (x + x[k-1]) / 2`, limited to `±LIMIT`; `x[-1] = 0`. The sum is compensated (Kahan). The unit of the output
//! is the unit of the input times seconds; if that has no name, the output accepts any unit.

use dimsart_core::math::{self, CompensatedSum};
use dimsart_core::{
    Context, Declarations, DeviceDescriptor, Input, Module, Output, PortSet, Unit, UnitRelation, types, words,
};

words! {
    /// Parameters common to all axes.
    pub parameters Settings { half_period_s: f32 }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Maximum output, in either direction.
        limit: f32 = per_axis("LIMIT", Unit::Any, 0.0..=1e9, 1e9),
    }
    /// State of one axis.
    pub struct AxisState { previous: f32, sum: CompensatedSum }
    /// Ports.
    pub ports Ports {
        input: Input = input("SIGNAL_IN", types::SIGNAL),
        output: Output = output("SIGNAL_OUT", types::SIGNAL_OUT),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Integrator;

impl Module for Integrator {
    const NAME: &'static str = "INTEGRATOR_MOD";
    const SUMMARY: &'static str = "Integrates a signal over time.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.half_period_s = 0.5 * device.sample_period_s();
    }

    fn ports(_: &Settings, declare: &mut Declarations<'_>) -> Ports {
        let ports = Ports::declare(declare);
        declare.constrain_unit("SIGNAL_OUT", UnitRelation::Integral, "SIGNAL_IN");
        ports
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { input, output } = context.ports();
        let Settings { half_period_s } = context.settings();
        context.map_axes([input], [output], |Gains { limit }, axis, [x]| {
            let sum = axis.sum.add(half_period_s * (x + axis.previous));
            axis.previous = x;
            if sum.abs() > limit {
                axis.sum = CompensatedSum::new(math::limit(sum, limit));
            }
            [axis.sum.value()]
        });
    }
}
