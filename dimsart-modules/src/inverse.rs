//! Inverse kinematics of a two-link arm: joint positions for a desired tip position.
//!
//! With the distance `d` of the desired tip position from the first joint, by the law of cosines (Craig, *Introduction
//! to Robotics*, section 4.4):
//!
//! ```text
//! cos β = (d² - l1² - l2²) / (2 l1 l2)        φ = atan2(y, x) - atan2(l2 sin β, l1 + l2 cos β)
//! ```
//!
//! `PLANAR_INVERSE_MOD` solves two joints in a plane with the positions `φ` and `β`; `ELBOW` selects one of the two
//! solutions. `PHANTOM_INVERSE_MOD` solves a [`Phantom`](crate::phantom), whose elbow bends one way only. A position
//! out of reach is replaced by the nearest reachable one. The other axes are set to 0. The module has no state: before
//! a takeover, the arm must already be at the desired position.
//!
//! ```
//! # use dimsart_core::{Bench, types};
//! let rows = "all MOD_ENG MOD_ON PLANAR_INVERSE_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let bench: Result<Bench, _> = Bench::new(dimsart_modules::ALL, &[types::DES_TIP_POSITION], rows);
//! assert!(bench.is_err()); // a plane needs two axes; a bench has one
//! ```

use core::fmt::Debug;
use core::marker::PhantomData;

use crate::dynamics::{Axes, axes, write};
use crate::phantom::{Lengths, Phantom};
use crate::planar::PlanarDynamics;
use dimsart_core::{
    Context, Declarations, DeviceDescriptor, Input, Module, Output, ParameterSet, Parameters, PortSet,
    choice, math, types, words,
};

choice! {
    /// Sign of the second joint's position.
    pub enum Elbow { Positive = "POSITIVE", Negative = "NEGATIVE" }
}

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        lengths: Lengths,
        elbow: Elbow,
        /// `l1² + l2²`.
        squares: f32,
        /// `1 / (2 l1 l2)`.
        over_product: f32,
    }
    /// Ports.
    pub ports Ports {
        desired_tip: Input = input("DES_TIP_POSITION", types::DES_TIP_POSITION),
        desired_position: Output = output("DES_POSITION", types::DES_POSITION),
    }
}

/// An arm with closed-form inverse kinematics.
pub trait InverseKinematics: Debug + 'static {
    /// Name of its module.
    const INVERSE: &'static str;
    /// Minimum number of axes.
    const JOINTS: usize;
    /// Whether its elbow can bend either way.
    const BENDS_BOTH_WAYS: bool;
    /// Returns the joint positions for a tip position; `bend` solves two links in a plane.
    fn joints(tip: Axes, bend: impl Fn(f32, f32) -> [f32; 2]) -> Axes;
}

impl InverseKinematics for PlanarDynamics {
    const INVERSE: &'static str = "PLANAR_INVERSE_MOD";
    const JOINTS: usize = 2;
    const BENDS_BOTH_WAYS: bool = true;

    fn joints([x, y, ..]: Axes, bend: impl Fn(f32, f32) -> [f32; 2]) -> Axes {
        let [first, second] = bend(x, y);
        [first, second, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    }
}

impl InverseKinematics for Phantom {
    const INVERSE: &'static str = "PHANTOM_INVERSE_MOD";
    const JOINTS: usize = 3;
    const BENDS_BOTH_WAYS: bool = false;

    fn joints([x, y, z, ..]: Axes, bend: impl Fn(f32, f32) -> [f32; 2]) -> Axes {
        let [inner, elbow] = bend(math::sqrt(x * x + y * y), z);
        // The angle 0 of the outer link points down.
        let outer = inner + elbow + core::f32::consts::FRAC_PI_2;
        [math::atan2(y, x), inner, outer, 0.0, 0.0, 0.0, 0.0, 0.0]
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Inverse<A>(PhantomData<A>);

impl<A: InverseKinematics> Module for Inverse<A> {
    const NAME: &'static str = A::INVERSE;
    const SUMMARY: &'static str = "Inverse kinematics: joint positions for a desired tip position.";
    type Settings = Settings;
    type Gains = ();
    type State = ();
    type AxisState = ();
    type Ports = Ports;

    fn parameters(settings: &mut Settings, (): &mut (), visit: &mut Parameters<'_>) {
        settings.lengths.visit(visit);
        if A::BENDS_BOTH_WAYS {
            let summary = "Elbow posture: sign of the second joint's position.";
            visit.choice(&mut settings.elbow, "ELBOW", summary);
        } else {
            settings.elbow = Elbow::Negative;
        }
    }

    fn prepare(settings: &mut Settings, _: &DeviceDescriptor) {
        let Lengths { inner, outer } = settings.lengths;
        settings.squares = inner * inner + outer * outer;
        settings.over_product = 0.5 / (inner * outer);
    }

    fn ports(_: &Settings, declare: &mut Declarations<'_>) -> Ports {
        declare.requires_axis(declare.device().dof() >= A::JOINTS);
        Ports::declare(declare)
    }

    fn compute(context: &Context<'_, Self>) {
        let Ports { desired_tip, desired_position } = context.ports();
        let Settings { lengths: Lengths { inner, outer }, elbow, squares, over_product } = context.settings();
        let joints = A::joints(axes(context, desired_tip), |x, y| {
            let cosine = math::limit((x * x + y * y - squares) * over_product, 1.0);
            let bent = math::sqrt((1.0 - cosine) * (1.0 + cosine));
            let sine = if elbow == Elbow::Positive { bent } else { -bent };
            [math::atan2(y, x) - math::atan2(outer * sine, inner + outer * cosine), math::atan2(sine, cosine)]
        });
        write(context, desired_position, &joints);
    }
}
