//! Velocity of a position that is measured in steps or with noise.
//!
//! With what is left between the position and the predicted one, `r = x - (x̂ + h v̂)`:
//! `x̂ = x̂ + h v̂ + α r`, `v̂ = v̂ + β r / h` (the α-β filter; Brookner, *Tracking and Kalman Filtering Made Easy*, section
//! 1.2). Computed as `r = (x - x[k-1]) + (1 - α) r[k-1] - h v̂`: it has no large number to lose a small one in, so that the
//! velocity is as good at 1e5 rad as the position's own steps are. With `p = exp(-2 pi FREQUENCY h)`:
//!
//! | `METHOD` | α | β | Is |
//! |---|---|---|---|
//! | `TRACKING` | `1 - p²` | `(1 - p)²` | a tracking loop of second order, critically damped: both poles at `p` |
//! | `DIFFERENCE` | `1` | `1 - p` | the backward difference behind a low-pass of first order |
//! | `ALPHA_BETA` | `ALPHA` | `BETA` | what you say |
//!
//! `TRACKING` has no lag in position at constant velocity; its velocity lags by `2 / (2 pi FREQUENCY)`. It begins at the
//! position with velocity 0, or where it takes over with the velocity that was written last.
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
    /// What the gains follow from.
    pub enum Method { Tracking = "TRACKING", Difference = "DIFFERENCE", AlphaBeta = "ALPHA_BETA" }
}

words! {
    /// Of all axes.
    pub parameters Settings {
        /// What its gains follow from.
        method: Method = choice("METHOD"),
        period_s: f32,
    }
    /// Of an axis.
    pub parameters Gains {
        /// Corner frequency of TRACKING and DIFFERENCE.
        frequency_hz: f32 = per_axis("FREQUENCY", Unit::Hertz, 1e-2..=1e5, 50.0),
        /// Share of the position's correction.
        alpha: f32 = per_axis("ALPHA", Unit::One, 0.0..=1.0, 0.5),
        /// Share of the velocity's correction.
        beta: f32 = per_axis("BETA", Unit::One, 0.0..=2.0, 0.1),
        /// `1 - α`.
        kept: f32,
        /// `β / h`.
        velocity_gain: f32,
    }
    /// Of an axis.
    pub struct Axis {
        /// Position of the last tick.
        previous: f32,
        /// The same, less its estimate.
        error: f32,
        velocity: f32,
    }
    /// Signals.
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
        "Velocity by a tracking loop, a filtered difference or an alpha-beta filter.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type Axis = Axis;
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
            // As if the estimates had been right in the tick before.
            Axis { previous: x, error: period_s * velocity, velocity }
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
