//! Collision detection by the momentum observer: estimates the external force on an arm without a force sensor.
//!
//! ```text
//! p = (M(q) + J_m) q'        r = K (p - p(0) - ∫ (tau + Cᵀ q' - g - b q' + r) dt)        K = 2π BANDWIDTH
//! ```
//!
//! `r` is the external force on each joint, filtered by a first-order low-pass of `BANDWIDTH`; no acceleration is
//! needed (A. De Luca, R. Mattone, "Actuator failure detection and isolation using generalized momenta", ICRA 2003; S.
//! Haddadin, A. De Luca, A. Albu-Schäffer, T-RO 33(6), 2017). `CONDITION` of an axis is 1 while `|r|` exceeds its
//! `THRESHOLD`. The sum uses the torque commanded at the start of the interval and the new `r`, so it is stable for any
//! bandwidth. Dry friction, torque errors of the motor and wrong masses also appear in `r`: set `THRESHOLD` above them.
//! For the other parameters see [`PlanarDynamics`](crate::planar) and [`Phantom`](crate::phantom).
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
//! assert_eq!(bench.tick(&[0.0, 0.1, 0.0], "CONDITION"), Some(1.0)); // a jerk without any torque
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use core::marker::PhantomData;

use crate::dynamics::{ArmDynamics, axes, links};
use dimsart_core::{
    Context, DeviceDescriptor, Input, Module, Output, ParameterSet, Parameters, Unit, types, words,
};

words! {
    /// Parameters of one axis.
    pub parameters Observe {
        /// Bandwidth of the estimated external force.
        bandwidth: f32 = per_axis("BANDWIDTH", Unit::Hertz, 0.01..=1e3, 10.0),
        /// External force above which CONDITION reports a collision.
        threshold: f32 = per_axis("THRESHOLD", Unit::Force, 0.0..=1e4, 1e4),
        /// Inertia of the motor, reflected to the joint.
        motor_inertia: f32 = per_axis("MOTOR_INERTIA", Unit::Inertia, 0.0..=1e4, 0.0),
        /// Viscous friction of the joint.
        viscous: f32 = per_axis("VISCOUS", Unit::Damping, 0.0..=1e4, 0.0),
        /// `K / (1 + h K)`.
        gain: f32,
        period_s: f32,
    }
    /// State of one axis.
    pub struct AxisState {
        /// Momentum explained by the known forces.
        explained: f32,
        /// Known forces other than the commanded one, one tick ago.
        rate: f32,
        /// Force commanded one tick ago.
        force: f32,
    }
    /// Ports.
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

impl<B: ArmDynamics> Module for Collision<B> {
    const NAME: &'static str = B::COLLISION;
    const SUMMARY: &'static str = "Collision detection: external force on an arm by a momentum observer.";
    type Settings = B::Settings;
    type Gains = (Observe, B::Link);
    type State = ();
    type AxisState = AxisState;
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
            // The first interval is unknown and must add nothing.
            AxisState { explained, rate, force: -rate }
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

/// Returns for each axis the momentum and `Cᵀ q' - g - b q'`.
fn motion<B: ArmDynamics>(context: &Context<'_, Collision<B>>) -> impl Iterator<Item = (f32, f32)> {
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
