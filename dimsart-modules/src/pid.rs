//! PID controller on position with anti-windup and filtered derivative.
//!
//! `F = sat(K e + I + D v)`. `I` integrates `K_I e` and is corrected by `(sat(F) - F) h / T_t` (back-calculation,
//! Åström & Hägglund, *Advanced PID Control*, section 3.5), so that it does not wind up while the module's or the
//! device's force limit is active. `v` is the derivative of the error through a first-order low-pass,
//! `v += (slope - v) h / (h + T_f)`.
//!
//! On takeover from another module, `I` starts with the value that continues the last force without a step. With
//! `K_I = 0` that value would never decay, so `I` starts at zero.

use crate::anti_windup::follow;
use dimsart_core::math::{self, CompensatedSum};
use dimsart_core::{Context, DeviceDescriptor, Input, Module, Output, Parameters, Unit, types, words};

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        tracking_time_s: f32,
        filter_time_s: f32,
        /// `h / T_t`, at most 1.
        tracking: f32,
        /// `h / (h + T_f)`.
        smoothing: f32,
    }
    /// Parameters of one axis.
    pub parameters Gains {
        pub(super) stiffness: f32,
        pub(super) integral_gain: f32,
        damping: f32,
        pub(super) limit: f32,
        /// `K_I h`.
        pub(super) integral_gain_per_tick: f32,
        /// `D / h`.
        pub(super) damping_per_tick: f32,
    }
    /// State of one axis.
    pub struct AxisState {
        integral: CompensatedSum,
        /// Force of the last tick.
        force: f32,
        previous_error: f32,
        filtered_change: f32,
        /// Ticks left in which the integral compensates the derivative, which needs two ticks.
        settling_ticks: u32,
    }
    /// Ports.
    pub ports Ports {
        position: Input = input("POSITION", types::POSITION),
        desired_position: Input = input("DES_POSITION", types::DES_POSITION),
        force: Output = output("DES_FORCE", types::DES_FORCE),
    }
}

impl Gains {
    #[inline(always)]
    pub(super) fn parameters(&mut self, visit: &mut Parameters<'_>) {
        let Self { stiffness, integral_gain, damping, limit, .. } = self;
        visit.per_axis(stiffness, "K_PARAM", Unit::Stiffness, 0.0..=1e6, 0.0, "Proportional gain.");
        visit.per_axis(integral_gain, "I_PARAM", Unit::IntegralGain, 0.0..=1e7, 0.0, "Integral gain.");
        visit.per_axis(damping, "D_PARAM", Unit::Damping, 0.0..=1e4, 0.0, "Derivative gain.");
        visit.per_axis(limit, "LIMIT", Unit::Force, 0.0..=1e4, 1e4, "Maximum force, in either direction.");
    }

    #[inline(always)]
    pub(super) fn prepare(&mut self, period_s: f32) {
        self.integral_gain_per_tick = self.integral_gain * period_s;
        self.damping_per_tick = self.damping / period_s;
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Pid;

impl Module for Pid {
    const NAME: &'static str = "PIDCTRL_MOD";
    const SUMMARY: &'static str = "PID controller on position with anti-windup and filtered derivative.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn parameters(settings: &mut Settings, gains: &mut Gains, visit: &mut Parameters<'_>) {
        gains.parameters(visit);
        let Settings { tracking_time_s, filter_time_s, .. } = settings;
        let summary = "Anti-windup tracking time of the integral while the force is limited.";
        visit.real(tracking_time_s, "TRACKING_TIME", Unit::Second, 1e-3..=100.0, 0.1, summary);
        let summary = "Time constant of the derivative's low-pass; 0: no filter.";
        visit.real(filter_time_s, "FILTER_TIME", Unit::Second, 0.0..=10.0, 0.0, summary);
    }

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        let h = device.sample_period_s();
        settings.tracking = (h / settings.tracking_time_s).min(1.0);
        settings.smoothing = h / (h + settings.filter_time_s);
    }

    fn prepare_axis(_: &Settings, gains: &mut Gains, device: &DeviceDescriptor) {
        gains.prepare(device.sample_period_s());
    }

    fn begin(context: &Context<'_, Self>) {
        let Ports { position, desired_position, force } = context.ports();
        let takes_over = context.takes_over();
        context.begin_axes([position, desired_position, force.last()], |gains, [x, desired, last_force]| {
            let error = desired - x;
            let axis = AxisState { force: last_force, previous_error: error, ..AxisState::default() };
            let proportional = (gains.stiffness + gains.integral_gain_per_tick) * error;
            let integral = last_force - proportional;
            if !takes_over || !integral.is_finite() || gains.integral_gain_per_tick == 0.0 {
                return axis;
            }
            let integral = math::limit(last_force, gains.limit) - proportional;
            AxisState { integral: CompensatedSum::new(integral), settling_ticks: 2, ..axis }
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { position, desired_position, force } = context.ports();
        let Settings { tracking, smoothing, .. } = context.settings();
        let is_limited = context.is_limited();
        let inputs = [position, desired_position, force.last()];
        context.map_axes(inputs, [force], |gains, axis, [x, desired, given]| {
            let tracking = follow(tracking, gains.integral_gain_per_tick);
            if is_limited {
                axis.integral.add(tracking * (given - axis.force));
            }
            let error = desired - x;
            let change = error - axis.previous_error;
            axis.previous_error = error;
            axis.filtered_change += smoothing * (change - axis.filtered_change);
            if axis.settling_ticks > 0 {
                axis.settling_ticks -= 1;
                axis.filtered_change = change;
                axis.integral.add(-gains.damping_per_tick * change);
            }
            let integral = axis.integral.add(gains.integral_gain_per_tick * error);
            let wanted = gains.stiffness * error + integral + gains.damping_per_tick * axis.filtered_change;
            let force = math::limit(wanted, gains.limit);
            axis.integral.add(tracking * (force - wanted));
            axis.force = force;
            [force]
        });
    }
}
