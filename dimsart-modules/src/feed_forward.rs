//! Feed-forward: the force that the desired motion takes of itself, before any error shows it.
//!
//! `F = J a_d + B v_d + F_c s(v_d) + G`: inertia, viscous and Coulomb friction, and a constant force such as that of gravity on
//! an output that slides. `s` is the sign, which goes evenly from -1 to 1 within `±COULOMB_VELOCITY`, so that the force does not jump
//! (Craig, *Introduction to Robotics*, section 9.7). A controller with `FEED_FORWARD ON` takes it; `SUM_MOD` adds it
//! to what another one commands.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all FEED_FORWARD_MOD INERTIA 2
//!             all FEED_FORWARD_MOD VISCOUS 0.5
//!             all MOD_ENG MOD_ON FEED_FORWARD_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::DES_VELOCITY, types::DES_ACCELERATION], rows)?;
//! assert_eq!(bench.tick(&[1.0, 3.0], "FEED_FORCE"), Some(6.5));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use dimsart_core::{Context, DeviceDescriptor, Input, Module, Output, Unit, math, types, words};

words! {
    /// Of an axis.
    pub parameters Gains {
        /// Inertia of the joint.
        inertia: f32 = per_axis("INERTIA", Unit::Inertia, 0.0..=1e4, 0.0),
        /// Viscous friction.
        viscous: f32 = per_axis("VISCOUS", Unit::Damping, 0.0..=1e4, 0.0),
        /// Coulomb friction.
        coulomb: f32 = per_axis("COULOMB", Unit::Force, 0.0..=1e4, 0.0),
        /// Velocity from which on all of the Coulomb friction is there.
        coulomb_velocity: f32 = per_axis("COULOMB_VELOCITY", Unit::Velocity, 1e-6..=1e3, 0.01),
        /// Constant force.
        gravity: f32 = per_axis("GRAVITY", Unit::Force, -1e4..=1e4, 0.0),
        /// `1 / COULOMB_VELOCITY`.
        per_velocity: f32,
    }
    /// Signals.
    pub ports Ports {
        desired_velocity: Input = input("DES_VELOCITY", types::DES_VELOCITY),
        desired_acceleration: Input = input("DES_ACCELERATION", types::DES_ACCELERATION),
        feed_force: Output = output("FEED_FORCE", types::FEED_FORCE),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct FeedForward;

impl Module for FeedForward {
    const NAME: &'static str = "FEED_FORWARD_MOD";
    const SUMMARY: &'static str = "The force that a desired motion takes: inertia, friction and a constant.";
    type Settings = ();
    type Gains = Gains;
    type State = ();
    type Axis = ();
    type Ports = Ports;

    fn prepare_axis((): &(), gains: &mut Gains, _: &DeviceDescriptor) {
        gains.per_velocity = 1.0 / gains.coulomb_velocity;
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { desired_velocity, desired_acceleration, feed_force } = context.ports();
        context.map_axes([desired_velocity, desired_acceleration], [feed_force], |gains, (), [v, a]| {
            let sign = math::limit(v * gains.per_velocity, 1.0);
            [gains.inertia * a + gains.viscous * v + gains.coulomb * sign + gains.gravity]
        });
    }
}
