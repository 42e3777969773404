//! PID controller with two degrees of freedom (setpoint weighting) and feed-forward.
//!
//! `F = sat(K (b x_d - x) + I + D v + F_feed)` (Åström & Hägglund, *Advanced PID Control*, section 3.4). `I` integrates
//! `K_I (x_d - x)`; `v` is the derivative of `c x_d - x` through a first-order low-pass,
//! `v += (slope - v) h / (h + T_f)`. `b` below 1 reduces overshoot after a step of the reference; `c = 0` avoids the
//! derivative kick.
//!
//! While the module's or the device's force limit is active, `ANTI_WINDUP BACK_CALCULATION` corrects `I` by
//! `(sat(F) - F) h / T_t`; `CLAMPING` stops the integration in the direction of the limit (section 3.5).
//! `FEED_FORWARD ON` adds `FEED_FORCE` before the limit.
//!
//! On takeover, `I` starts with the value that continues the last force and compensates the derivative during its first
//! two ticks; with `K_I = 0`, `I` starts at zero.
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
    Context, Declarations, DeviceDescriptor, Input, Module, Output, Parameters, Unit, choice, types, words,
};

choice! {
    /// Anti-windup method.
    pub enum AntiWindup { BackCalculation = "BACK_CALCULATION", Clamping = "CLAMPING" }
}

words! {
    /// Parameters common to all axes.
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
    /// State of one axis.
    pub struct AxisState {
        integral: CompensatedSum,
        /// Force of the last tick.
        force: f32,
        /// `c x_d - x`.
        previous: f32,
        filtered_change: f32,
        /// Ticks left in which the integral compensates the derivative.
        settling_ticks: u32,
    }
    /// Ports.
    pub ports Ports { position: Input, desired_position: Input, feed_force: Input, force: Output }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Pid2;

impl Module for Pid2 {
    const NAME: &'static str = "PID2_MOD";
    const SUMMARY: &'static str = "PID controller on position with setpoint weighting and feed-forward.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn parameters(settings: &mut Settings, gains: &mut Gains, visit: &mut Parameters<'_>) {
        gains.parameters(visit);
        let summary = "Setpoint weight b of the proportional part.";
        visit.real(&mut settings.setpoint_weight, "SETPOINT_WEIGHT", Unit::One, 0.0..=2.0, 1.0, summary);
        let summary = "Setpoint weight c of the derivative part.";
        visit.real(&mut settings.derivative_weight, "DERIVATIVE_WEIGHT", Unit::One, 0.0..=2.0, 0.0, summary);
        let summary = "Anti-windup method of the integral.";
        visit.choice(&mut settings.anti_windup, "ANTI_WINDUP", summary);
        let Settings { tracking_time_s, filter_time_s, .. } = settings;
        let summary = "Anti-windup tracking time of BACK_CALCULATION.";
        visit.real(tracking_time_s, "TRACKING_TIME", Unit::Second, 1e-3..=100.0, 0.1, summary);
        let summary = "Time constant of the derivative's low-pass; 0: no filter.";
        visit.real(filter_time_s, "FILTER_TIME", Unit::Second, 0.0..=10.0, 0.0, summary);
        let summary = "Add FEED_FORCE to the output.";
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

    fn ports(settings: &Settings, declare: &mut Declarations<'_>) -> Ports {
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
        context.map_axis_contexts(
            [position, desired_position, force.last()],
            [],
            |number, lane, [x, desired, last]| {
                let gains = lane.gains();
                let previous = derivative_weight * desired - x;
                let axis = AxisState { force: last, previous, ..AxisState::default() };
                let others = gains.stiffness * (setpoint_weight * desired - x)
                    + gains.integral_gain_per_tick * (desired - x)
                    + context.axis(feed_force, number);
                let integral = math::limit(last, gains.limit) - others;
                let is_known = takes_over && gains.integral_gain > 0.0 && integral.is_finite();
                lane.set_axis(if is_known {
                    AxisState { integral: CompensatedSum::new(integral), settling_ticks: 2, ..axis }
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
        context.map_axis_contexts(inputs, [force], |number, lane, [x, desired, given]| {
            let (gains, mut axis) = (lane.gains(), lane.axis());
            let tracking = follow(settings.tracking, gains.integral_gain_per_tick);
            // Part of the last tick's force that the device limited.
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
