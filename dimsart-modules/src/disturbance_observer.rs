//! Disturbance observer: estimates and compensates forces on the joint other than the commanded one.
//!
//! For a nominal joint `J v' = F + d` with `F` held between ticks, the mean of `d` over the last tick is
//! `J (v - v[k-1]) / h - F[k-1]`. It is filtered by `Q`, a first-order `1 / (1 + s/ω)` or second-order `1 / (1 + s/ω)²`
//! low-pass with exact poles, `ω = 2 pi FREQUENCY` (Ohnishi, Shibata & Murakami, *Motion Control for Advanced
//! Mechatronics*, 1996). `EXTERNAL_FORCE` is the estimate; it includes friction and all other dynamics not modelled by
//! `J`. `FEED_FORCE` is `-COMPENSATION` times the estimate, limited to `±LIMIT`.
//!
//! `F` is `DES_FORCE` of the previous tick including `FEED_FORCE`: bind the port to the force that the device receives,
//! and plug the module in before the module that writes it. The estimate starts at 0; on takeover, at the last output.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all DISTURBANCE_OBSERVER_MOD INERTIA 2
//!             all MOD_ENG MOD_ON DISTURBANCE_OBSERVER_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::VELOCITY, types::DES_FORCE], rows)?;
//! // 2 kg accelerate at 1 m/s² without any command: 2 N.
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
    /// Order of the low-pass `Q`.
    pub enum Order { First = "FIRST", Second = "SECOND" }
}

words! {
    /// Parameters common to all axes.
    pub parameters Settings { order: Order }
    /// Parameters of one axis.
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
    /// State of one axis.
    pub struct AxisState { previous_velocity: f32, first: f32, estimate: f32 }
    /// Ports.
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
    const SUMMARY: &'static str = "Disturbance observer: estimates and compensates external force.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn parameters(settings: &mut Settings, gains: &mut Gains, visit: &mut Parameters<'_>) {
        let Gains { inertia, frequency_hz, compensation, limit, .. } = gains;
        visit.per_axis(inertia, "INERTIA", Unit::Inertia, 1e-6..=1e4, 1.0, "Nominal inertia of the joint.");
        let summary = "Corner frequency of the low-pass.";
        visit.per_axis(frequency_hz, "FREQUENCY", Unit::Hertz, 1e-2..=1e4, 20.0, summary);
        visit.choice(&mut settings.order, "ORDER", "Order of the low-pass.");
        let summary = "Share of the estimate that FEED_FORCE compensates.";
        visit.per_axis(compensation, "COMPENSATION", Unit::One, 0.0..=1.0, 1.0, summary);
        visit.per_axis(
            limit,
            "LIMIT",
            Unit::Force,
            0.0..=1e4,
            1e4,
            "Maximum FEED_FORCE, in either direction.",
        );
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
            // Consistent with a correct estimate in the tick before.
            let previous_velocity = v - (force + estimate) / gains.inertia_per_tick;
            AxisState { previous_velocity, first: estimate, estimate }
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
