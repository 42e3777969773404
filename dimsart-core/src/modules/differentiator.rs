//! Differentiator: backward difference through a first-order low-pass.
//!
//! `y += (1 - p) ((x - x[k-1]) / h - y)`, `p = T/(T + h)` with the filter's time constant `T`;
//! the first output is 0. Its unit is the input's over `s`; where that has no name, the output is a signal of
//! any unit.

use crate::limits::MAX_DOF;
use crate::{Data, DeviceDescriptor, Input, Module, Output, Parameters, Ports, Unit, UnitRelation, types};

/// See the [module docs](self).
#[derive(Debug, Default)]
pub struct Differentiator {
    filter_time_s: f32,
    input: Input,
    output: Output,
    rate_hz: f32,
    smoothing: f32,
    axes: [Axis; MAX_DOF],
    is_fresh: bool,
}

#[derive(Debug, Default)]
struct Axis {
    previous: f32,
    slope: f32,
}

impl Module for Differentiator {
    const NAME: &'static str = "DIFFERENTIATOR_MOD";
    const SUMMARY: &'static str = "Differentiates a signal by time, with a low-pass.";

    fn parameters(&mut self, visit: &mut Parameters<'_>) {
        let summary = "Time constant of the low-pass; 0 for none.";
        visit.real(&mut self.filter_time_s, "FILTER_TIME", Unit::Second, 0.0..=10.0, 0.0, summary);
    }

    fn activate(&mut self, ports: &mut Ports<'_>) {
        ports.input(&mut self.input, "SIGNAL_IN", types::SIGNAL);
        ports.output(&mut self.output, "SIGNAL_OUT", types::SIGNAL_OUT);
        ports.tie("SIGNAL_OUT", UnitRelation::Derivative, "SIGNAL_IN");
    }

    fn prepare(&mut self, device: &DeviceDescriptor) {
        let h = device.sample_period_s();
        self.rate_hz = 1.0 / h;
        self.smoothing = h / (h + self.filter_time_s);
    }

    fn compute(&mut self, data: &Data<'_>) {
        let (rate_hz, smoothing) = (self.rate_hz, self.smoothing);
        let is_fresh = core::mem::take(&mut self.is_fresh);
        data.map_axes(&mut self.axes, [self.input], [self.output], |axis, [x]| {
            let previous = if is_fresh { x } else { axis.previous };
            axis.previous = x;
            axis.slope += smoothing * ((x - previous) * rate_hz - axis.slope);
            [axis.slope]
        });
    }

    fn reset(&mut self) {
        self.is_fresh = true;
        self.axes = Default::default();
    }
}
