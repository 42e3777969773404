//! Disturbance observer: what else pushes the joint than its controller.
//!
//! Of the nominal joint `J v' = F + d` with `F` held from tick to tick, the mean of `d` over the last tick is
//! `J (v - v[k-1]) / h - F[k-1]`; that goes through the low-pass `Q` of first order, `1 / (1 + s/ω)`, or of second, `1 / (1 + s/ω)²`,
//! `ω = 2 pi FREQUENCY`, with its exact pole (Ohnishi, Shibata & Murakami, *Motion Control for Advanced Mechatronics*, 1996).
//! `EXTERNAL_FORCE` is the estimate, with everything in it that `J` does not say, friction too; `FEED_FORCE` is
//! `-COMPENSATION` times it, held inside `±LIMIT`.
//!
//! `F` is what `DES_FORCE` was in the tick before, `FEED_FORCE` included: bind the port to what the device takes, and plug the
//! module in before the one that writes it. It begins
//! with an estimate of 0, or where it takes over with the one that was written last.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all DISTURBANCE_OBSERVER_MOD INERTIA 2
//!             all MOD_ENG MOD_ON DISTURBANCE_OBSERVER_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::VELOCITY, types::DES_FORCE], rows)?;
//! // 2 kg that go faster by 1 m/s each second while nobody commands anything: 2 N.
//! let ramp = (0..1000_u16).map(|tick| f32::from(tick) / 1000.0);
//! let last = ramp.filter_map(|v| bench.tick(&[v, 0.0], "EXTERNAL_FORCE")).last().unwrap_or_default();
//! assert!((last - 2.0).abs() < 1e-3, "{last}");
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use core::f32::consts::TAU;

use crate::lag;
use crate::take_over::first;
use dimsart_core::{
    Context, DeviceDescriptor, Input, Module, Output, Parameters, Unit, choice, math, types, words,
};

choice! {
    /// Order of `Q`.
    pub enum Order { First = "FIRST", Second = "SECOND" }
}

words! {
    /// Of all axes.
    pub parameters Settings { order: Order }
    /// Of an axis.
    pub parameters Gains {
        inertia: f32,
        frequency_hz: f32,
        compensation: f32,
        limit: f32,
        /// `J / h`.
        inertia_per_tick: f32,
        /// `1 - exp(-ω h)`.
        share: f32,
    }
    /// Of an axis.
    pub struct Axis { previous_velocity: f32, first: f32, estimate: f32 }
    /// Signals.
    pub ports Ports {
        velocity: Input = input("VELOCITY", types::VELOCITY),
        force: Input = delayed().input("DES_FORCE", types::DES_FORCE),
        feed_force: Output = output("FEED_FORCE", types::FEED_FORCE),
        external_force: Output = output("EXTERNAL_FORCE", types::EXTERNAL_FORCE),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct DisturbanceObserver;

impl Module for DisturbanceObserver {
    const NAME: &'static str = "DISTURBANCE_OBSERVER_MOD";
    const SUMMARY: &'static str = "Observes what else pushes the joint, and the force against it.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type Axis = Axis;
    type Ports = Ports;

    fn parameters(settings: &mut Settings, gains: &mut Gains, visit: &mut Parameters<'_>) {
        let Gains { inertia, frequency_hz, compensation, limit, .. } = gains;
        visit.per_axis(inertia, "INERTIA", Unit::Inertia, 1e-6..=1e4, 1.0, "Nominal inertia of the joint.");
        let summary = "Corner frequency of the observer.";
        visit.per_axis(frequency_hz, "FREQUENCY", Unit::Hertz, 1e-2..=1e4, 20.0, summary);
        visit.choice(&mut settings.order, "ORDER", "Order of the observer's low-pass.");
        let summary = "Share of the estimate that FEED_FORCE works against.";
        visit.per_axis(compensation, "COMPENSATION", Unit::One, 0.0..=1.0, 1.0, summary);
        visit.per_axis(limit, "LIMIT", Unit::Force, 0.0..=1e4, 1e4, "Largest FEED_FORCE either way.");
    }

    fn prepare_axis(_: &Settings, gains: &mut Gains, device: &DeviceDescriptor) {
        let h = device.sample_period_s();
        gains.inertia_per_tick = gains.inertia / h;
        gains.share = lag::share(TAU * gains.frequency_hz * h);
    }

    fn begin(context: &Context<'_, Self>) {
        let Ports { velocity, force, external_force, .. } = context.ports();
        let takes_over = context.takes_over();
        context.begin_axes([velocity, force, external_force.last()], |gains, [v, force, last]| {
            let estimate = first(takes_over, last, 0.0);
            // As if the estimate had been right in the tick before.
            let previous_velocity = v - (force + estimate) / gains.inertia_per_tick;
            Axis { previous_velocity, first: estimate, estimate }
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { velocity, force, feed_force, external_force } = context.ports();
        let Settings { order } = context.settings();
        context.map_axes([velocity, force], [feed_force, external_force], |gains, axis, [v, force]| {
            let disturbance = gains.inertia_per_tick * (v - axis.previous_velocity) - force;
            axis.previous_velocity = v;
            axis.first += gains.share * (disturbance - axis.first);
            match order {
                Order::First => axis.estimate = axis.first,
                Order::Second => axis.estimate += gains.share * (axis.first - axis.estimate),
            }
            [math::limit(-gains.compensation * axis.estimate, gains.limit), axis.estimate]
        });
    }
}
