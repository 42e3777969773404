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
    Context, Declare, DeviceDescriptor, Input, Module, Output, PortSet, Unit, math, types, words,
};

words! {
    /// Of all axes.
    pub parameters Settings {
        /// Whether the inertia is changed, which takes EXTERNAL_FORCE.
        shapes_inertia: bool = structural_flag("SHAPES_INERTIA", false),
        /// Whether the damper is between DES_VELOCITY and the joint, and not the ground.
        follows_velocity: bool = structural_flag("FOLLOWS_VELOCITY", false),
    }
    /// Of an axis.
    pub parameters Gains {
        /// Stiffness that is felt.
        stiffness: f32 = per_axis("K_PARAM", Unit::Stiffness, 0.0..=1e6, 0.0),
        /// Damping that is felt.
        damping: f32 = per_axis("D_PARAM", Unit::Damping, 0.0..=1e4, 0.0),
        /// Inertia that is felt, with SHAPES_INERTIA.
        desired_inertia: f32 = per_axis("M_PARAM", Unit::Inertia, 1e-6..=1e4, 1.0),
        /// Inertia that there is, with SHAPES_INERTIA.
        inertia: f32 = per_axis("INERTIA", Unit::Inertia, 1e-6..=1e4, 1.0),
        /// Largest force either way.
        limit: f32 = per_axis("LIMIT", Unit::Force, 0.0..=1e4, 1e4),
        /// `r`.
        ratio: f32,
    }
    /// Signals.
    pub ports Ports {
        position: Input = input("POSITION", types::POSITION),
        velocity: Input = input("VELOCITY", types::VELOCITY),
        desired_position: Input = input("DES_POSITION", types::DES_POSITION),
        desired_velocity: Input,
        external_force: Input,
        force: Output = output("DES_FORCE", types::DES_FORCE),
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

    fn prepare_axis(settings: &Settings, gains: &mut Gains, _: &DeviceDescriptor) {
        gains.ratio = if settings.shapes_inertia { gains.inertia / gains.desired_inertia } else { 1.0 };
    }

    fn ports(settings: &Settings, declare: &mut Declare<'_>) -> Ports {
        let mut ports = Ports::declare(declare);
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
