//! PD controller: spring and damper between desired and measured position.
//!
//! `F = K e + D (e - e[k-1]) / h`, `e = x_d - x`, `h` the sample period; `e[-1] = e[0]`.
//!
//! With `LAW_OUTPUT ON` it also publishes the law it will follow in the next tick,
//! `F = S (x_d - x) - M` with `S = K + D/h` and `M = D e/h`, so that a wave transformer can solve for
//! the desired position that the force itself depends on (its implicit form).

use crate::{Data, DeviceDescriptor, Input, Module, Output, Parameters, PerAxis, Ports, Unit, types};

/// See the [module docs](self).
#[derive(Debug, Default)]
pub struct Pd {
    stiffness: PerAxis,
    damping: PerAxis,
    publishes_law: bool,
    position: Input,
    desired_position: Input,
    force: Output,
    control_stiffness: Output,
    control_memory: Output,
    axes: [Axis; crate::limits::MAX_DOF],
    is_fresh: bool,
}

#[derive(Debug, Default)]
struct Axis {
    stiffness: f32,
    previous_error: f32,
    /// `D / h`.
    damping_per_tick: f32,
}

impl Module for Pd {
    const NAME: &'static str = "PDCTRL_MOD";
    const SUMMARY: &'static str = "PD controller on position: F = K e + D de/dt.";

    fn parameters(&mut self, visit: &mut Parameters<'_>) {
        visit.per_axis(&mut self.stiffness, "K_PARAM", Unit::Stiffness, 0.0..=1e6, 0.0, "Proportional gain.");
        visit.per_axis(&mut self.damping, "D_PARAM", Unit::Damping, 0.0..=1e4, 0.0, "Derivative gain.");
        let summary = "Publish the law of the next tick, for an implicit wave transformer.";
        visit.structural_flag(&mut self.publishes_law, "LAW_OUTPUT", false, summary);
    }

    fn activate(&mut self, ports: &mut Ports<'_>) {
        ports.input(&mut self.position, "POSITION", types::POSITION);
        ports.input(&mut self.desired_position, "DES_POSITION", types::DES_POSITION);
        ports.output(&mut self.force, "DES_FORCE", types::DES_FORCE);
        if self.publishes_law {
            ports.output(&mut self.control_stiffness, "CONTROL_STIFFNESS", types::CONTROL_STIFFNESS);
            ports.output(&mut self.control_memory, "CONTROL_MEMORY", types::CONTROL_MEMORY);
        }
    }

    fn prepare(&mut self, device: &DeviceDescriptor) {
        for ((axis, stiffness), damping) in self.axes.iter_mut().zip(self.stiffness).zip(self.damping) {
            axis.stiffness = stiffness;
            axis.damping_per_tick = damping / device.sample_period_s();
        }
    }

    fn compute(&mut self, data: &Data<'_>) {
        let inputs = [self.position, self.desired_position];
        if self.is_fresh {
            self.is_fresh = false;
            data.map_axes(&mut self.axes, inputs, [], |axis, [x, desired]| {
                axis.previous_error = desired - x;
                []
            });
        }
        data.map_axes(&mut self.axes, inputs, [self.force], |axis, [x, desired]| {
            let error = desired - x;
            let change = error - axis.previous_error;
            axis.previous_error = error;
            [axis.stiffness * error + axis.damping_per_tick * change]
        });
        if self.publishes_law {
            let outputs = [self.control_stiffness, self.control_memory];
            data.map_axes(&self.axes, [], outputs, |axis, []| {
                let Axis { stiffness, damping_per_tick, previous_error } = axis;
                [stiffness + damping_per_tick, damping_per_tick * previous_error]
            });
        }
    }

    fn reset(&mut self) {
        self.is_fresh = true;
    }
}
