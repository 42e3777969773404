//! PI controller on velocity with anti-windup.
//!
//! `F = sat(K e + I)`, `e = v_d - v`. `I` integrates `K_I e` and is corrected by `(sat(F) - F) h / T_t` while the
//! module's or the device's force limit is active (back-calculation, Åström & Hägglund, *Advanced PID Control*, section
//! 3.5).
//!
//! On takeover, `I` starts with the value that continues the last force without a step. With `K_I = 0` that value would
//! never decay, so `I` starts at zero.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all PI_MOD K_PARAM 2
//!             all PI_MOD I_PARAM 100
//!             all MOD_ENG MOD_ON PI_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::VELOCITY, types::DES_VELOCITY], rows)?;
//! let forces = [1, 2].map(|_| bench.tick(&[0.0, 1.0], "DES_FORCE"));
//! assert_eq!(forces, [Some(2.1), Some(2.2)]);
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use crate::anti_windup::follow;
use dimsart_core::math::{self, CompensatedSum};
use dimsart_core::{Context, DeviceDescriptor, Input, Module, Output, Unit, types, words};

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Anti-windup tracking time of the integral while the force is limited.
        tracking_time_s: f32 = real("TRACKING_TIME", Unit::Second, 1e-3..=100.0, 0.1),
        /// `h / T_t`, at most 1.
        tracking: f32,
    }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Proportional gain: force per velocity error.
        proportional: f32 = per_axis("K_PARAM", Unit::Damping, 0.0..=1e5, 0.0),
        /// Integral gain of the velocity error.
        integral: f32 = per_axis("I_PARAM", Unit::Stiffness, 0.0..=1e7, 0.0),
        /// Maximum force, in either direction.
        limit: f32 = per_axis("LIMIT", Unit::Force, 0.0..=1e4, 1e4),
        /// `K_I h`.
        integral_per_tick: f32,
    }
    /// State of one axis.
    pub struct AxisState {
        integral: CompensatedSum,
        /// Force of the last tick.
        force: f32,
    }
    /// Ports.
    pub ports Ports {
        velocity: Input = input("VELOCITY", types::VELOCITY),
        desired_velocity: Input = input("DES_VELOCITY", types::DES_VELOCITY),
        force: Output = output("DES_FORCE", types::DES_FORCE),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Pi;

impl Module for Pi {
    const NAME: &'static str = "PI_MOD";
    const SUMMARY: &'static str = "PI controller on velocity with anti-windup.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.tracking = (device.sample_period_s() / settings.tracking_time_s).min(1.0);
    }

    fn prepare_axis(_: &Settings, gains: &mut Gains, device: &DeviceDescriptor) {
        gains.integral_per_tick = gains.integral * device.sample_period_s();
    }

    fn begin(context: &Context<'_, Self>) {
        let Ports { velocity, desired_velocity, force } = context.ports();
        let takes_over = context.takes_over();
        context.begin_axes([velocity, desired_velocity, force.last()], |gains, [v, desired, last]| {
            let proportional = (gains.proportional + gains.integral_per_tick) * (desired - v);
            let integral = math::limit(last, gains.limit) - proportional;
            let is_known = takes_over && gains.integral > 0.0 && integral.is_finite();
            AxisState { integral: CompensatedSum::new(if is_known { integral } else { 0.0 }), force: last }
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { velocity, desired_velocity, force } = context.ports();
        let Settings { tracking, .. } = context.settings();
        let is_limited = context.is_limited();
        let inputs = [velocity, desired_velocity, force.last()];
        context.map_axes(inputs, [force], |gains, axis, [v, desired, given]| {
            let tracking = follow(tracking, gains.integral_per_tick);
            if is_limited {
                axis.integral.add(tracking * (given - axis.force));
            }
            let error = desired - v;
            let wanted = gains.proportional * error + axis.integral.add(gains.integral_per_tick * error);
            let force = math::limit(wanted, gains.limit);
            axis.integral.add(tracking * (force - wanted));
            axis.force = force;
            [force]
        });
    }
}
