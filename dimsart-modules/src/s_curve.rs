//! S-curve trajectory: the fastest rest-to-rest move within limits of velocity, acceleration and jerk, in seven
//! segments.
//!
//! A velocity ramp of duration `T_a` has jerk for `T_j`, constant acceleration, and the opposite jerk for `T_j`. For
//! the distance `D` (Biagiotti & Melchiorri, *Trajectory Planning for Automatic Machines and Robots*, section 3.4):
//!
//! | case | `T_j` | `T_a` | at full velocity |
//! |---|---|---|---|
//! | `V J > A²` | `A / J` | `T_j + V / A` | `D / V - T_a` |
//! | otherwise | `sqrt(V / J)` | `2 T_j` | `D / V - T_a` |
//! | velocity limit not reached, `D >= 2 A³ / J²` | `A / J` | `T_j/2 + sqrt(T_j²/4 + D/A)` | 0 |
//! | acceleration limit not reached | `cbrt(D / (2 J))` | `2 T_j` | 0 |
//!
//! If the target changes during a move, the axis brakes within its limits and then moves to the new target: use this
//! module for moves, not to follow a continuously changing signal. With `SYNCHRONISED`, all axes arrive together: each
//! is slowed in time to the slowest one, and a new target of any axis brakes all.
//!
//! Initial state: at rest at the measured position; on takeover, at the last commanded one.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all SCURVE_MOD TARGET 2\nall SCURVE_MOD JERK_LIMIT 1000
//!             all MOD_ENG MOD_ON SCURVE_MOD\nall MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION], rows)?;
//! let path: Vec<_> = (0..1501).filter_map(|_| bench.tick(&[1.0], "DES_POSITION")).collect();
//! assert_eq!((path.first(), path.last()), (Some(&1.0), Some(&2.0)));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use crate::seven_segments::{Limits, SevenSegments};
use crate::take_over::first;
use crate::target::Source;
use dimsart_core::{Context, Declarations, DeviceDescriptor, Input, Module, Output, Unit, types, words};

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Source of the target: parameter TARGET or port TARGET.
        source: Source = structural_choice("TARGET_FROM"),
        /// Slow down axes so that all arrive together.
        is_synchronised: bool = flag("SYNCHRONISED", false),
        period_s: f32,
    }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Target position.
        target: f32 = per_axis("TARGET", Unit::Position, -1e6..=1e6, 0.0),
        /// Maximum velocity.
        velocity_limit: f32 = per_axis("VELOCITY_LIMIT", Unit::Velocity, 1e-6..=1e4, 1.0),
        /// Maximum acceleration.
        acceleration_limit: f32 = per_axis("ACCELERATION_LIMIT", Unit::Acceleration, 1e-6..=1e6, 10.0),
        /// Maximum jerk.
        jerk_limit: f32 = per_axis("JERK_LIMIT", Unit::Jerk, 1e-6..=1e8, 100.0),
    }
    /// State of one axis.
    pub struct AxisState {
        target: f32,
        start: f32,
        end: f32,
        ticks: u32,
        /// Time scale: 1, or less if another axis takes longer.
        pace: f32,
        segments: SevenSegments,
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
pub struct SCurve;

impl Module for SCurve {
    const NAME: &'static str = "SCURVE_MOD";
    const SUMMARY: &'static str = "S-curve trajectory: limited velocity, acceleration and jerk.";
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
        let Ports { position, desired_position, .. } = context.ports();
        let takes_over = context.takes_over();
        context.begin_axes([position, desired_position.last()], |_, [x, last]| {
            let start = first(takes_over, last, x);
            AxisState { target: start, start, end: start, ..AxisState::default() }
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { desired_position, desired_velocity, desired_acceleration, .. } = context.ports();
        let Settings { period_s, .. } = context.settings();
        aim(context);
        let outputs = [desired_position, desired_velocity, desired_acceleration];
        context.map_axes([], outputs, |_, axis, []| {
            let outputs = axis.now(period_s);
            axis.ticks = axis.ticks.saturating_add(1);
            outputs
        });
    }
}

/// Brakes axes with a new target, and plans moves for axes at rest.
#[inline(always)]
fn aim(context: &Context<'_, SCurve>) {
    let Settings { source, is_synchronised, period_s } = context.settings();
    let (mut is_new, mut all_rest, mut longest_s) = (false, true, 0.0_f32);
    context.map_axis_contexts([], [], |number, lane, []| {
        let mut axis = lane.axis();
        let target = source.target(context, context.ports().target, number, lane.gains().target);
        let has_new = target.to_bits() != axis.target.to_bits();
        if has_new && !is_synchronised {
            axis.brake(period_s);
        }
        axis.target = target;
        lane.set_axis(axis);
        is_new |= has_new;
        []
    });
    context.map_axes([], [], |gains, axis, []| {
        if is_new && is_synchronised {
            axis.brake(period_s);
        }
        let rests = axis.rests(period_s);
        all_rest &= rests;
        if rests && !is_synchronised {
            axis.set_off(&gains);
        }
        []
    });
    if !is_synchronised || !all_rest {
        return;
    }
    context.map_axes([], [], |gains, axis, []| {
        axis.set_off(&gains);
        longest_s = longest_s.max(axis.segments.duration_s());
        []
    });
    context.map_axes([], [], |_, axis, []| {
        let own_s = axis.segments.duration_s();
        axis.pace = if own_s < longest_s { own_s / longest_s } else { 1.0 };
        []
    });
}

impl AxisState {
    /// Returns the scaled time since the start of the move.
    #[inline(always)]
    fn time_s(&self, period_s: f32) -> f32 {
        #[expect(clippy::cast_precision_loss, reason = "exact for hours")]
        let ticks = self.ticks as f32;
        ticks * period_s * self.pace
    }

    #[inline(always)]
    fn rests(&self, period_s: f32) -> bool {
        self.time_s(period_s) >= self.segments.duration_s()
    }

    /// Plans the move from rest to the target.
    #[inline(always)]
    fn set_off(&mut self, gains: &Gains) {
        let distance = (self.target - self.end).abs();
        (self.start, self.end) = (self.end, self.target);
        (self.ticks, self.pace, self.segments) = (0, 1.0, SevenSegments::default());
        if distance > 0.0 {
            let limits = Limits {
                velocity: gains.velocity_limit,
                acceleration: gains.acceleration_limit,
                jerk: gains.jerk_limit,
            };
            self.segments = SevenSegments::over(distance, &limits);
        }
    }

    /// Shortens the move if it is not braking yet.
    #[inline(always)]
    fn brake(&mut self, period_s: f32) {
        let time_s = self.time_s(period_s);
        if time_s < 0.5 * self.segments.duration_s() {
            self.segments = self.segments.cut_at(time_s);
            let distance = self.segments.distance();
            self.end = self.start + if self.end < self.start { -distance } else { distance };
        }
    }

    /// Returns position, velocity and acceleration.
    #[inline(always)]
    fn now(&self, period_s: f32) -> [f32; 3] {
        let (time_s, duration_s) = (self.time_s(period_s), self.segments.duration_s());
        let side = if self.end < self.start { -self.pace } else { self.pace };
        let is_first_half = time_s < 0.5 * duration_s;
        let from_s = if is_first_half { time_s } else { (duration_s - time_s).max(0.0) };
        let [way, velocity, acceleration] = self.segments.first_half(from_s);
        let (way, velocity) = (if side < 0.0 { -way } else { way }, side * velocity);
        let acceleration = side * self.pace * acceleration;
        if is_first_half {
            [self.start + way, velocity, acceleration]
        } else if from_s > 0.0 {
            [self.end - way, velocity, -acceleration]
        } else {
            [self.end, 0.0, 0.0]
        }
    }
}
