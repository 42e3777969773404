//! Inverse kinematics of two links: where the joints have to be for the tip to be at its desired place.
//!
//! With the distance `d` of the desired place from the first joint, by the law of cosines (Craig, *Introduction to
//! Robotics*, section 4.4):
//!
//! ```text
//! cos β = (d² - l1² - l2²) / (2 l1 l2)        φ = atan2(y, x) - atan2(l2 sin β, l1 + l2 cos β)
//! ```
//!
//! `PLANAR_INVERSE_MOD` is of two joints in a plane, `φ` and `β` their positions; `ELBOW` chooses between its two postures.
//! `PHANTOM_INVERSE_MOD` is of a [`Phantom`](crate::phantom), whose elbow bends one way only. A place beyond reach counts as
//! the nearest one that the arm reaches. Other axes are to be at 0. It remembers nothing: what it takes over from has to be
//! at the desired place already.
//!
//! ```
//! # use dimsart_core::{Bench, types};
//! let rows = "all MOD_ENG MOD_ON PLANAR_INVERSE_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let bench: Result<Bench, _> = Bench::new(dimsart_modules::ALL, &[types::DES_TIP_POSITION], rows);
//! assert!(bench.is_err()); // a plane takes two axes, and a bench has one
//! ```

use core::fmt::Debug;
use core::marker::PhantomData;

use crate::dynamics::{Axes, axes, write};
use crate::phantom::{Lengths, Phantom};
use crate::planar::Planar;
use dimsart_core::{
    Context, Declare, DeviceDescriptor, Input, Module, Output, ParameterSet, Parameters, PortSet, choice,
    math, types, words,
};

choice! {
    /// Which way the second link turns from the first one.
    pub enum Elbow { Positive = "POSITIVE", Negative = "NEGATIVE" }
}

words! {
    /// Of all axes.
    pub parameters Settings {
        lengths: Lengths,
        elbow: Elbow,
        /// `l1² + l2²`.
        squares: f32,
        /// `1 / (2 l1 l2)`.
        over_product: f32,
    }
    /// Signals.
    pub ports Ports {
        desired_tip: Input = input("DES_TIP_POSITION", types::DES_TIP_POSITION),
        desired_position: Output = output("DES_POSITION", types::DES_POSITION),
    }
}

/// An arm whose joints follow from the place of its tip.
pub trait Invertible: Debug + 'static {
    /// Name of its module.
    const INVERSE: &'static str;
    /// Axes it takes at least.
    const JOINTS: usize;
    /// Whether its elbow can bend either way.
    const BENDS_BOTH_WAYS: bool;
    /// Of the joints, for a place of the tip; `bend` solves two links in a plane.
    fn joints(tip: Axes, bend: impl Fn(f32, f32) -> [f32; 2]) -> Axes;
}

impl Invertible for Planar {
    const INVERSE: &'static str = "PLANAR_INVERSE_MOD";
    const JOINTS: usize = 2;
    const BENDS_BOTH_WAYS: bool = true;

    fn joints([x, y, ..]: Axes, bend: impl Fn(f32, f32) -> [f32; 2]) -> Axes {
        let [first, second] = bend(x, y);
        [first, second, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    }
}

impl Invertible for Phantom {
    const INVERSE: &'static str = "PHANTOM_INVERSE_MOD";
    const JOINTS: usize = 3;
    const BENDS_BOTH_WAYS: bool = false;

    fn joints([x, y, z, ..]: Axes, bend: impl Fn(f32, f32) -> [f32; 2]) -> Axes {
        let [inner, elbow] = bend(math::sqrt(x * x + y * y), z);
        // The outer link hangs where its own angle is 0.
        let outer = inner + elbow + core::f32::consts::FRAC_PI_2;
        [math::atan2(y, x), inner, outer, 0.0, 0.0, 0.0, 0.0, 0.0]
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Inverse<A>(PhantomData<A>);

impl<A: Invertible> Module for Inverse<A> {
    const NAME: &'static str = A::INVERSE;
    const SUMMARY: &'static str = "Inverse kinematics: joints for a desired place of the tip.";
    type Settings = Settings;
    type Gains = ();
    type State = ();
    type Axis = ();
    type Ports = Ports;

    fn parameters(settings: &mut Settings, (): &mut (), visit: &mut Parameters<'_>) {
        settings.lengths.visit(visit);
        if A::BENDS_BOTH_WAYS {
            visit.choice(&mut settings.elbow, "ELBOW", "Which way the second link turns from the first one.");
        } else {
            settings.elbow = Elbow::Negative;
        }
    }

    fn prepare(settings: &mut Settings, _: &DeviceDescriptor) {
        let Lengths { inner, outer } = settings.lengths;
        settings.squares = inner * inner + outer * outer;
        settings.over_product = 0.5 / (inner * outer);
    }

    fn ports(_: &Settings, declare: &mut Declare<'_>) -> Ports {
        declare.needs_axis(declare.device().dof() >= A::JOINTS);
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
