//! Velocity to position: a desired velocity becomes a desired position that starts where the device is.
//!
//! `x_d += h v`, `x_d = x` when plugged in or reset. The sum is compensated (Kahan).

use crate::limits::MAX_DOF;
use crate::math::CompensatedSum;
use crate::{Data, DeviceDescriptor, Input, Module, Output, Ports, types};

/// See the [module docs](self).
#[derive(Debug, Default)]
pub struct VelocityToPosition {
    position: Input,
    velocity: Input,
    desired_position: Output,
    period_s: f32,
    axes: [CompensatedSum; MAX_DOF],
    is_fresh: bool,
}

impl Module for VelocityToPosition {
    const NAME: &'static str = "VEL2POS_MOD";
    const SUMMARY: &'static str = "Integrates a desired velocity from the present position on.";

    fn activate(&mut self, ports: &mut Ports<'_>) {
        ports.input(&mut self.position, "POSITION", types::POSITION);
        ports.input(&mut self.velocity, "DES_VELOCITY", types::DES_VELOCITY);
        ports.output(&mut self.desired_position, "DES_POSITION", types::DES_POSITION);
    }

    fn prepare(&mut self, device: &DeviceDescriptor) {
        self.period_s = device.sample_period_s();
    }

    fn compute(&mut self, data: &Data<'_>) {
        let period_s = self.period_s;
        let is_fresh = core::mem::take(&mut self.is_fresh);
        let inputs = [self.position, self.velocity];
        data.map_axes(&mut self.axes, inputs, [self.desired_position], |axis, [x, velocity]| {
            if is_fresh {
                *axis = CompensatedSum::new(x);
            }
            [axis.add(period_s * velocity)]
        });
    }

    fn reset(&mut self) {
        self.is_fresh = true;
    }
}
