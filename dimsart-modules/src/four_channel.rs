//! Four-channel bilateral control: each side uses position and force of the other (Lawrence, *IEEE T-RA* 9(5), 1993).
//!
//! ```text
//! F = K (x_far - x) + D (x_far - x)' + FAR_GAIN f_far + OWN_GAIN f
//! ```
//!
//! Both sides run the same law. `f` is the external force on the device (`FORCE`): the hand at the master, the
//! environment at the slave. `FAR_GAIN 1` and `OWN_GAIN 0` transmit forces unscaled with any `K`, `D`; `OWN_GAIN > 0`
//! reduces the perceived inertia (Hashtrudi-Zaad and Salcudean, *IEEE T-RA* 18(1), 2002). Without delay and with equal
//! masses on both sides, the hand feels the environment and two masses. With delay in the four channels the law is not
//! passive: add a passivity layer after it (`PORT_DES_FORCE DES_FORCE.2`, and `TANK_MOD`).
//!
//! Initial state: the present error, with derivative 0.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION, types::FORCE, types::FAR_POSITION, types::FAR_FORCE],
//!     "all FOURCHANNEL_MOD K_PARAM 1000\nall MOD_ENG MOD_ON FOURCHANNEL_MOD\nall MOD_ENG MATCHING_CHECK",
//! )?;
//! assert_eq!(bench.tick(&[0.0, 3.0, 0.5, -2.0], "DES_FORCE"), Some(498.0));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use dimsart_core::{Context, DeviceDescriptor, Input, Module, Output, Unit, math, types, words};

words! {
    /// Parameters of one axis.
    pub parameters Gains {
        /// Stiffness between the two positions.
        stiffness: f32 = per_axis("K_PARAM", Unit::Stiffness, 0.0..=1e6, 0.0),
        /// Damping between the two velocities.
        damping: f32 = per_axis("D_PARAM", Unit::Damping, 0.0..=1e4, 0.0),
        /// Gain of the other side's force.
        far_gain: f32 = per_axis("FAR_GAIN", Unit::One, -100.0..=100.0, 1.0),
        /// Gain of this side's force.
        own_gain: f32 = per_axis("OWN_GAIN", Unit::One, -100.0..=100.0, 0.0),
        /// Maximum force, in either direction.
        limit: f32 = per_axis("LIMIT", Unit::Force, 0.0..=1e4, 1e4),
        /// `D / h`.
        damping_per_tick: f32,
    }
    /// State of one axis.
    pub struct AxisState { previous_error: f32 }
    /// Ports.
    pub ports Ports {
        position: Input = input("POSITION", types::POSITION),
        own_force: Input = input("FORCE", types::FORCE),
        far_position: Input = input("FAR_POSITION", types::FAR_POSITION),
        far_force: Input = input("FAR_FORCE", types::FAR_FORCE),
        force: Output = output("DES_FORCE", types::DES_FORCE),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct FourChannel;

impl Module for FourChannel {
    const NAME: &'static str = "FOURCHANNEL_MOD";
    const SUMMARY: &'static str = "Four-channel bilateral control: position and force of both sides.";
    type Settings = ();
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn prepare_axis((): &(), gains: &mut Gains, device: &DeviceDescriptor) {
        gains.damping_per_tick = gains.damping / device.sample_period_s();
    }

    fn begin(context: &Context<'_, Self>) {
        let Ports { position, far_position, .. } = context.ports();
        context.begin_axes([position, far_position], |_, [x, far]| AxisState { previous_error: far - x });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { position, own_force, far_position, far_force, force } = context.ports();
        let inputs = [position, own_force, far_position, far_force];
        context.map_axes(inputs, [force], |gains, axis, [x, own, far, far_force]| {
            let error = far - x;
            let change = error - axis.previous_error;
            axis.previous_error = error;
            let coupling = gains.stiffness * error + gains.damping_per_tick * change;
            [math::limit(coupling + gains.far_gain * far_force + gains.own_gain * own, gains.limit)]
        });
    }
}
