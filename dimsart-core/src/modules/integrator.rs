//! Integrator of a signal, by the trapezoidal rule.
//!
//! `y += h (x + x[k-1]) / 2`, held inside `±LIMIT`; `x[-1] = 0`. The sum is compensated (Kahan).
//! The output's unit is the input's times `s`; where that has no name, the output is a signal of any unit.

use crate::limits::MAX_DOF;
use crate::math::{self, CompensatedSum};
use crate::{
    Data, DeviceDescriptor, Input, Module, Output, Parameters, PerAxis, Ports, Unit, UnitRelation, types,
};

/// See the [module docs](self).
#[derive(Debug, Default)]
pub struct Integrator {
    limit: PerAxis,
    input: Input,
    output: Output,
    half_period_s: f32,
    axes: [Axis; MAX_DOF],
}

#[derive(Debug, Default)]
struct Axis {
    previous: f32,
    sum: CompensatedSum,
}

impl Module for Integrator {
    const NAME: &'static str = "INTEGRATOR_MOD";
    const SUMMARY: &'static str = "Integrates a signal over time.";

    fn parameters(&mut self, visit: &mut Parameters<'_>) {
        visit.per_axis(&mut self.limit, "LIMIT", Unit::Any, 0.0..=1e9, 1e9, "Largest output either way.");
    }

    fn activate(&mut self, ports: &mut Ports<'_>) {
        ports.input(&mut self.input, "SIGNAL_IN", types::SIGNAL);
        ports.output(&mut self.output, "SIGNAL_OUT", types::SIGNAL_OUT);
        ports.tie("SIGNAL_OUT", UnitRelation::Integral, "SIGNAL_IN");
    }

    fn prepare(&mut self, device: &DeviceDescriptor) {
        self.half_period_s = 0.5 * device.sample_period_s();
    }

    fn compute(&mut self, data: &Data<'_>) {
        let half_period_s = self.half_period_s;
        let lanes = self.axes.iter_mut().zip(&self.limit);
        data.map_axes(lanes, [self.input], [self.output], |(axis, limit), [x]| {
            let sum = axis.sum.add(half_period_s * (x + axis.previous));
            axis.previous = x;
            if sum.abs() > *limit {
                axis.sum = CompensatedSum::new(math::limit(sum, *limit));
            }
            [axis.sum.value()]
        });
    }

    fn reset(&mut self) {
        self.axes = Default::default();
    }
}
