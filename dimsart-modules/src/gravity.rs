//! Gravity compensation: the joint torques that hold an arm against gravity.
//!
//! `F = g(q)`, the torque on each joint by the weight beyond it (Craig, *Introduction to Robotics*, chapter 6). The
//! output is `FEED_FORCE`; add it with a sum or in a controller. Friction and payload are not included. For the
//! parameters see [`PlanarDynamics`](crate::planar) and [`Phantom`](crate::phantom).
//!
//! ```
//! # use dimsart_core::{Bench, types};
//! let rows = "all PLANAR_GRAVITY_MOD MASS 2
//!             all PLANAR_GRAVITY_MOD CENTRE 0.5
//!             all PLANAR_GRAVITY_MOD GRAVITY_Y -10
//!             all MOD_ENG MOD_ON PLANAR_GRAVITY_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION], rows)?;
//! assert_eq!(bench.tick(&[0.0], "FEED_FORCE"), Some(10.0));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use core::marker::PhantomData;

use crate::dynamics::{ArmDynamics, axes, links, write};
use dimsart_core::{Context, Input, Module, Output, ParameterSet, Parameters, types, words};

words! {
    /// Ports.
    pub ports Ports {
        position: Input = input("POSITION", types::POSITION),
        force: Output = output("FEED_FORCE", types::FEED_FORCE),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct GravityCompensation<B>(PhantomData<B>);

impl<B: ArmDynamics> Module for GravityCompensation<B> {
    const NAME: &'static str = B::GRAVITY;
    const SUMMARY: &'static str = "Gravity compensation: torques that hold an arm against gravity.";
    type Settings = B::Settings;
    type Gains = B::Link;
    type State = ();
    type AxisState = ();
    type Ports = Ports;

    fn parameters(settings: &mut B::Settings, link: &mut B::Link, visit: &mut Parameters<'_>) {
        settings.visit(visit);
        link.visit(visit);
    }

    fn compute(context: &Context<'_, Self>) {
        let Ports { position, force } = context.ports();
        let links = links(context, position, |link| link);
        let body = B::at(context.settings(), &links, &axes(context, position));
        write(context, force, &body.gravity());
    }
}
