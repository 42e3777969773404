//! Sum of two signals, for example the forces of a controller and of a wall.
//!
//! `out = A_GAIN a + B_GAIN b`; the gains are pure numbers, so all three have the same unit.

use crate::{Data, Input, Module, Output, Parameters, PerAxis, Ports, Unit, UnitRelation, types};

/// See the [module docs](self).
#[derive(Debug, Default)]
pub struct Sum {
    gain_a: PerAxis,
    gain_b: PerAxis,
    a: Input,
    b: Input,
    output: Output,
}

impl Module for Sum {
    const NAME: &'static str = "SUM_MOD";
    const SUMMARY: &'static str = "Adds two signals, each with a gain.";

    fn parameters(&mut self, visit: &mut Parameters<'_>) {
        visit.per_axis(&mut self.gain_a, "A_GAIN", Unit::One, -1e6..=1e6, 1.0, "Factor of the first.");
        visit.per_axis(&mut self.gain_b, "B_GAIN", Unit::One, -1e6..=1e6, 1.0, "Factor of the second.");
    }

    fn activate(&mut self, ports: &mut Ports<'_>) {
        ports.input(&mut self.a, "A", types::SIGNAL);
        ports.input(&mut self.b, "B", types::SIGNAL);
        ports.output(&mut self.output, "SIGNAL_OUT", types::SIGNAL_OUT);
        ports.tie("B", UnitRelation::Same, "A");
        ports.tie("SIGNAL_OUT", UnitRelation::Same, "A");
    }

    fn compute(&mut self, data: &Data<'_>) {
        let gains = self.gain_a.iter().zip(&self.gain_b);
        data.map_axes(gains, [self.a, self.b], [self.output], |(k_a, k_b), [a, b]| [k_a * a + k_b * b]);
    }
}
