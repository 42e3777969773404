//! Minimum-jerk trajectory: moves to a target with the least mean square jerk (Flash & Hogan, *J. Neuroscience* 5(7),
//! 1985).
//!
//! From rest, `x = x_0 + D (10 s³ - 15 s⁴ + 6 s⁵)`, `s = t / T`. If the target changes during a move, a new move of
//! time `T` starts at the present position, velocity `v` and acceleration `a`, with the same polynomial in the
//! remaining time, `r = 1 - s`:
//!
//! `x = target + r³ (α + β r + γ r²)`, `α = -10 D + 4 v T + a T²/2`, `β = 15 D - 7 v T - a T²`,
//! `γ = -6 D + 3 v T + a T²/2`.
//!
//! `T = max(DURATION, 15/8 |D| / VELOCITY_LIMIT)`: a move from rest does not exceed the velocity limit.
//!
//! Initial state: at rest at the measured position; on takeover, the last commanded position and velocity.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all MINJERK_MOD TARGET 1\nall MINJERK_MOD DURATION 0.1
//!             all MOD_ENG MOD_ON MINJERK_MOD\nall MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION], rows)?;
//! let path: Vec<_> = (0..102).filter_map(|_| bench.tick(&[0.0], "DES_POSITION")).collect();
//! assert_eq!((path.get(50), path.last()), (Some(&0.5), Some(&1.0)));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use crate::take_over::first;
use crate::target::Source;
use dimsart_core::{Context, Declarations, DeviceDescriptor, Input, Module, Output, Unit, types, words};

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Duration of a move.
        duration_s: f32 = real("DURATION", Unit::Second, 1e-2..=1e4, 1.0),
        /// Source of the target: parameter TARGET or port TARGET.
        source: Source = structural_choice("TARGET_FROM"),
        period_s: f32,
    }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Target position.
        target: f32 = per_axis("TARGET", Unit::Position, -1e6..=1e6, 0.0),
        /// Maximum velocity of a move from rest; extends DURATION if needed.
        velocity_limit: f32 = per_axis("VELOCITY_LIMIT", Unit::Velocity, 1e-6..=1e6, 1e3),
    }
    /// State of one axis.
    pub struct AxisState {
        target: f32,
        ticks: u32,
        duration_s: f32,
        /// `1 / T`.
        rate_hz: f32,
        /// `α`, `β`, `γ`.
        terms: [f32; 3],
    }
    /// Ports.
    pub ports Ports {
        position: Input,
        target: Input,
        desired_position: Output,
        desired_velocity: Output,
        desired_acceleration: Output,
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct MinimumJerk;

impl Module for MinimumJerk {
    const NAME: &'static str = "MINJERK_MOD";
    const SUMMARY: &'static str = "Minimum-jerk trajectory to a target in a set time.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.period_s = device.sample_period_s();
    }

    fn ports(settings: &Settings, declare: &mut Declarations<'_>) -> Ports {
        Ports {
            position: declare.input("POSITION", types::POSITION),
            target: settings.source.port(declare),
            desired_position: declare.output("DES_POSITION", types::DES_POSITION),
            desired_velocity: declare.output("DES_VELOCITY", types::DES_VELOCITY),
            desired_acceleration: declare.output("DES_ACCELERATION", types::DES_ACCELERATION),
        }
    }

    fn begin(context: &Context<'_, Self>) {
        let Ports { position, desired_position, desired_velocity, .. } = context.ports();
        let Settings { duration_s, .. } = context.settings();
        let takes_over = context.takes_over();
        let inputs = [position, desired_position.last(), desired_velocity.last()];
        context.begin_axes(inputs, |gains, [x, last, last_velocity]| {
            let velocity = first(takes_over, last_velocity, 0.0);
            let mut axis = AxisState { target: first(takes_over, last, x), ..AxisState::default() };
            // A move to the present position, with the present velocity.
            axis.plan([axis.target, velocity, 0.0], axis.target, duration_s, gains.velocity_limit);
            axis
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { target, desired_position, desired_velocity, desired_acceleration, .. } = context.ports();
        let Settings { source, duration_s, period_s } = context.settings();
        let outputs = [desired_position, desired_velocity, desired_acceleration];
        context.map_axis_contexts([], outputs, |number, lane, []| {
            let (gains, mut axis) = (lane.gains(), lane.axis());
            let target = source.target(context, target, number, gains.target);
            let now = axis.now(period_s);
            if target.to_bits() != axis.target.to_bits() {
                axis.plan(now, target, duration_s, gains.velocity_limit);
            }
            axis.ticks = axis.ticks.saturating_add(1);
            lane.set_axis(axis);
            now
        });
    }
}

impl AxisState {
    #[inline(always)]
    fn plan(&mut self, [x, v, a]: [f32; 3], target: f32, duration_s: f32, velocity_limit: f32) {
        let distance = target - x;
        let duration_s = duration_s.max(1.875 * distance.abs() / velocity_limit);
        let (v, a) = (v * duration_s, 0.5 * a * duration_s * duration_s);
        self.terms = [
            4.0 * v + a - 10.0 * distance,
            15.0 * distance - 7.0 * v - 2.0 * a,
            3.0 * v + a - 6.0 * distance,
        ];
        (self.target, self.ticks, self.duration_s, self.rate_hz) = (target, 0, duration_s, 1.0 / duration_s);
    }

    /// Returns position, velocity and acceleration.
    #[inline(always)]
    fn now(&self, period_s: f32) -> [f32; 3] {
        let Self { target, ticks, duration_s, rate_hz, terms: [alpha, beta, gamma] } = *self;
        #[expect(clippy::cast_precision_loss, reason = "exact for hours")]
        let left_s = duration_s - ticks as f32 * period_s;
        let r = left_s.max(0.0) * rate_hz;
        let position = target + r * r * r * (alpha + r * (beta + r * gamma));
        let slope = r * r * (3.0 * alpha + r * (4.0 * beta + r * 5.0 * gamma));
        let bend = r * (6.0 * alpha + r * (12.0 * beta + r * 20.0 * gamma));
        [position, -slope * rate_hz, bend * rate_hz * rate_hz]
    }
}
