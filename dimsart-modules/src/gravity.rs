//! Gravity compensation: what holds an arm where it is.
//!
//! `F = g(q)`, the torque of the weight of everything beyond a joint (Craig, *Introduction to Robotics*, chapter 6). It goes to
//! `FEED_FORCE`, which a sum or a controller adds to what it commands. Friction and what the arm carries are not in it.
//! [`Planar`](crate::planar) and [`Phantom`](crate::phantom) say what the parameters are of.
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

use crate::dynamics::{Body, axes, links, write};
use dimsart_core::{Context, Input, Module, Output, ParameterSet, Parameters, types, words};

words! {
    /// Signals.
    pub ports Ports {
        position: Input = input("POSITION", types::POSITION),
        force: Output = output("FEED_FORCE", types::FEED_FORCE),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct GravityCompensation<B>(PhantomData<B>);

impl<B: Body> Module for GravityCompensation<B> {
    const NAME: &'static str = B::GRAVITY;
    const SUMMARY: &'static str = "Gravity compensation: the force that holds an arm against its weight.";
    type Settings = B::Settings;
    type Gains = B::Link;
    type State = ();
    type Axis = ();
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
