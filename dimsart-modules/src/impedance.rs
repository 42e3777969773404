//! Impedance controller: the joint answers the world as a spring and a damper do, and a mass if asked to.
//!
//! `F = r (K (x_d - x) + D (v_d - v)) + (r - 1) F_e`, with `r = 1`, the joint's own inertia being felt, or with
//! `SHAPES_INERTIA ON` `r = INERTIA / M`, for the mass `M` to be felt, which takes the force `F_e` of the world
//! (`EXTERNAL_FORCE`). Hogan, *Impedance Control*, part II, 1985. `v_d` is `DES_VELOCITY` with `FOLLOWS_VELOCITY ON`, otherwise 0.
//!
//! It remembers nothing, so it begins as what is measured says. An `r` far from 1 is no longer passive with the delay of a
//! tick: the observed force comes late.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all IMPEDANCE_MOD K_PARAM 100
//!             all IMPEDANCE_MOD D_PARAM 4
//!             all MOD_ENG MOD_ON IMPEDANCE_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let measured = &[types::POSITION, types::VELOCITY, types::DES_POSITION];
//! let mut bench = Bench::new(dimsart_modules::ALL, measured, rows)?;
//! assert_eq!(bench.tick(&[0.0, 0.5, 0.25], "DES_FORCE"), Some(23.0));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use dimsart_core::{
    Context, Declare, DeviceDescriptor, Input, Module, Output, Parameters, Unit, math, types, words,
};

words! {
    /// Of all axes.
    pub struct Settings { shapes_inertia: bool, follows_velocity: bool }
    /// Of an axis.
    pub struct Gains {
        stiffness: f32,
        damping: f32,
        desired_inertia: f32,
        inertia: f32,
        limit: f32,
        /// `r`.
        ratio: f32,
    }
    /// Signals.
    pub struct Ports {
        position: Input,
        velocity: Input,
        desired_position: Input,
        desired_velocity: Input,
        external_force: Input,
        force: Output,
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Impedance;

impl Module for Impedance {
    const NAME: &'static str = "IMPEDANCE_MOD";
    const SUMMARY: &'static str = "Impedance controller: a spring, a damper and, if asked for, a mass.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type Axis = ();
    type Ports = Ports;

    fn parameters(settings: &mut Settings, gains: &mut Gains, visit: &mut Parameters<'_>) {
        let Gains { stiffness, damping, desired_inertia, inertia, limit, .. } = gains;
        visit.per_axis(stiffness, "K_PARAM", Unit::Stiffness, 0.0..=1e6, 0.0, "Stiffness that is felt.");
        visit.per_axis(damping, "D_PARAM", Unit::Damping, 0.0..=1e4, 0.0, "Damping that is felt.");
        let summary = "Inertia that is felt, with SHAPES_INERTIA.";
        visit.per_axis(desired_inertia, "M_PARAM", Unit::Inertia, 1e-6..=1e4, 1.0, summary);
        let summary = "Inertia that there is, with SHAPES_INERTIA.";
        visit.per_axis(inertia, "INERTIA", Unit::Inertia, 1e-6..=1e4, 1.0, summary);
        visit.per_axis(limit, "LIMIT", Unit::Force, 0.0..=1e4, 1e4, "Largest force either way.");
        let Settings { shapes_inertia, follows_velocity } = settings;
        let summary = "Whether the inertia is changed, which takes EXTERNAL_FORCE.";
        visit.structural_flag(shapes_inertia, "SHAPES_INERTIA", false, summary);
        let summary = "Whether the damper is between DES_VELOCITY and the joint, and not the ground.";
        visit.structural_flag(follows_velocity, "FOLLOWS_VELOCITY", false, summary);
    }

    fn prepare_axis(settings: &Settings, gains: &mut Gains, _: &DeviceDescriptor) {
        gains.ratio = if settings.shapes_inertia { gains.inertia / gains.desired_inertia } else { 1.0 };
    }

    fn ports(settings: &Settings, declare: &mut Declare<'_>) -> Ports {
        let mut ports = Ports {
            position: declare.input("POSITION", types::POSITION),
            velocity: declare.input("VELOCITY", types::VELOCITY),
            desired_position: declare.input("DES_POSITION", types::DES_POSITION),
            force: declare.output("DES_FORCE", types::DES_FORCE),
            ..Ports::default()
        };
        if settings.follows_velocity {
            ports.desired_velocity = declare.input("DES_VELOCITY", types::DES_VELOCITY);
        }
        if settings.shapes_inertia {
            ports.external_force = declare.input("EXTERNAL_FORCE", types::EXTERNAL_FORCE);
        }
        ports
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { position, velocity, desired_position, desired_velocity, external_force, force } =
            context.ports();
        context.map_lanes(
            [position, velocity, desired_position],
            [force],
            |number, lane, [x, v, desired]| {
                let gains = lane.gains();
                let velocity_error = context.axis(desired_velocity, number) - v;
                let felt = gains.stiffness * (desired - x) + gains.damping * velocity_error;
                let force = gains.ratio * felt + (gains.ratio - 1.0) * context.axis(external_force, number);
                [math::limit(force, gains.limit)]
            },
        );
    }
}
