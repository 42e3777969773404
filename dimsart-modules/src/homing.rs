//! Homing: finds the reference position of a joint with an incremental encoder by driving it to a stop or a switch.
//!
//! | `STATE` | desired position | next state |
//! |---|---|---|
//! | 0 searching | moves at `HOMING_VELOCITY` | 1 at the stop, 3 after `SEARCH_DISTANCE` |
//! | 1 backing off | moves back at the same speed | 2 after `BACK_OFF` |
//! | 2 homed | holds | |
//! | 3 not found | holds | |
//!
//! The stop is detected while `|FORCE| > STALL_FORCE` for `STALL_TIME`, or while `CONDITION` is above 0.5 for the same
//! time (`STOP_BY`). Its position is `HOME_POSITION`: `HOMED_POSITION` is the measured position plus an offset, which
//! is 0 until the stop is found. The axes are homed independently.
//!
//! The search starts at the measured position; on takeover, at the last commanded one. Each reset restarts the homing.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all HOMING_MOD STOP_BY CONDITION\nall HOMING_MOD HOME_POSITION -0.5\nall HOMING_MOD STALL_TIME 0
//!             all MOD_ENG MOD_ON HOMING_MOD\nall MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION, types::CONDITION], rows)?;
//! assert_eq!(bench.tick(&[0.2, 0.0], "STATE"), Some(0.0));
//! assert_eq!(bench.tick(&[0.2, 1.0], "POSITION.2"), Some(-0.5));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use crate::take_over::first;
use dimsart_core::math::{self, CompensatedSum};
use dimsart_core::{
    Context, Declarations, DeviceDescriptor, Input, Module, Output, Unit, choice, types, words,
};

choice! {
    /// Detection of the stop.
    pub enum StopDetection { Force = "FORCE", Condition = "CONDITION" }
}

const SEARCHES: u16 = 0;
const BACKS_OFF: u16 = 1;
const HOMED: u16 = 2;
const FOUND_NOTHING: u16 = 3;

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Detect the stop by force or by a condition (switch).
        stop_by: StopDetection = structural_choice("STOP_BY"),
        /// Time for which the stop must be detected.
        stall_time_s: f32 = real("STALL_TIME", Unit::Second, 0.0..=10.0, 0.05),
        period_s: f32,
    }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Search velocity; its sign is the direction to the stop.
        velocity: f32 = per_axis("HOMING_VELOCITY", Unit::Velocity, -1e3..=1e3, -0.05),
        /// Distance to back off from the stop.
        back_off: f32 = per_axis("BACK_OFF", Unit::Position, 0.0..=1e3, 0.01),
        /// Maximum search distance.
        search_distance: f32 = per_axis("SEARCH_DISTANCE", Unit::Position, 0.0..=1e6, 10.0),
        /// Force above which the joint is at the stop.
        stall_force: f32 = per_axis("STALL_FORCE", Unit::Force, 0.0..=1e4, 1.0),
        /// Position to assign to the stop.
        home_position: f32 = per_axis("HOME_POSITION", Unit::Position, -1e6..=1e6, 0.0),
        step: f32,
    }
    /// State of one axis.
    pub struct AxisState { state: u16, desired: CompensatedSum, gone: CompensatedSum, stalled_s: f32, offset: f32 }
    /// Ports.
    pub ports Ports { position: Input, sign: Input, desired_position: Output, homed: Output, state: Output }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Homing;

impl Module for Homing {
    const NAME: &'static str = "HOMING_MOD";
    const SUMMARY: &'static str = "Homing: drives a joint to a stop or switch and sets its position.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.period_s = device.sample_period_s();
    }

    fn prepare_axis(settings: &Settings, gains: &mut Gains, _: &DeviceDescriptor) {
        gains.step = gains.velocity * settings.period_s;
    }

    fn ports(settings: &Settings, declare: &mut Declarations<'_>) -> Ports {
        let homed = types::POSITION.instance(2);
        Ports {
            position: declare.input("POSITION", types::POSITION),
            sign: match settings.stop_by {
                StopDetection::Force => declare.input("FORCE", types::MEASURED_TORQUE),
                StopDetection::Condition => declare.input("CONDITION", types::CONDITION),
            },
            desired_position: declare.output("DES_POSITION", types::DES_POSITION),
            homed: declare.default_signal(homed).output("HOMED_POSITION", types::POSITION),
            state: declare.output("STATE", types::STATE),
        }
    }

    fn begin(context: &Context<'_, Self>) {
        let Ports { position, desired_position, .. } = context.ports();
        let takes_over = context.takes_over();
        context.begin_axes([position, desired_position.last()], |_, [x, last]| AxisState {
            desired: CompensatedSum::new(first(takes_over, last, x)),
            ..AxisState::default()
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { position, sign, desired_position, homed, state } = context.ports();
        let Settings { stop_by, stall_time_s, period_s } = context.settings();
        context.map_axes([position, sign], [desired_position, homed, state], |gains, axis, [x, sign]| {
            let is_there = match stop_by {
                StopDetection::Force => sign.abs() > gains.stall_force,
                StopDetection::Condition => sign > 0.5,
            };
            axis.stalled_s = if is_there { axis.stalled_s + period_s } else { 0.0 };
            match axis.state {
                SEARCHES if is_there && axis.stalled_s > stall_time_s => {
                    axis.offset = gains.home_position - x;
                    // The desired position can be far past the stop by now.
                    axis.desired = CompensatedSum::new(x);
                    (axis.state, axis.gone) = (BACKS_OFF, CompensatedSum::new(0.0));
                }
                SEARCHES if axis.gone.value() >= gains.search_distance => axis.state = FOUND_NOTHING,
                SEARCHES => axis.go(gains.step),
                BACKS_OFF if axis.gone.value() >= gains.back_off => axis.state = HOMED,
                BACKS_OFF => {
                    let left = gains.back_off - axis.gone.value();
                    axis.go(math::limit(-gains.step, left));
                }
                _ => {}
            }
            [axis.desired.value(), x + axis.offset, f32::from(axis.state)]
        });
    }
}

impl AxisState {
    #[inline(always)]
    fn go(&mut self, step: f32) {
        self.desired.add(step);
        self.gone.add(step.abs());
    }
}
