//! Cascade controller: a P position loop around a PI velocity loop, each with its own limit.
//!
//! `v_c = sat(K_x (x_d - x) + v_d)`, `F = sat(K (v_c - v) + I + F_feed)`. `I` integrates `K_I (v_c - v)` and is
//! corrected by `(sat(F) - F) h / T_t` while the module's or the device's force limit is active. With
//! `FEED_FORWARD ON`, `v_d` is `DES_VELOCITY` and `F_feed` is `FEED_FORCE`; otherwise both are 0. Leonhard, *Control of
//! Electrical Drives*, section 15.1.
//!
//! On takeover, `I` starts with the value that continues the last force; with `K_I = 0`, at zero.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all CASCADE_MOD POSITION_GAIN 10
//!             all CASCADE_MOD VELOCITY_LIMIT 2
//!             all CASCADE_MOD K_PARAM 3
//!             all MOD_ENG MOD_ON CASCADE_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let measured = &[types::POSITION, types::VELOCITY, types::DES_POSITION];
//! let mut bench = Bench::new(dimsart_modules::ALL, measured, rows)?;
//! // 10 m/s requested, limited to 2 m/s, measured 0.5 m/s.
//! assert_eq!(bench.tick(&[0.0, 0.5, 1.0], "DES_FORCE"), Some(4.5));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use crate::anti_windup::follow;
use dimsart_core::math::{self, CompensatedSum};
use dimsart_core::{Context, Declarations, DeviceDescriptor, Input, Module, Output, Unit, types, words};

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Anti-windup tracking time of the integral while the force is limited.
        tracking_time_s: f32 = real("TRACKING_TIME", Unit::Second, 1e-3..=100.0, 0.1),
        /// Add DES_VELOCITY to the velocity command and FEED_FORCE to the force.
        has_feed_forward: bool = structural_flag("FEED_FORWARD", false),
        /// `h / T_t`, at most 1.
        tracking: f32,
    }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Proportional gain of the position loop: velocity per position error.
        position_gain_hz: f32 = per_axis("POSITION_GAIN", Unit::Hertz, 0.0..=1e4, 0.0),
        /// Maximum commanded velocity, in either direction.
        velocity_limit: f32 = per_axis("VELOCITY_LIMIT", Unit::Velocity, 0.0..=1e4, 1e4),
        /// Proportional gain of the velocity loop.
        proportional: f32 = per_axis("K_PARAM", Unit::Damping, 0.0..=1e5, 0.0),
        /// Integral gain of the velocity loop.
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
        position: Input,
        velocity: Input,
        desired_position: Input,
        desired_velocity: Input,
        feed_force: Input,
        force: Output,
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Cascade;

impl Module for Cascade {
    const NAME: &'static str = "CASCADE_MOD";
    const SUMMARY: &'static str = "Cascade controller: P on position, PI on velocity, each with a limit.";
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

    fn ports(settings: &Settings, declare: &mut Declarations<'_>) -> Ports {
        let position = declare.input("POSITION", types::POSITION);
        let velocity = declare.input("VELOCITY", types::VELOCITY);
        let desired_position = declare.input("DES_POSITION", types::DES_POSITION);
        let (mut desired_velocity, mut feed_force) = (Input::default(), Input::default());
        if settings.has_feed_forward {
            desired_velocity = declare.input("DES_VELOCITY", types::DES_VELOCITY);
            feed_force = declare.input("FEED_FORCE", types::FEED_FORCE);
        }
        let force = declare.output("DES_FORCE", types::DES_FORCE);
        Ports { position, velocity, desired_position, desired_velocity, feed_force, force }
    }

    fn begin(context: &Context<'_, Self>) {
        let Ports { position, velocity, desired_position, desired_velocity, feed_force, force } =
            context.ports();
        let takes_over = context.takes_over();
        let inputs = [position, velocity, desired_position, force.last()];
        context.map_axis_contexts(inputs, [], |number, lane, [x, v, desired, last]| {
            let gains = lane.gains();
            let error = gains.velocity_error(desired - x, context.axis(desired_velocity, number), v);
            let others =
                (gains.proportional + gains.integral_per_tick) * error + context.axis(feed_force, number);
            let integral = math::limit(last, gains.limit) - others;
            let is_known = takes_over && gains.integral > 0.0 && integral.is_finite();
            let integral = CompensatedSum::new(if is_known { integral } else { 0.0 });
            lane.set_axis(AxisState { integral, force: last });
            []
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { position, velocity, desired_position, desired_velocity, feed_force, force } =
            context.ports();
        let Settings { tracking, .. } = context.settings();
        let is_limited = context.is_limited();
        context.map_axis_contexts(
            [position, velocity, desired_position, force.last()],
            [force],
            |number, lane, [x, v, desired, given]| {
                let (gains, mut axis) = (lane.gains(), lane.axis());
                let tracking = follow(tracking, gains.integral_per_tick);
                if is_limited {
                    axis.integral.add(tracking * (given - axis.force));
                }
                let error = gains.velocity_error(desired - x, context.axis(desired_velocity, number), v);
                let integral = axis.integral.add(gains.integral_per_tick * error);
                let wanted = gains.proportional * error + integral + context.axis(feed_force, number);
                let force = math::limit(wanted, gains.limit);
                axis.integral.add(tracking * (force - wanted));
                axis.force = force;
                lane.set_axis(axis);
                [force]
            },
        );
    }
}

impl Gains {
    /// Returns the error of the velocity `v` from the limited output of the position loop.
    #[inline(always)]
    fn velocity_error(&self, position_error: f32, desired_velocity: f32, v: f32) -> f32 {
        math::limit(self.position_gain_hz * position_error + desired_velocity, self.velocity_limit) - v
    }
}
