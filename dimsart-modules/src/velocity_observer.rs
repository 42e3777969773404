//! Velocity observer for a quantised or noisy position.
//!
//! With the prediction error `r = x - (x̂ + h v̂)`: `x̂ = x̂ + h v̂ + α r`, `v̂ = v̂ + β r / h` (α-β filter; Brookner,
//! *Tracking and Kalman Filtering Made Easy*, section 1.2). It is computed as
//! `r = (x - x[k-1]) + (1 - α) r[k-1] - h v̂`, without large numbers, so the velocity at 1e5 rad is as precise as the
//! position. With `p = exp(-2 pi FREQUENCY h)`:
//!
//! | `METHOD` | α | β | Type |
//! |---|---|---|---|
//! | `TRACKING` | `1 - p²` | `(1 - p)²` | critically damped second-order tracking loop: both poles at `p` |
//! | `DIFFERENCE` | `1` | `1 - p` | backward difference with a first-order low-pass |
//! | `ALPHA_BETA` | `ALPHA` | `BETA` | set by the parameters |
//!
//! `TRACKING` has no position lag at constant velocity; its velocity lags by `2 / (2 pi FREQUENCY)`. Initial state: the
//! measured position with velocity 0; on takeover, with the last velocity output.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all MOD_ENG MOD_ON VELOCITY_OBSERVER_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION], rows)?;
//! let ramp = (0..200_u8).map(|tick| f32::from(tick) / 512.0);
//! let last = ramp.filter_map(|x| bench.tick(&[x], "VELOCITY")).last().unwrap_or_default();
//! assert!((last - 1000.0 / 512.0).abs() < 1e-3, "{last}");
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use core::f32::consts::TAU;

use crate::lag;
use crate::take_over::first;
use dimsart_core::{
    Context, DeviceDescriptor, Input, Module, Output, ParameterSet, Parameters, Unit, choice, types, words,
};

choice! {
    /// Observer method.
    pub enum Method { Tracking = "TRACKING", Difference = "DIFFERENCE", AlphaBeta = "ALPHA_BETA" }
}

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Observer method.
        method: Method = choice("METHOD"),
        period_s: f32,
    }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Corner frequency of TRACKING and DIFFERENCE.
        frequency_hz: f32 = per_axis("FREQUENCY", Unit::Hertz, 1e-2..=1e5, 50.0),
        /// Position gain of ALPHA_BETA.
        alpha: f32 = per_axis("ALPHA", Unit::One, 0.0..=1.0, 0.5),
        /// Velocity gain of ALPHA_BETA.
        beta: f32 = per_axis("BETA", Unit::One, 0.0..=2.0, 0.1),
        /// `1 - α`.
        kept: f32,
        /// `β / h`.
        velocity_gain: f32,
    }
    /// State of one axis.
    pub struct AxisState {
        /// Position of the last tick.
        previous: f32,
        /// Position minus its estimate.
        error: f32,
        velocity: f32,
    }
    /// Ports.
    pub ports Ports {
        position: Input = input("POSITION", types::POSITION),
        velocity: Output = output("VELOCITY", types::VELOCITY),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct VelocityObserver;

impl Module for VelocityObserver {
    const NAME: &'static str = "VELOCITY_OBSERVER_MOD";
    const SUMMARY: &'static str =
        "Velocity observer: tracking loop, filtered difference or alpha-beta filter.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn parameters(settings: &mut Settings, gains: &mut Gains, visit: &mut Parameters<'_>) {
        settings.visit(visit);
        gains.visit(visit);
    }

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.period_s = device.sample_period_s();
    }

    fn prepare_axis(settings: &Settings, gains: &mut Gains, _: &DeviceDescriptor) {
        let share = lag::share(TAU * gains.frequency_hz * settings.period_s);
        let (kept, beta) = match settings.method {
            Method::Tracking => ((1.0 - share) * (1.0 - share), share * share),
            Method::Difference => (0.0, share),
            Method::AlphaBeta => (1.0 - gains.alpha, gains.beta),
        };
        (gains.kept, gains.velocity_gain) = (kept, beta / settings.period_s);
    }

    fn begin(context: &Context<'_, Self>) {
        let Ports { position, velocity } = context.ports();
        let Settings { period_s, .. } = context.settings();
        let takes_over = context.takes_over();
        context.begin_axes([position, velocity.last()], |_, [x, last]| {
            let velocity = first(takes_over, last, 0.0);
            // Consistent with correct estimates in the tick before.
            AxisState { previous: x, error: period_s * velocity, velocity }
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { position, velocity } = context.ports();
        let Settings { period_s, .. } = context.settings();
        context.map_axes([position], [velocity], |gains, axis, [x]| {
            let beyond = (x - axis.previous) + axis.error - period_s * axis.velocity;
            axis.previous = x;
            axis.error = gains.kept * beyond;
            axis.velocity += gains.velocity_gain * beyond;
            [axis.velocity]
        });
    }
}
