//! Normalizer: scale, offset and limit, for unit conversion or for a channel of limited range.
//!
//! `out = clamp((in - OFFSET) SCALE, -LIMIT, LIMIT)`; `SCALE` may change the unit, so the output's is free.

use crate::{Data, Input, Module, Output, Parameters, PerAxis, Ports, Unit, math, types};

/// See the [module docs](self).
#[derive(Debug, Default)]
pub struct Normalizer {
    scale: PerAxis,
    offset: PerAxis,
    limit: PerAxis,
    input: Input,
    output: Output,
}

impl Module for Normalizer {
    const NAME: &'static str = "NORMALIZER_MOD";
    const SUMMARY: &'static str = "Scales, shifts and limits a signal of any unit.";

    fn parameters(&mut self, visit: &mut Parameters<'_>) {
        visit.per_axis(&mut self.scale, "SCALE", Unit::One, -1e9..=1e9, 1.0, "Factor.");
        visit.per_axis(&mut self.offset, "OFFSET", Unit::Any, -1e9..=1e9, 0.0, "Taken off before scaling.");
        visit.per_axis(&mut self.limit, "LIMIT", Unit::Any, 0.0..=1e9, 1e9, "Largest output either way.");
    }

    fn activate(&mut self, ports: &mut Ports<'_>) {
        ports.input(&mut self.input, "SIGNAL_IN", types::SIGNAL);
        ports.output(&mut self.output, "SIGNAL_OUT", types::SIGNAL_OUT);
    }

    fn compute(&mut self, data: &Data<'_>) {
        let laws = self.scale.iter().zip(&self.offset).zip(&self.limit);
        data.map_axes(laws, [self.input], [self.output], |((scale, offset), limit), [x]| {
            [math::limit((x - offset) * scale, *limit)]
        });
    }
}
