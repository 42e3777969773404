//! Collision detection by the generalised momentum: what the world does to an arm, without a sensor of forces.
//!
//! ```text
//! p = (M(q) + J_m) q'        r = K (p - p(0) - ∫ (tau + Cᵀ q' - g - b q' + r) dt)        K = 2π BANDWIDTH
//! ```
//!
//! `r` is the force of the world on each joint through a first-order low-pass of that bandwidth; no acceleration is needed
//! (A. De Luca, R. Mattone, "Actuator failure detection and isolation using generalized momenta", ICRA 2003; S. Haddadin,
//! A. De Luca, A. Albu-Schäffer, T-RO 33(6), 2017). `CONDITION` is 1 on an axis while `|r|` is beyond its `THRESHOLD`. The
//! torque of an interval is the one commanded at its start, `r` in the sum is the new one, so that it is stable for every
//! bandwidth. Dry friction, a torque that the motor does not make and wrong masses look like a force of the world:
//! `THRESHOLD` has to be beyond them. [`Planar`](crate::planar) and [`Phantom`](crate::phantom) say what the other
//! parameters are of.
//!
//! ```
//! # use dimsart_core::{Bench, types};
//! let rows = "all PLANAR_COLLISION_MOD INERTIA 0.5
//!             all PLANAR_COLLISION_MOD THRESHOLD 2
//!             all MOD_ENG MOD_ON PLANAR_COLLISION_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let measured = &[types::POSITION, types::VELOCITY, types::DES_FORCE];
//! let mut bench = Bench::new(dimsart_modules::ALL, measured, rows)?;
//! assert_eq!(bench.tick(&[0.0, 0.0, 0.0], "CONDITION"), Some(0.0));
//! assert_eq!(bench.tick(&[0.0, 0.1, 0.0], "CONDITION"), Some(1.0)); // a jerk that no torque made
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use core::marker::PhantomData;

use crate::dynamics::{Body, axes, links};
use dimsart_core::{
    Context, DeviceDescriptor, Input, Module, Output, ParameterSet, Parameters, Unit, types, words,
};

words! {
    /// Of an axis.
    pub parameters Observe {
        /// Of the observed force.
        bandwidth: f32 = per_axis("BANDWIDTH", Unit::Hertz, 0.01..=1e3, 10.0),
        /// Force of the world that counts as a collision.
        threshold: f32 = per_axis("THRESHOLD", Unit::Force, 0.0..=1e4, 1e4),
        /// Of the motor, seen from the joint.
        motor_inertia: f32 = per_axis("MOTOR_INERTIA", Unit::Inertia, 0.0..=1e4, 0.0),
        /// Viscous friction of the joint.
        viscous: f32 = per_axis("VISCOUS", Unit::Damping, 0.0..=1e4, 0.0),
        /// `K / (1 + h K)`.
        gain: f32,
        period_s: f32,
    }
    /// Of an axis.
    pub struct Axis {
        /// The momentum that the known forces have made.
        explained: f32,
        /// Of the known forces but the commanded one, a tick ago.
        rate: f32,
        /// Commanded a tick ago.
        force: f32,
    }
    /// Signals.
    pub ports Ports {
        position: Input = input("POSITION", types::POSITION),
        velocity: Input = input("VELOCITY", types::VELOCITY),
        commanded: Input = late().input("DES_FORCE", types::DES_FORCE),
        force: Output = output("EXTERNAL_FORCE", types::EXTERNAL_FORCE),
        condition: Output = output("CONDITION", types::CONDITION),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Collision<B>(PhantomData<B>);

impl<B: Body> Module for Collision<B> {
    const NAME: &'static str = B::COLLISION;
    const SUMMARY: &'static str = "Collision detection: force of the world on an arm by its momentum.";
    type Settings = B::Settings;
    type Gains = (Observe, B::Link);
    type State = ();
    type Axis = Axis;
    type Ports = Ports;

    fn parameters(settings: &mut B::Settings, (observe, link): &mut Self::Gains, visit: &mut Parameters<'_>) {
        observe.visit(visit);
        settings.visit(visit);
        link.visit(visit);
    }

    fn prepare_axis(_: &B::Settings, (observe, _): &mut Self::Gains, device: &DeviceDescriptor) {
        let rate = core::f32::consts::TAU * observe.bandwidth;
        observe.period_s = device.sample_period_s();
        observe.gain = rate / (1.0 + observe.period_s * rate);
    }

    fn begin(context: &Context<'_, Self>) {
        let mut found = motion(context);
        context.begin_axes([context.ports().position], |_, _| {
            let (explained, rate) = found.next().unwrap_or_default();
            // So that the first interval, which nobody saw, adds nothing.
            Axis { explained, rate, force: -rate }
        });
    }

    fn compute(context: &Context<'_, Self>) {
        let Ports { position, force, condition, .. } = context.ports();
        let mut found = motion(context);
        context.map_axes([position], [force, condition], |(observe, _), axis, _| {
            let (momentum, rate) = found.next().unwrap_or_default();
            axis.explained += observe.period_s * (axis.force + 0.5 * (rate + axis.rate));
            let residual = observe.gain * (momentum - axis.explained);
            axis.explained += observe.period_s * residual;
            axis.rate = rate;
            [residual, if residual.abs() > observe.threshold { 1.0 } else { 0.0 }]
        });
    }

    fn compute_late(context: &Context<'_, Self>) {
        context.map_axes([context.ports().commanded], [], |_, axis, [commanded]| {
            axis.force = commanded;
            []
        });
    }
}

/// Of each axis: the momentum, and `Cᵀ q' - g - b q'`.
fn motion<B: Body>(context: &Context<'_, Collision<B>>) -> impl Iterator<Item = (f32, f32)> {
    let Ports { position, velocity, .. } = context.ports();
    let links = links(context, position, |(_, link)| link);
    let body = B::at(context.settings(), &links, &axes(context, position));
    let (mut momentum, mut rate) = body.momentum(&axes(context, velocity));
    let mut weights = body.gravity().into_iter();
    let mut places = momentum.iter_mut().zip(&mut rate);
    context.map_axes([velocity], [], |(observe, _), _, [v]| {
        if let Some((momentum, rate)) = places.next() {
            *momentum += observe.motor_inertia * v;
            *rate -= observe.viscous * v + weights.next().unwrap_or(0.0);
        }
        []
    });
    momentum.into_iter().zip(rate)
}
