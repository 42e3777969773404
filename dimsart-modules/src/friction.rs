//! Friction compensation: the force that a joint's friction takes at a velocity.
//!
//! `F = (F_c + (F_s - F_c) exp(-(v/v_s)²)) s(v) + B v`: Coulomb friction, breakaway force and Stribeck velocity, viscous friction
//! (Armstrong-Hélouvry, Dupont & Canudas de Wit, *A survey of models, analysis tools and compensation methods*, 1994). `s` is the
//! sign, which goes evenly from -1 to 1 within `±SIGN_VELOCITY`.
//!
//! The velocity is the desired one, which has no noise and does not swing; `PORT_VELOCITY VELOCITY` takes the measured
//! one, which also helps a hand that moves the joint. Less than the friction there is (`COMPENSATION` below 1) keeps it from
//! creeping by itself.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all FRICTION_MOD COULOMB 2
//!             all FRICTION_MOD BREAKAWAY 2
//!             all FRICTION_MOD VISCOUS 0.5
//!             all MOD_ENG MOD_ON FRICTION_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::DES_VELOCITY], rows)?;
//! assert_eq!(bench.tick(&[-3.0], "FEED_FORCE"), Some(-3.5));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use dimsart_core::{Context, DeviceDescriptor, Input, Module, Output, Unit, math, types, words};

words! {
    /// Of an axis.
    pub parameters Gains {
        /// Coulomb friction.
        coulomb: f32 = per_axis("COULOMB", Unit::Force, 0.0..=1e4, 0.0),
        /// Friction at rest, with which Stribeck's curve begins.
        breakaway: f32 = per_axis("BREAKAWAY", Unit::Force, 0.0..=1e4, 0.0),
        /// Velocity in which friction falls from BREAKAWAY to COULOMB.
        stribeck_velocity: f32 = per_axis("STRIBECK_VELOCITY", Unit::Velocity, 1e-6..=1e3, 0.05),
        /// Viscous friction.
        viscous: f32 = per_axis("VISCOUS", Unit::Damping, 0.0..=1e4, 0.0),
        /// Velocity from which on the sign is all there.
        sign_velocity: f32 = per_axis("SIGN_VELOCITY", Unit::Velocity, 1e-6..=1e3, 0.01),
        /// Share of the friction that is compensated.
        compensation: f32 = per_axis("COMPENSATION", Unit::One, 0.0..=1.0, 1.0),
        /// `1 / STRIBECK_VELOCITY`.
        per_stribeck: f32,
        /// `1 / SIGN_VELOCITY`.
        per_sign: f32,
    }
    /// Signals.
    pub ports Ports {
        velocity: Input = input("VELOCITY", types::DES_VELOCITY),
        feed_force: Output = output("FEED_FORCE", types::FEED_FORCE),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Friction;

impl Module for Friction {
    const NAME: &'static str = "FRICTION_MOD";
    const SUMMARY: &'static str = "Compensates friction: Coulomb, Stribeck, viscous.";
    type Settings = ();
    type Gains = Gains;
    type State = ();
    type Axis = ();
    type Ports = Ports;

    fn prepare_axis((): &(), gains: &mut Gains, _: &DeviceDescriptor) {
        gains.per_stribeck = 1.0 / gains.stribeck_velocity;
        gains.per_sign = 1.0 / gains.sign_velocity;
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { velocity, feed_force } = context.ports();
        context.map_axes([velocity], [feed_force], |gains, (), [v]| {
            let share = v * gains.per_stribeck;
            let dry = gains.coulomb + (gains.breakaway - gains.coulomb) * math::exp(-share * share);
            [gains.compensation * (dry * math::limit(v * gains.per_sign, 1.0) + gains.viscous * v)]
        });
    }
}
