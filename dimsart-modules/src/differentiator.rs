//! Differentiator: backward difference through a first-order low-pass.
//!
//! `y += (1 - p) ((x - x[k-1]) / h - y)`, `p = T/(T + h)` with the time constant `T` of the filter. The output starts
//! at zero. Its unit is the unit of the input per second; if that has no name, the output accepts any unit.

use dimsart_core::{
    Context, Declarations, DeviceDescriptor, Input, Module, Output, PortSet, Unit, UnitRelation, types, words,
};

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Time constant of the low-pass; 0: no filter.
        filter_time_s: f32 = real("FILTER_TIME", Unit::Second, 0.0..=10.0, 0.0),
        rate_hz: f32,
        smoothing: f32,
    }
    /// State of one axis.
    pub struct AxisState { previous: f32, slope: f32 }
    /// Ports.
    pub ports Ports {
        input: Input = input("SIGNAL_IN", types::SIGNAL),
        output: Output = output("SIGNAL_OUT", types::SIGNAL_OUT),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Differentiator;

impl Module for Differentiator {
    const NAME: &'static str = "DIFFERENTIATOR_MOD";
    const SUMMARY: &'static str = "Time derivative of a signal, with a low-pass.";
    type Settings = Settings;
    type Gains = ();
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        let h = device.sample_period_s();
        settings.rate_hz = 1.0 / h;
        settings.smoothing = h / (h + settings.filter_time_s);
    }

    fn ports(_: &Settings, declare: &mut Declarations<'_>) -> Ports {
        let ports = Ports::declare(declare);
        declare.constrain_unit("SIGNAL_OUT", UnitRelation::Derivative, "SIGNAL_IN");
        ports
    }

    fn begin(context: &Context<'_, Self>) {
        context.begin_axes([context.ports().input], |(), [x]| AxisState { previous: x, slope: 0.0 });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { input, output } = context.ports();
        let Settings { rate_hz, smoothing, .. } = context.settings();
        context.map_axes([input], [output], |(), axis, [x]| {
            let previous = axis.previous;
            axis.previous = x;
            axis.slope += smoothing * ((x - previous) * rate_hz - axis.slope);
            [axis.slope]
        });
    }
}
