//! Four-channel control: each side gets position and force of the other one (Lawrence, *IEEE T-RA* 9(5), 1993).
//!
//! ```text
//! F = K (x_far - x) + D (x_far - x)' + FAR_GAIN f_far + OWN_GAIN f
//! ```
//!
//! The same law on both sides. `f` is what the world does to the device (`FORCE`): a hand at the master, what the slave
//! meets at the other end. `FAR_GAIN 1` and `OWN_GAIN 0` with any `K`, `D` let forces through as they are; `OWN_GAIN > 0`
//! makes the device feel lighter (Hashtrudi-Zaad and Salcudean, *IEEE T-RA* 18(1), 2002). Without delay and with the same
//! mass on both sides the hand feels the world and two masses. Delay is inside all four channels, and nothing makes it
//! passive: put a passivity layer behind it (`PORT_DES_FORCE DES_FORCE.2`, and `TANK_MOD`).
//!
//! It begins with the error it finds, and its derivative with 0.
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
    /// Of an axis.
    pub parameters Gains {
        /// Between both positions.
        stiffness: f32 = per_axis("K_PARAM", Unit::Stiffness, 0.0..=1e6, 0.0),
        /// Between both velocities.
        damping: f32 = per_axis("D_PARAM", Unit::Damping, 0.0..=1e4, 0.0),
        /// Of the other side's force.
        far_gain: f32 = per_axis("FAR_GAIN", Unit::One, -100.0..=100.0, 1.0),
        /// Of this side's force.
        own_gain: f32 = per_axis("OWN_GAIN", Unit::One, -100.0..=100.0, 0.0),
        /// Largest force either way.
        limit: f32 = per_axis("LIMIT", Unit::Force, 0.0..=1e4, 1e4),
        /// `D / h`.
        damping_per_tick: f32,
    }
    /// Of an axis.
    pub struct Axis { previous_error: f32 }
    /// Signals.
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
    const SUMMARY: &'static str =
        "Four-channel control: position and force of the other side, and a local controller.";
    type Settings = ();
    type Gains = Gains;
    type State = ();
    type Axis = Axis;
    type Ports = Ports;

    fn prepare_axis((): &(), gains: &mut Gains, device: &DeviceDescriptor) {
        gains.damping_per_tick = gains.damping / device.sample_period_s();
    }

    fn begin(context: &Context<'_, Self>) {
        let Ports { position, far_position, .. } = context.ports();
        context.begin_axes([position, far_position], |_, [x, far]| Axis { previous_error: far - x });
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
