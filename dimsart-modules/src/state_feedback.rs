//! State feedback of position and velocity with integral action.
//!
//! `F = sat(N r - K_1 x - K_2 v + I)` with `r = DES_POSITION`, computed as `K_1 (r - x) + (N - K_1) r` to keep
//! precision far from zero. `I` integrates `K_I (r - x)` and is corrected by `(sat(F) - F) h / T_t` while the force
//! limit is active (Franklin, Powell & Workman, *Digital Control of Dynamic Systems*, section 8.5). Use the gains of
//! `control.place` or `control.dlqr`, and `N = K_1` without integral action.
//!
//! Initial state: `I` such that the first force is `-K_2 v`; on takeover, the last force. With `K_I = 0`, `I` starts at
//! zero.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all STATE_FEEDBACK_MOD K1_PARAM 100
//!             all STATE_FEEDBACK_MOD K2_PARAM 8
//!             all STATE_FEEDBACK_MOD REFERENCE_GAIN 100
//!             all MOD_ENG MOD_ON STATE_FEEDBACK_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let measured = &[types::POSITION, types::VELOCITY, types::DES_POSITION];
//! let mut bench = Bench::new(dimsart_modules::ALL, measured, rows)?;
//! assert_eq!(bench.tick(&[0.5, 1.0, 1.0], "DES_FORCE"), Some(42.0));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use crate::anti_windup::follow;
use crate::take_over::first;
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
        /// Feedback gain of the position.
        position: f32 = per_axis("K1_PARAM", Unit::Stiffness, -1e6..=1e6, 0.0),
        /// Feedback gain of the velocity.
        velocity: f32 = per_axis("K2_PARAM", Unit::Damping, -1e5..=1e5, 0.0),
        /// Integral gain of the position error.
        integral: f32 = per_axis("I_PARAM", Unit::IntegralGain, 0.0..=1e7, 0.0),
        /// Feed-forward gain of DES_POSITION.
        reference: f32 = per_axis("REFERENCE_GAIN", Unit::Stiffness, -1e6..=1e6, 0.0),
        /// Maximum force, in either direction.
        limit: f32 = per_axis("LIMIT", Unit::Force, 0.0..=1e4, 1e4),
        /// `K_I h`.
        integral_per_tick: f32,
        /// `N - K_1`.
        excess: f32,
    }
    /// State of one axis.
    pub struct AxisState {
        integral: CompensatedSum,
        /// Force of the last tick.
        force: f32,
    }
    /// Ports.
    pub ports Ports {
        position: Input = input("POSITION", types::POSITION),
        velocity: Input = input("VELOCITY", types::VELOCITY),
        desired_position: Input = input("DES_POSITION", types::DES_POSITION),
        force: Output = output("DES_FORCE", types::DES_FORCE),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct StateFeedback;

impl Module for StateFeedback {
    const NAME: &'static str = "STATE_FEEDBACK_MOD";
    const SUMMARY: &'static str = "State feedback of position and velocity with integral action.";
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
        gains.excess = gains.reference - gains.position;
    }

    fn begin(context: &Context<'_, Self>) {
        let Ports { position, velocity, desired_position, force } = context.ports();
        let takes_over = context.takes_over();
        let inputs = [position, velocity, desired_position, force.last()];
        context.begin_axes(inputs, |gains, [x, v, desired, last]| {
            let damping = -gains.velocity * v;
            let first = first(takes_over, last, damping);
            let error = desired - x;
            let others =
                (gains.position + gains.integral_per_tick) * error + gains.excess * desired + damping;
            let integral = math::limit(first, gains.limit) - others;
            let integral = if gains.integral > 0.0 { integral } else { 0.0 };
            AxisState { integral: CompensatedSum::new(integral), force: last }
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { position, velocity, desired_position, force } = context.ports();
        let Settings { tracking, .. } = context.settings();
        let is_limited = context.is_limited();
        let inputs = [position, velocity, desired_position, force.last()];
        context.map_axes(inputs, [force], |gains, axis, [x, v, desired, given]| {
            let tracking = follow(tracking, gains.integral_per_tick);
            if is_limited {
                axis.integral.add(tracking * (given - axis.force));
            }
            let error = desired - x;
            let integral = axis.integral.add(gains.integral_per_tick * error);
            let wanted = gains.position * error + gains.excess * desired - gains.velocity * v + integral;
            let force = math::limit(wanted, gains.limit);
            axis.integral.add(tracking * (force - wanted));
            axis.force = force;
            [force]
        });
    }
}
