//! Cascade: a P controller of position around a PI controller of velocity, each with its limit.
//!
//! `v_c = sat(K_x (x_d - x) + v_d)`, `F = sat(K (v_c - v) + I + F_feed)`: `I` integrates `K_I (v_c - v)` and is bled by
//! `(sat(F) - F) h / T_t` while the force limit or that of the device
//! holds. `FEED_FORWARD ON` adds `v_d`, `DES_VELOCITY`, and `F_feed`,
//! `FEED_FORCE`; without it there are none. Leonhard, *Control of Electrical Drives*, section 15.1.
//!
//! Where it takes over, `I` begins with what the last force leaves for it; with `K_I = 0`, with zero.
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
//! // 10 m/s is wanted, 2 m/s is the limit, 0.5 m/s is there.
//! assert_eq!(bench.tick(&[0.0, 0.5, 1.0], "DES_FORCE"), Some(4.5));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use crate::anti_windup::follow;
use dimsart_core::math::{self, CompensatedSum};
use dimsart_core::{Context, Declare, DeviceDescriptor, Input, Module, Output, Unit, types, words};

words! {
    /// Of all axes.
    pub parameters Settings {
        /// Time in which the integral follows a saturated force (anti-windup).
        tracking_time_s: f32 = real("TRACKING_TIME", Unit::Second, 1e-3..=100.0, 0.1),
        /// Whether DES_VELOCITY and FEED_FORCE are added.
        has_feed_forward: bool = structural_flag("FEED_FORWARD", false),
        /// `h / T_t`, at most 1.
        tracking: f32,
    }
    /// Of an axis.
    pub parameters Gains {
        /// Velocity per error of position, 1/s.
        position_gain_hz: f32 = per_axis("POSITION_GAIN", Unit::Hertz, 0.0..=1e4, 0.0),
        /// Largest velocity that is asked for, either way.
        velocity_limit: f32 = per_axis("VELOCITY_LIMIT", Unit::Velocity, 0.0..=1e4, 1e4),
        /// Proportional gain of the velocity loop.
        proportional: f32 = per_axis("K_PARAM", Unit::Damping, 0.0..=1e5, 0.0),
        /// Integral gain of the velocity loop.
        integral: f32 = per_axis("I_PARAM", Unit::Stiffness, 0.0..=1e7, 0.0),
        /// Largest force either way.
        limit: f32 = per_axis("LIMIT", Unit::Force, 0.0..=1e4, 1e4),
        /// `K_I h`.
        integral_per_tick: f32,
    }
    /// Of an axis.
    pub struct Axis {
        integral: CompensatedSum,
        /// Of the last tick.
        force: f32,
    }
    /// Signals.
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
    const SUMMARY: &'static str = "Position, velocity and force in a cascade, each with its limit.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type Axis = Axis;
    type Ports = Ports;

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.tracking = (device.sample_period_s() / settings.tracking_time_s).min(1.0);
    }

    fn prepare_axis(_: &Settings, gains: &mut Gains, device: &DeviceDescriptor) {
        gains.integral_per_tick = gains.integral * device.sample_period_s();
    }

    fn ports(settings: &Settings, declare: &mut Declare<'_>) -> Ports {
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
        context.map_lanes(inputs, [], |number, lane, [x, v, desired, last]| {
            let gains = lane.gains();
            let error = gains.velocity_error(desired - x, context.axis(desired_velocity, number), v);
            let others =
                (gains.proportional + gains.integral_per_tick) * error + context.axis(feed_force, number);
            let integral = math::limit(last, gains.limit) - others;
            let is_known = takes_over && gains.integral > 0.0 && integral.is_finite();
            let integral = CompensatedSum::new(if is_known { integral } else { 0.0 });
            lane.set_axis(Axis { integral, force: last });
            []
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { position, velocity, desired_position, desired_velocity, feed_force, force } =
            context.ports();
        let Settings { tracking, .. } = context.settings();
        let is_limited = context.is_limited();
        context.map_lanes(
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
    /// What the velocity `v` lacks of the one that the position loop asks for.
    #[inline(always)]
    fn velocity_error(&self, position_error: f32, desired_velocity: f32, v: f32) -> f32 {
        math::limit(self.position_gain_hz * position_error + desired_velocity, self.velocity_limit) - v
    }
}
