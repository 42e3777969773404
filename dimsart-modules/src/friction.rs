//! Friction compensation: Coulomb friction, Stribeck effect and viscous friction as a function of velocity.
//!
//! `F = (F_c + (F_s - F_c) exp(-(v/v_s)²)) s(v) + B v` with Coulomb friction `F_c`, breakaway force `F_s`, Stribeck
//! velocity `v_s` and viscous friction `B` (Armstrong-Hélouvry, Dupont & Canudas de Wit, *A survey of models, analysis
//! tools and compensation methods*, 1994). `s` is the sign function, smoothed linearly within `±SIGN_VELOCITY`.
//!
//! By default `v` is the desired velocity, which is free of noise and avoids limit cycles. `PORT_VELOCITY VELOCITY`
//! uses the measured velocity, which also compensates while a hand moves the joint. `COMPENSATION` below 1
//! undercompensates, so that the joint does not creep by itself.
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
    /// Parameters of one axis.
    pub parameters Gains {
        /// Coulomb friction force.
        coulomb: f32 = per_axis("COULOMB", Unit::Force, 0.0..=1e4, 0.0),
        /// Breakaway force: friction at zero velocity.
        breakaway: f32 = per_axis("BREAKAWAY", Unit::Force, 0.0..=1e4, 0.0),
        /// Stribeck velocity: scale of the fall from BREAKAWAY to COULOMB.
        stribeck_velocity: f32 = per_axis("STRIBECK_VELOCITY", Unit::Velocity, 1e-6..=1e3, 0.05),
        /// Viscous friction coefficient.
        viscous: f32 = per_axis("VISCOUS", Unit::Damping, 0.0..=1e4, 0.0),
        /// Velocity at which the smoothed sign of the velocity reaches 1.
        sign_velocity: f32 = per_axis("SIGN_VELOCITY", Unit::Velocity, 1e-6..=1e3, 0.01),
        /// Share of the friction to compensate.
        compensation: f32 = per_axis("COMPENSATION", Unit::One, 0.0..=1.0, 1.0),
        /// `1 / STRIBECK_VELOCITY`.
        per_stribeck: f32,
        /// `1 / SIGN_VELOCITY`.
        per_sign: f32,
    }
    /// Ports.
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
    const SUMMARY: &'static str = "Friction compensation: Coulomb, Stribeck and viscous.";
    type Settings = ();
    type Gains = Gains;
    type State = ();
    type AxisState = ();
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
