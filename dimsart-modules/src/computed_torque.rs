//! Computed-torque control: inverse dynamics make each axis of an arm follow its desired motion like a decoupled unit
//! mass.
//!
//! ```text
//! a = x_d'' + 2 ζ ω (x_d' - x') + ω² (x_d - x)
//! F = M(q) a + C(q, q') q' + g(q) + J_m a + b x'
//! ```
//!
//! `ω = 2π BANDWIDTH`. With correct masses, the error decays in any pose as a second-order system of this frequency and
//! damping ratio (Craig, *Introduction to Robotics*, section 10.4). Wrong masses, dry friction and joint compliance
//! leave a steady error; there is no integral action. The module has no state: on takeover, the force steps to its own
//! value. For the other parameters see [`PlanarDynamics`](crate::planar) and [`Phantom`](crate::phantom).
//!
//! ```
//! # use dimsart_core::{Bench, types};
//! let rows = "all PLANAR_TORQUE_MOD INERTIA 0.5
//!             all MOD_ENG MOD_ON PLANAR_TORQUE_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let measured =
//!     &[types::POSITION, types::VELOCITY, types::DES_POSITION, types::DES_VELOCITY, types::DES_ACCELERATION];
//! let mut bench = Bench::new(dimsart_modules::ALL, measured, rows)?;
//! assert_eq!(bench.tick(&[0.0, 0.0, 0.0, 0.0, 3.0], "DES_FORCE"), Some(1.5));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use core::marker::PhantomData;

use crate::dynamics::{ArmDynamics, axes, links, write};
use dimsart_core::limits::MAX_DOF;
use dimsart_core::{
    Context, DeviceDescriptor, Input, Module, Output, ParameterSet, Parameters, Unit, types, words,
};

words! {
    /// Parameters of one axis.
    pub parameters Follow {
        /// Bandwidth of the error dynamics.
        bandwidth: f32 = per_axis("BANDWIDTH", Unit::Hertz, 0.0..=100.0, 2.0),
        /// Damping ratio of the error dynamics; 1 is critical.
        damping_ratio: f32 = per_axis("DAMPING_RATIO", Unit::One, 0.0..=10.0, 1.0),
        /// Inertia of the motor, reflected to the joint.
        motor_inertia: f32 = per_axis("MOTOR_INERTIA", Unit::Inertia, 0.0..=1e4, 0.0),
        /// Viscous friction of the joint.
        viscous: f32 = per_axis("VISCOUS", Unit::Damping, 0.0..=1e4, 0.0),
        /// `ω²`.
        stiffness: f32,
        /// `2 ζ ω`.
        damping: f32,
    }
    /// Ports.
    pub ports Ports {
        position: Input = input("POSITION", types::POSITION),
        velocity: Input = input("VELOCITY", types::VELOCITY),
        desired_position: Input = input("DES_POSITION", types::DES_POSITION),
        desired_velocity: Input = input("DES_VELOCITY", types::DES_VELOCITY),
        desired_acceleration: Input = input("DES_ACCELERATION", types::DES_ACCELERATION),
        force: Output = output("DES_FORCE", types::DES_FORCE),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct ComputedTorque<B>(PhantomData<B>);

impl<B: ArmDynamics> Module for ComputedTorque<B> {
    const NAME: &'static str = B::COMPUTED_TORQUE;
    const SUMMARY: &'static str = "Computed-torque control: inverse dynamics of the arm with a PD loop.";
    type Settings = B::Settings;
    type Gains = (Follow, B::Link);
    type State = ();
    type AxisState = ();
    type Ports = Ports;

    fn parameters(settings: &mut B::Settings, (follow, link): &mut Self::Gains, visit: &mut Parameters<'_>) {
        follow.visit(visit);
        settings.visit(visit);
        link.visit(visit);
    }

    fn prepare_axis(_: &B::Settings, (follow, _): &mut Self::Gains, _: &DeviceDescriptor) {
        let rate = core::f32::consts::TAU * follow.bandwidth;
        follow.stiffness = rate * rate;
        follow.damping = 2.0 * follow.damping_ratio * rate;
    }

    fn compute(context: &Context<'_, Self>) {
        let Ports { position, velocity, desired_position, desired_velocity, desired_acceleration, force } =
            context.ports();
        let links = links(context, position, |(_, link)| link);
        let body = B::at(context.settings(), &links, &axes(context, position));
        let mut accelerations = [0.0; MAX_DOF];
        let mut own = [0.0; MAX_DOF];
        let mut places = accelerations.iter_mut().zip(&mut own);
        let inputs = [position, velocity, desired_position, desired_velocity, desired_acceleration];
        context.map_axes(inputs, [], |(follow, _), (), [x, v, x_d, v_d, a_d]| {
            let wanted = a_d + follow.damping * (v_d - v) + follow.stiffness * (x_d - x);
            if let Some((acceleration, own)) = places.next() {
                *acceleration = wanted;
                *own = follow.motor_inertia * wanted + follow.viscous * v;
            }
            []
        });
        let mut forces = body.torques(&axes(context, velocity), &accelerations);
        forces.iter_mut().zip(own).for_each(|(force, own)| *force += own);
        write(context, force, &forces);
    }
}
