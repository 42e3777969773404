//! PID controller of two degrees of freedom: it answers the reference and a load each in its own way.
//!
//! `F = sat(K (b x_d - x) + I + D v + F_feed)` (Åström & Hägglund, *Advanced PID Control*, section 3.4): `I` integrates
//! `K_I (x_d - x)`, `v` is the slope of `c x_d - x` through a first-order low-pass, `v += (slope - v) h / (h + T_f)`. With
//! `b` below 1 a step of the reference overshoots less; with `c = 0` it does not kick.
//!
//! While the force limit or that of the device holds, `ANTI_WINDUP BACK_CALCULATION` bleeds `I` by `(sat(F) - F) h / T_t`; `CLAMPING` stops it where
//! the error would drive it further (section 3.5). `FEED_FORWARD ON` adds `FEED_FORCE` before the limit.
//!
//! Where it takes over, `I` begins with what the last force leaves for it, and makes up for the derivative, which takes two
//! ticks to be known; with `K_I = 0`, `I` begins with zero.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all PID2_MOD K_PARAM 100
//!             all PID2_MOD SETPOINT_WEIGHT 0.5
//!             all MOD_ENG MOD_ON PID2_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION, types::DES_POSITION], rows)?;
//! assert_eq!(bench.tick(&[0.25, 1.0], "DES_FORCE"), Some(25.0));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use crate::anti_windup::follow;
use crate::pid::Gains;
use dimsart_core::math::{self, CompensatedSum};
use dimsart_core::{
    Context, Declare, DeviceDescriptor, Input, Module, Output, Parameters, Unit, choice, types, words,
};

choice! {
    /// What stops the integral while the force limit holds.
    pub enum AntiWindup { BackCalculation = "BACK_CALCULATION", Clamping = "CLAMPING" }
}

