//! Velocity to position: integrates a desired velocity to a desired position, starting at the measured position.
//!
//! `x_d += h v`; `x_d = x` at plug-in or reset. The sum is compensated (Kahan).

use dimsart_core::math::CompensatedSum;
use dimsart_core::{Context, DeviceDescriptor, Input, Module, Output, types, words};

words! {
    /// Parameters common to all axes.
    pub parameters Settings { period_s: f32 }
    /// State of one axis.
    pub struct AxisState { desired: CompensatedSum }
    /// Ports.
    pub ports Ports {
        position: Input = input("POSITION", types::POSITION),
        velocity: Input = input("DES_VELOCITY", types::DES_VELOCITY),
        desired_position: Output = output("DES_POSITION", types::DES_POSITION),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct VelocityToPosition;

impl Module for VelocityToPosition {
    const NAME: &'static str = "VEL2POS_MOD";
    const SUMMARY: &'static str = "Integrates a desired velocity, starting at the measured position.";
    type Settings = Settings;
    type Gains = ();
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.period_s = device.sample_period_s();
    }

    fn begin(context: &Context<'_, Self>) {
        context
            .begin_axes([context.ports().position], |(), [x]| AxisState { desired: CompensatedSum::new(x) });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { velocity, desired_position, .. } = context.ports();
        let Settings { period_s } = context.settings();
        context.map_axes([velocity], [desired_position], |(), axis, [velocity]| {
            [axis.desired.add(period_s * velocity)]
        });
    }
}
