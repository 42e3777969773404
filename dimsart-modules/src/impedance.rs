//! Impedance controller: the joint responds to external forces as a spring and damper, optionally with a set inertia.
//!
//! `F = r (K (x_d - x) + D (v_d - v)) + (r - 1) F_e`. With `SHAPES_INERTIA OFF`, `r = 1`: the joint keeps its own
//! inertia. With `ON`, `r = INERTIA / M` makes the apparent inertia `M`; this needs the external force `F_e`
//! (`EXTERNAL_FORCE`). Hogan, *Impedance Control*, part II, 1985. `v_d` is `DES_VELOCITY` with `FOLLOWS_VELOCITY ON`,
//! otherwise 0.
//!
//! The module has no state. An `r` far from 1 is not passive, because the observed force is one tick late.
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
    Context, Declarations, DeviceDescriptor, Input, Module, Output, PortSet, Unit, math, types, words,
};

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Shape the apparent inertia; needs EXTERNAL_FORCE.
        shapes_inertia: bool = structural_flag("SHAPES_INERTIA", false),
        /// Damp relative to DES_VELOCITY instead of ground.
        follows_velocity: bool = structural_flag("FOLLOWS_VELOCITY", false),
    }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Apparent stiffness.
        stiffness: f32 = per_axis("K_PARAM", Unit::Stiffness, 0.0..=1e6, 0.0),
        /// Apparent damping.
        damping: f32 = per_axis("D_PARAM", Unit::Damping, 0.0..=1e4, 0.0),
        /// Apparent inertia, with SHAPES_INERTIA.
        desired_inertia: f32 = per_axis("M_PARAM", Unit::Inertia, 1e-6..=1e4, 1.0),
        /// Actual inertia of the joint, with SHAPES_INERTIA.
        inertia: f32 = per_axis("INERTIA", Unit::Inertia, 1e-6..=1e4, 1.0),
        /// Maximum force, in either direction.
        limit: f32 = per_axis("LIMIT", Unit::Force, 0.0..=1e4, 1e4),
        /// `r`.
        ratio: f32,
    }
    /// Ports.
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
    const SUMMARY: &'static str = "Impedance controller: stiffness, damping and optional inertia shaping.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type AxisState = ();
    type Ports = Ports;

    fn prepare_axis(settings: &Settings, gains: &mut Gains, _: &DeviceDescriptor) {
        gains.ratio = if settings.shapes_inertia { gains.inertia / gains.desired_inertia } else { 1.0 };
    }

    fn ports(settings: &Settings, declare: &mut Declarations<'_>) -> Ports {
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
        context.map_axis_contexts(
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
