//! Tip of an arm in Cartesian coordinates: position and velocity of the tip, and joint torques for a force at the tip.
//!
//! ```text
//! x = f(q)        x' = J(q) q'        tau = Jᵀ(q) F
//! ```
//!
//! (J. J. Craig, *Introduction to Robotics*, chapters 3 and 5; `x' F = q' tau`: power is preserved.) A control law
//! between the two stages sees a device that moves in metres: a PD controller, a wave transformer, a wall. Bind all
//! coordinates of such a law to the tip, for example `PORT_POSITION TIP_POSITION`; a mix of joint and tip coordinates
//! does not match.
//!
//! x, y and z use the first three axes, as far as the device has them; its other axes are 0. Orientation is not
//! supported. `J` is evaluated at the present pose: near a singularity, the tip cannot move in some direction, and a
//! force along it produces no torque.
//!
//! ```
//! # use dimsart_core::{Bench, types};
//! let rows = "all PLANAR_TIP_MOD LENGTH 0.5
//!             all PLANAR_TIP_MOD FORCE OFF
//!             all MOD_ENG MOD_ON PLANAR_TIP_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION], rows)?;
//! assert_eq!(bench.tick(&[0.0], "TIP_POSITION"), Some(0.5));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use core::fmt::Debug;
use core::marker::PhantomData;

use dimsart_core::limits::MAX_DOF;
use dimsart_core::{
    AxisKind, Context, Declarations, DeviceDescriptor, Input, Module, Output, ParameterSet, Parameters,
    PortSet, types, words,
};

/// Forward kinematics of an arm type.
pub trait ForwardKinematics: Debug + Copy + 'static {
    /// Name of its module.
    const TIP: &'static str;
    /// Parameters common to all axes.
    type Settings: ParameterSet;
    /// Parameters of one joint.
    type Joint: ParameterSet;

    /// Precomputes values of a joint for the tick.
    fn prepare(joint: &mut Self::Joint) {
        let _ = joint;
    }

    /// Returns the position of the tip and the Jacobian.
    fn place(settings: Self::Settings, joints: &[Joint<Self::Joint>]) -> TipPose;
}

/// Parameters and position of a joint.
#[derive(Debug, Clone, Copy, Default)]
pub struct Joint<P> {
    pub(super) parameters: P,
    pub(super) kind: AxisKind,
    pub(super) position: f32,
}

words! {
    /// Vector in x, y, z.
    pub struct Vector3 { pub(super) x: f32, pub(super) y: f32, pub(super) z: f32 }
    /// Optional signals.
    pub parameters Options {
        /// Output the velocity of the tip.
        velocity: bool = structural_flag("VELOCITY", false),
        /// Convert the force at the tip to joint torques.
        force: bool = structural_flag("FORCE", true),
    }
    /// Ports.
    pub ports Ports {
        position: Input = input("POSITION", types::POSITION),
        velocity: Input,
        tip_force: Input,
        tip_position: Output = output("TIP_POSITION", types::TIP_POSITION),
        tip_velocity: Output,
        force: Output,
    }
}

impl Vector3 {
    fn along(self, axis: usize) -> f32 {
        [self.x, self.y, self.z].get(axis).copied().unwrap_or(0.0)
    }
}

/// Position of the tip and the columns of its Jacobian.
#[derive(Debug, Clone, Copy, Default)]
pub struct TipPose {
    pub(super) tip: Vector3,
    pub(super) columns: [Vector3; MAX_DOF],
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Tip<A>(PhantomData<A>);

impl<A: ForwardKinematics> Module for Tip<A> {
    const NAME: &'static str = A::TIP;
    const SUMMARY: &'static str = "Arm tip: position, velocity, and joint torques for a tip force.";
    type Settings = (Options, A::Settings);
    type Gains = A::Joint;
    type State = ();
    /// Column of the Jacobian.
    type AxisState = Vector3;
    type Ports = Ports;

    fn parameters(
        (options, settings): &mut Self::Settings,
        joint: &mut Self::Gains,
        visit: &mut Parameters<'_>,
    ) {
        options.visit(visit);
        joint.visit(visit);
        settings.visit(visit);
    }

    fn prepare_axis(_: &Self::Settings, joint: &mut Self::Gains, _: &DeviceDescriptor) {
        A::prepare(joint);
    }

    fn ports((options, _): &Self::Settings, declare: &mut Declarations<'_>) -> Ports {
        let mut ports = Ports::declare(declare);
        if options.velocity {
            ports.velocity = declare.input("VELOCITY", types::VELOCITY);
            ports.tip_velocity = declare.output("TIP_VELOCITY", types::TIP_VELOCITY);
        }
        if options.force {
            ports.tip_force = declare.late().input("DES_TIP_FORCE", types::DES_TIP_FORCE);
            ports.force = declare.late().output("DES_FORCE", types::DES_FORCE);
        }
        ports
    }

    fn compute(context: &Context<'_, Self>) {
        let Ports { position, velocity, tip_position, tip_velocity, .. } = context.ports();
        let (options, settings) = context.settings();
        let mut joints = [Joint::default(); MAX_DOF];
        let kinds = context.device().axes().iter();
        let mut places = joints.iter_mut().zip(kinds);
        context.map_axis_contexts([position], [], |_, lane, [position]| {
            if let Some((joint, kind)) = places.next() {
                *joint = Joint { parameters: lane.gains(), kind: *kind, position };
            }
            []
        });
        let TipPose { tip, columns } = A::place(settings, joints.get(..context.dof()).unwrap_or_default());
        let mut speed = Vector3::default();
        let mut columns = columns.into_iter();
        context.map_axis_contexts([position], [tip_position], |axis, lane, _| {
            let column = columns.next().unwrap_or_default();
            lane.set_axis(column);
            if options.velocity {
                let rate = context.axis(velocity, axis);
                speed.x += column.x * rate;
                speed.y += column.y * rate;
                speed.z += column.z * rate;
            }
            [tip.along(axis)]
        });
        if options.velocity {
            context.map_axis_contexts([position], [tip_velocity], |axis, _, _| [speed.along(axis)]);
        }
    }

    fn compute_late(context: &Context<'_, Self>) {
        let Ports { tip_force, force, .. } = context.ports();
        let [x, y, z] = [0, 1, 2].map(|axis| context.axis(tip_force, axis));
        context.map_axes([tip_force], [force], |_, column, _| [column.x * x + column.y * y + column.z * z]);
    }
}