words! {
    /// Of all axes.
    pub parameters Settings {
        setpoint_weight: f32,
        derivative_weight: f32,
        anti_windup: AntiWindup,
        tracking_time_s: f32,
        filter_time_s: f32,
        has_feed_forward: bool,
        /// `h / T_t`, at most 1.
        tracking: f32,
        /// `h / (h + T_f)`.
        smoothing: f32,
    }
    /// Of an axis.
    pub struct Axis {
        integral: CompensatedSum,
        /// Of the last tick.
        force: f32,
        /// `c x_d - x`.
        previous: f32,
        filtered_change: f32,
        /// Ticks left in which the integral makes up for the derivative.
        settling_ticks: u32,
    }
    /// Signals.
    pub ports Ports { position: Input, desired_position: Input, feed_force: Input, force: Output }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Pid2;

impl Module for Pid2 {
    const NAME: &'static str = "PID2_MOD";
    const SUMMARY: &'static str = "PID controller on position that weighs the reference, with feed-forward.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type Axis = Axis;
    type Ports = Ports;

    fn parameters(settings: &mut Settings, gains: &mut Gains, visit: &mut Parameters<'_>) {
        gains.parameters(visit);
        let summary = "Share of the reference in the proportional part.";
        visit.real(&mut settings.setpoint_weight, "SETPOINT_WEIGHT", Unit::One, 0.0..=2.0, 1.0, summary);
        let summary = "Share of the reference in the derivative part.";
        visit.real(&mut settings.derivative_weight, "DERIVATIVE_WEIGHT", Unit::One, 0.0..=2.0, 0.0, summary);
        let summary = "What stops the integral while the force limit holds.";
        visit.choice(&mut settings.anti_windup, "ANTI_WINDUP", summary);
        let Settings { tracking_time_s, filter_time_s, .. } = settings;
        let summary = "Time in which the integral follows a saturated force (BACK_CALCULATION).";
        visit.real(tracking_time_s, "TRACKING_TIME", Unit::Second, 1e-3..=100.0, 0.1, summary);
        let summary = "Time constant of the derivative's low-pass; 0 for none.";
        visit.real(filter_time_s, "FILTER_TIME", Unit::Second, 0.0..=10.0, 0.0, summary);
        let summary = "Whether FEED_FORCE is added.";
        visit.structural_flag(&mut settings.has_feed_forward, "FEED_FORWARD", false, summary);
    }

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        let h = device.sample_period_s();
        settings.tracking = (h / settings.tracking_time_s).min(1.0);
        settings.smoothing = h / (h + settings.filter_time_s);
    }

    fn prepare_axis(_: &Settings, gains: &mut Gains, device: &DeviceDescriptor) {
        gains.prepare(device.sample_period_s());
    }

    fn ports(settings: &Settings, declare: &mut Declare<'_>) -> Ports {
        let position = declare.input("POSITION", types::POSITION);
        let desired_position = declare.input("DES_POSITION", types::DES_POSITION);
        let feed_force = if settings.has_feed_forward {
            declare.input("FEED_FORCE", types::FEED_FORCE)
        } else {
            Input::default()
        };
        Ports { position, desired_position, feed_force, force: declare.output("DES_FORCE", types::DES_FORCE) }
    }

    fn begin(context: &Context<'_, Self>) {
        let Ports { position, desired_position, feed_force, force } = context.ports();
        let Settings { setpoint_weight, derivative_weight, .. } = context.settings();
        let takes_over = context.takes_over();
        context.map_lanes(
            [position, desired_position, force.last()],
            [],
            |number, lane, [x, desired, last]| {
                let gains = lane.gains();
                let previous = derivative_weight * desired - x;
                let axis = Axis { force: last, previous, ..Axis::default() };
                let others = gains.stiffness * (setpoint_weight * desired - x)
                    + gains.integral_gain_per_tick * (desired - x)
                    + context.axis(feed_force, number);
                let integral = math::limit(last, gains.limit) - others;
                let is_known = takes_over && gains.integral_gain > 0.0 && integral.is_finite();
                lane.set_axis(if is_known {
                    Axis { integral: CompensatedSum::new(integral), settling_ticks: 2, ..axis }
                } else {
                    axis
                });
                []
            },
        );
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { position, desired_position, feed_force, force } = context.ports();
        let settings = context.settings();
        let is_limited = context.is_limited();
        let inputs = [position, desired_position, force.last()];
        context.map_lanes(inputs, [force], |number, lane, [x, desired, given]| {
            let (gains, mut axis) = (lane.gains(), lane.axis());
            let tracking = follow(settings.tracking, gains.integral_gain_per_tick);
            // Of the last tick's force.
            let beyond_device = if is_limited { axis.force - given } else { 0.0 };
            if is_limited && settings.anti_windup == AntiWindup::BackCalculation {
                axis.integral.add(-tracking * beyond_device);
            }
            let weighed = settings.derivative_weight * desired - x;
            let change = weighed - axis.previous;
            axis.previous = weighed;
            axis.filtered_change += settings.smoothing * (change - axis.filtered_change);
            if axis.settling_ticks > 0 {
                axis.settling_ticks -= 1;
                axis.filtered_change = change;
                axis.integral.add(-gains.damping_per_tick * change);
            }
            let step = gains.integral_gain_per_tick * (desired - x);
            let before = axis.integral;
            let integral = axis.integral.add(step);
            let wanted = gains.stiffness * (settings.setpoint_weight * desired - x)
                + integral
                + gains.damping_per_tick * axis.filtered_change
                + context.axis(feed_force, number);
            let force = math::limit(wanted, gains.limit);
            let beyond = wanted - force;
            match settings.anti_windup {
                AntiWindup::BackCalculation => {
                    axis.integral.add(-tracking * beyond);
                }
                AntiWindup::Clamping if beyond * step > 0.0 || beyond_device * step > 0.0 => {
                    axis.integral = before
                }
                AntiWindup::Clamping => {}
            }
            axis.force = force;
            lane.set_axis(axis);
            [force]
        });
    }
}
