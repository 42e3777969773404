//! Velocity to position: a desired velocity becomes a desired position that starts where the device is.
//!
//! `x_d += h v`, `x_d = x` when plugged in or reset. The sum is compensated (Kahan).

use dimsart_core::math::CompensatedSum;
use dimsart_core::{Context, Declare, DeviceDescriptor, Input, Module, Output, types, words};

words! {
    /// Of all axes.
    pub struct Settings { period_s: f32 }
    /// Of an axis.
    pub struct Axis { desired: CompensatedSum }
    /// Signals.
    pub struct Ports { position: Input, velocity: Input, desired_position: Output }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct VelocityToPosition;

impl Module for VelocityToPosition {
    const NAME: &'static str = "VEL2POS_MOD";
    const SUMMARY: &'static str = "Integrates a desired velocity from the present position on.";
    type Settings = Settings;
    type Gains = ();
    type State = ();
    type Axis = Axis;
    type Ports = Ports;

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.period_s = device.sample_period_s();
    }

    fn ports(_: &Settings, declare: &mut Declare<'_>) -> Ports {
        Ports {
            position: declare.input("POSITION", types::POSITION),
            velocity: declare.input("DES_VELOCITY", types::DES_VELOCITY),
            desired_position: declare.output("DES_POSITION", types::DES_POSITION),
        }
    }

    fn begin(context: &Context<'_, Self>) {
        context.begin_axes([context.ports().position], |(), [x]| Axis { desired: CompensatedSum::new(x) });
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
