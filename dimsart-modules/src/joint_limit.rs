//! Joint limits: limits the force so that the joint can always stop before its position limits.
//!
//! With the distance `d` to a limit and the guaranteed deceleration `a`, the velocity `w` at the end of this tick must
//! still allow stopping, `w² / 2a <= d - h (v + w) / 2`, and not exceed `VELOCITY_LIMIT`:
//!
//! `w = -a h / 2 + sqrt((a h / 2)² + a (2 d - h v))`, `F <= INERTIA (w - v) / h`,
//!
//! likewise on the other side. The force is then limited to `±FORCE_LIMIT`. This holds as long as
//! `DECELERATION × INERTIA` plus the external force stays below `FORCE_LIMIT` and the force acts within the tick: leave
//! a margin for actuator lag or a filtered velocity.
//!
//! Beyond a limit (`d < 0`), `w` is at most `d / (10 h)` and at least `-5 a h`: the joint returns slowly. An outward
//! load of any size is held: the part above `2.5 a INERTIA` of the estimated load, `INERTIA (v - v[k-1]) / h - F[k-1]`
//! through a low-pass of ten ticks, is subtracted from `F`. The joint then stops at most `25 a h²` beyond its limit.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all JLIMIT_MOD PORT_FORCE_IN FEED_FORCE\nall JLIMIT_MOD POSITION_HIGH 1\nall JLIMIT_MOD FORCE_LIMIT 20
//!             all MOD_ENG MOD_ON JLIMIT_MOD\nall MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION, types::VELOCITY, types::FEED_FORCE], rows)?;
//! // 1 m away at rest; at the limit.
//! assert_eq!(bench.tick(&[0.0, 0.0, 5.0], "DES_FORCE"), Some(5.0));
//! assert_eq!(bench.tick(&[1.0, 0.0, 5.0], "DES_FORCE"), Some(0.0));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use dimsart_core::{
    Context, Declarations, DeviceDescriptor, Input, Module, Output, Unit, math, types, words,
};

words! {
    /// Parameters common to all axes.
    pub parameters Settings { period_s: f32, rate_hz: f32 }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Minimum position.
        low: f32 = per_axis("POSITION_LOW", Unit::Position, -1e6..=1e6, -1.0),
        /// Maximum position.
        high: f32 = per_axis("POSITION_HIGH", Unit::Position, -1e6..=1e6, 1.0),
        /// Maximum velocity, in either direction.
        velocity_limit: f32 = per_axis("VELOCITY_LIMIT", Unit::Velocity, 0.0..=1e4, 1.0),
        /// Maximum force, in either direction.
        force_limit: f32 = per_axis("FORCE_LIMIT", Unit::Force, 0.0..=1e4, 1e4),
        /// Guaranteed braking deceleration.
        deceleration: f32 = per_axis("DECELERATION", Unit::Acceleration, 1e-3..=1e5, 10.0),
        /// Inertia of the joint and its load.
        inertia: f32 = per_axis("INERTIA", Unit::Inertia, 1e-6..=1e4, 1.0),
        /// `INERTIA / h`.
        inertia_per_tick: f32,
        /// `2.5 DECELERATION INERTIA`: load held without correction.
        held: f32,
    }
    /// State of one axis.
    pub struct AxisState {
        previous_velocity: f32,
        force: f32,
        /// Estimated external force.
        load: f32,
    }
    /// Ports.
    pub ports Ports { position: Input, velocity: Input, wanted: Input, force: Output }
}

/// Weight of the newest tick in the load estimate.
const LOAD_SHARE: f32 = 0.1;

/// See the [module docs](self).
#[derive(Debug)]
pub struct JointLimit;

impl Module for JointLimit {
    const NAME: &'static str = "JLIMIT_MOD";
    const SUMMARY: &'static str = "Limits a force so that the joint can stop before its limits.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.period_s = device.sample_period_s();
        settings.rate_hz = 1.0 / settings.period_s;
    }

    fn prepare_axis(settings: &Settings, gains: &mut Gains, _: &DeviceDescriptor) {
        gains.inertia_per_tick = gains.inertia * settings.rate_hz;
        gains.held = 2.5 * gains.deceleration * gains.inertia;
    }

    fn ports(_: &Settings, declare: &mut Declarations<'_>) -> Ports {
        let wanted = types::DES_FORCE.instance(2);
        Ports {
            position: declare.input("POSITION", types::POSITION),
            velocity: declare.input("VELOCITY", types::VELOCITY),
            wanted: declare.default_signal(wanted).input("FORCE_IN", types::DES_FORCE),
            force: declare.output("DES_FORCE", types::DES_FORCE),
        }
    }

    fn begin(context: &Context<'_, Self>) {
        context.begin_axes([context.ports().velocity], |_, [v]| AxisState {
            previous_velocity: v,
            ..AxisState::default()
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { position, velocity, wanted, force } = context.ports();
        let settings = context.settings();
        context.map_axes([position, velocity, wanted], [force], |gains, axis, [x, v, wanted]| {
            let pushed = gains.inertia_per_tick * (v - axis.previous_velocity) - axis.force;
            axis.load += LOAD_SHARE * (pushed - axis.load);
            axis.previous_velocity = v;
            // In the direction of each limit.
            let most = gains.largest(gains.high - x, v, axis.load, &settings);
            let least = -gains.largest(x - gains.low, -v, -axis.load, &settings);
            axis.force = math::limit(math::clamp(wanted, least, most), gains.force_limit);
            [axis.force]
        });
    }
}

impl Gains {
    /// Returns the maximum force towards the limit that still allows stopping within the distance.
    #[inline(always)]
    fn largest(&self, distance: f32, v: f32, load: f32, settings: &Settings) -> f32 {
        let force = self.inertia_per_tick * (self.fastest(distance, v, settings) - v);
        if distance < 0.0 { force - (load - self.held).max(0.0) } else { force }
    }

    /// Returns the maximum velocity at the end of the tick that still allows stopping within the distance.
    #[inline(always)]
    fn fastest(&self, distance: f32, v: f32, &Settings { period_s, rate_hz }: &Settings) -> f32 {
        let a = self.deceleration;
        let half = 0.5 * a * period_s;
        let stopping = math::sqrt(half * half + a * (2.0 * distance - period_s * v)) - half;
        let back = if distance < 0.0 { (0.1 * distance * rate_hz).max(-10.0 * half) } else { stopping };
        stopping.min(back).min(self.velocity_limit)
    }
}
