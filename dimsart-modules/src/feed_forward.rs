//! Feed-forward: the force that the desired motion needs, before an error builds up.
//!
//! `F = J a_d + B v_d + F_c s(v_d) + G`: inertia, viscous and Coulomb friction, and a constant force, for example
//! gravity on a vertical slide. `s` is the sign function, smoothed linearly within `±COULOMB_VELOCITY` to avoid a jump
//! of the force (Craig, *Introduction to Robotics*, section 9.7). Use it with a controller that has `FEED_FORWARD ON`,
//! or add it with `SUM_MOD`.
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
    /// Parameters of one axis.
    pub parameters Gains {
        /// Inertia of the joint.
        inertia: f32 = per_axis("INERTIA", Unit::Inertia, 0.0..=1e4, 0.0),
        /// Viscous friction coefficient.
        viscous: f32 = per_axis("VISCOUS", Unit::Damping, 0.0..=1e4, 0.0),
        /// Coulomb friction force.
        coulomb: f32 = per_axis("COULOMB", Unit::Force, 0.0..=1e4, 0.0),
        /// Velocity at which the Coulomb friction reaches its full value.
        coulomb_velocity: f32 = per_axis("COULOMB_VELOCITY", Unit::Velocity, 1e-6..=1e3, 0.01),
        /// Constant force, for example gravity.
        gravity: f32 = per_axis("GRAVITY", Unit::Force, -1e4..=1e4, 0.0),
        /// `1 / COULOMB_VELOCITY`.
        per_velocity: f32,
    }
    /// Ports.
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
    const SUMMARY: &'static str = "Feed-forward force: inertia, friction and a constant load.";
    type Settings = ();
    type Gains = Gains;
    type State = ();
    type AxisState = ();
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
