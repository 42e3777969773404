//! Trapezoidal velocity profile: the fastest move to a target within limits of velocity and acceleration.
//!
//! Each tick recomputes the time-optimal motion from position `x` and velocity `v` to rest at the target and follows it
//! for one period, so the target can change at any time. With `d = target - x`, in the direction in which
//! `d >= v |v| / (2 A)` (Biagiotti & Melchiorri, *Trajectory Planning for Automatic Machines and Robots*, section 3.2):
//!
//! `w = min(V, sqrt(A d + v²/2))`: accelerate to `w` for `|w - v| / A`, keep it, brake for `w / A`.
//!
//! It arrives exactly and without overshoot, unless the target moves inside the braking distance; it then overshoots
//! and returns. `DES_ACCELERATION` is the mean over the following period; `DES_VELOCITY` and `DES_POSITION` are the
//! values at its start.
//!
//! With `SYNCHRONISED`, a move from rest follows a straight line on which all axes arrive together, slowed to the
//! slowest axis. If a target changes during the move, each axis continues at its own limits.
//!
//! Initial state: at rest at the measured position; on takeover, the last commanded position and velocity.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all TRAPEZOID_MOD TARGET 0.2\nall TRAPEZOID_MOD VELOCITY_LIMIT 1\nall TRAPEZOID_MOD ACCELERATION_LIMIT 10
//!             all MOD_ENG MOD_ON TRAPEZOID_MOD\nall MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION], rows)?;
//! assert_eq!(bench.tick(&[0.1], "DES_POSITION"), Some(0.1));
//! // It takes twice sqrt(0.1 m / 10 m/s²).
//! let path: Vec<_> = (0..201).filter_map(|_| bench.tick(&[0.1], "DES_POSITION")).collect();
//! assert_eq!(path.last(), Some(&0.2));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use crate::take_over::first;
use crate::target::Source;
use dimsart_core::math::{self, CompensatedSum};
use dimsart_core::{Context, Declarations, DeviceDescriptor, Input, Module, Output, Unit, types, words};

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Source of the target: parameter TARGET or port TARGET.
        source: Source = structural_choice("TARGET_FROM"),
        /// Slow down axes so that all arrive together, on a straight line.
        is_synchronised: bool = flag("SYNCHRONISED", false),
        period_s: f32,
        rate_hz: f32,
    }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Target position.
        target: f32 = per_axis("TARGET", Unit::Position, -1e6..=1e6, 0.0),
        /// Maximum velocity.
        velocity_limit: f32 = per_axis("VELOCITY_LIMIT", Unit::Velocity, 1e-6..=1e4, 1.0),
        /// Maximum acceleration.
        acceleration_limit: f32 = per_axis("ACCELERATION_LIMIT", Unit::Acceleration, 1e-6..=1e6, 1.0),
    }
    /// State of one axis.
    pub struct AxisState {
        /// Distance to the target.
        distance: CompensatedSum,
        velocity: CompensatedSum,
        target: f32,
        /// Limits on a line of several axes; `f32::MAX` for independent axes.
        line_velocity: f32,
        line_acceleration: f32,
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
pub struct Trapezoid;

impl Module for Trapezoid {
    const NAME: &'static str = "TRAPEZOID_MOD";
    const SUMMARY: &'static str = "Trapezoidal velocity profile to a target that can change at any time.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.period_s = device.sample_period_s();
        settings.rate_hz = 1.0 / settings.period_s;
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
        let takes_over = context.takes_over();
        let inputs = [position, desired_position.last(), desired_velocity.last()];
        context.begin_axes(inputs, |_, [x, last, last_velocity]| AxisState {
            target: first(takes_over, last, x),
            velocity: CompensatedSum::new(first(takes_over, last_velocity, 0.0)),
            line_velocity: f32::MAX,
            line_acceleration: f32::MAX,
            ..AxisState::default()
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { desired_position, desired_velocity, desired_acceleration, .. } = context.ports();
        let Settings { period_s, rate_hz, .. } = context.settings();
        aim(context);
        let outputs = [desired_position, desired_velocity, desired_acceleration];
        context.map_axes([], outputs, |gains, axis, []| {
            let (x, v) = (axis.target - axis.distance.value(), axis.velocity.value());
            let limits = (
                gains.velocity_limit.min(axis.line_velocity),
                gains.acceleration_limit.min(axis.line_acceleration),
            );
            step(axis, limits, period_s);
            [x, v, (axis.velocity.value() - v) * rate_hz]
        });
    }
}

/// Reads new targets and computes the limits of a straight line to them.
#[inline(always)]
fn aim(context: &Context<'_, Trapezoid>) {
    let Settings { source, is_synchronised, .. } = context.settings();
    let (mut is_new, mut moves) = (false, false);
    let (mut velocity, mut acceleration) = (f32::MAX, f32::MAX);
    context.map_axis_contexts([], [], |number, lane, []| {
        let (gains, mut axis) = (lane.gains(), lane.axis());
        let target = source.target(context, context.ports().target, number, gains.target);
        if target.to_bits() != axis.target.to_bits() {
            axis.distance.add(target - axis.target);
            axis.target = target;
            lane.set_axis(axis);
            is_new = true;
        }
        let distance = axis.distance.value().abs();
        moves |= axis.velocity.value() != 0.0;
        velocity = velocity.min(gains.velocity_limit / distance);
        acceleration = acceleration.min(gains.acceleration_limit / distance);
        []
    });
    if is_new {
        let is_line = is_synchronised && !moves;
        context.map_axes([], [], |_, axis, []| {
            let distance = axis.distance.value().abs();
            axis.line_velocity = if is_line { velocity * distance } else { f32::MAX };
            axis.line_acceleration = if is_line { acceleration * distance } else { f32::MAX };
            []
        });
    }
}

/// Follows the time-optimal motion for a period.
#[inline(always)]
fn step(axis: &mut AxisState, (velocity_limit, acceleration): (f32, f32), period_s: f32) {
    let (d, v) = (axis.distance.value(), axis.velocity.value());
    if d == 0.0 && v == 0.0 {
        return;
    }
    let per_acceleration = 1.0 / acceleration;
    let side = if d < 0.5 * v * v.abs() * per_acceleration { -1.0 } else { 1.0 };
    let (d, v) = (side * d, side * v);
    let top = math::sqrt(acceleration * d + 0.5 * v * v).min(velocity_limit);
    let speeding_s = (top - v).abs() * per_acceleration;
    if period_s <= speeding_s {
        let gained = math::limit(top - v, acceleration * period_s);
        axis.velocity.add(side * gained);
        axis.distance.add(-side * period_s * (v + 0.5 * gained));
        return;
    }
    let speeding = 0.5 * (v + top) * speeding_s;
    let braking = 0.5 * top * top * per_acceleration;
    // NaN for a top velocity of 0 becomes 0.
    let keeping_s = ((d - speeding - braking) / top).max(0.0);
    let left_s = period_s - speeding_s;
    if left_s <= keeping_s {
        axis.distance.add(-side * (speeding + top * left_s));
        axis.velocity = CompensatedSum::new(side * top);
        return;
    }
    let velocity = (top - acceleration * (left_s - keeping_s)).max(0.0);
    axis.velocity = CompensatedSum::new(side * velocity);
    axis.distance = CompensatedSum::new(side * 0.5 * velocity * velocity * per_acceleration);
}
