//! Template: say in a line what it does.
//!
//! `F = K (x_d - x)`: the equation, with the source of it.

use dimsart_core::{Data, Input, Module, Output, Parameters, PerAxis, Ports, Unit, types};

/// See the [module docs](self).
#[derive(Debug, Default)]
pub struct Template {
    stiffness: PerAxis,
    position: Input,
    desired_position: Input,
    force: Output,
}

impl Module for Template {
    const NAME: &'static str = "TEMPLATE_MOD";
    const SUMMARY: &'static str = "One sentence for `dimsart modules`.";

    fn parameters(&mut self, visit: &mut Parameters<'_>) {
        visit.per_axis(&mut self.stiffness, "K_PARAM", Unit::Stiffness, 0.0..=1e6, 0.0, "Stiffness.");
    }

    fn activate(&mut self, ports: &mut Ports<'_>) {
        ports.input(&mut self.position, "POSITION", types::POSITION);
        ports.input(&mut self.desired_position, "DES_POSITION", types::DES_POSITION);
        ports.output(&mut self.force, "DES_FORCE", types::DES_FORCE);
    }

    fn compute(&mut self, data: &Data<'_>) {
        let inputs = [self.position, self.desired_position];
        data.map_axes(&self.stiffness, inputs, [self.force], |k, [x, desired]| {
            // Write your law here; this one is a spring.
            [k * (desired - x)]
        });
    }
}
