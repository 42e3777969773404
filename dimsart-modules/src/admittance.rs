//! Admittance: the force of the world moves a virtual mass on a spring and a damper, which says where the joint is to be.
//!
//! `M d'' + D d' + K d = F_e`, `x_d = x_0 + d`, `v_d = d'`, with `F_e`, `EXTERNAL_FORCE`, held from tick to tick, without any error
//! of integration. In a tick, with `a = F_e/M - d K/M`:
//!
//! `d += e v + q a`, `v += e (a - v D/M) - q v K/M`,
//!
//! where `q` and `e` are position and velocity that the free mass, `d'' + d' D/M + d K/M = 1` from rest, has after a tick (zero-order
//! hold; Åström & Wittenmark, *Computer-Controlled Systems*, section 2.3). They are worked out between ticks: for `h/2²⁴` by
//! their series, then doubled.
//!
//! It begins with `d = 0` around the measured position, or where it takes over around the position desired last and with its
//! velocity. The sums are compensated (Kahan). `d` is held inside `±LIMIT`, where the mass stops.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all ADMITTANCE_MOD M_PARAM 2
//!             all MOD_ENG MOD_ON ADMITTANCE_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION, types::EXTERNAL_FORCE], rows)?;
//! // A free mass of 2 kg from 0.5 m on, 8 N for a second.
//! let last = (0..1000).filter_map(|_| bench.tick(&[0.5, 8.0], "DES_POSITION")).last().unwrap_or_default();
//! assert!((last - 2.5).abs() < 1e-5, "{last}");
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use dimsart_core::math::{self, CompensatedSum};
use dimsart_core::{Context, DeviceDescriptor, Input, Module, Output, Unit, types, words};

words! {
    /// Of an axis.
    pub parameters Gains {
        /// Virtual mass.
        mass: f32 = per_axis("M_PARAM", Unit::Inertia, 1e-4..=1e4, 1.0),
        /// Virtual damping to the ground.
        damping: f32 = per_axis("D_PARAM", Unit::Damping, 0.0..=1e4, 0.0),
        /// Virtual stiffness to where it began.
        stiffness: f32 = per_axis("K_PARAM", Unit::Stiffness, 0.0..=1e6, 0.0),
        /// Largest way from where it began.
        limit: f32 = per_axis("LIMIT", Unit::Position, 0.0..=1e3, 1e3),
        /// `1/M`.
        per_mass: f32,
        law: Law,
    }
    /// A virtual mass in a tick.
    struct Law {
        /// `D/M`.
        damping: f32,
        /// `K/M`.
        stiffness: f32,
        /// `e`.
        velocity: f32,
        /// `q`.
        position: f32,
    }
    /// Of an axis.
    pub struct Axis { centre: f32, deviation: CompensatedSum, velocity: CompensatedSum }
    /// Signals.
    pub ports Ports {
        position: Input = input("POSITION", types::POSITION),
        external_force: Input = input("EXTERNAL_FORCE", types::EXTERNAL_FORCE),
        desired_position: Output = output("DES_POSITION", types::DES_POSITION),
        desired_velocity: Output = output("DES_VELOCITY", types::DES_VELOCITY),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Admittance;

impl Module for Admittance {
    const NAME: &'static str = "ADMITTANCE_MOD";
    const SUMMARY: &'static str = "Moves a virtual mass by the force of the world: where the joint is to be.";
    type Settings = ();
    type Gains = Gains;
    type State = ();
    type Axis = Axis;
    type Ports = Ports;

    fn prepare_axis((): &(), gains: &mut Gains, device: &DeviceDescriptor) {
        gains.per_mass = 1.0 / gains.mass;
        let (damping, stiffness) = (gains.damping * gains.per_mass, gains.stiffness * gains.per_mass);
        gains.law = Law::of(damping, stiffness, device.sample_period_s());
    }

    fn begin(context: &Context<'_, Self>) {
        let Ports { position, desired_position, desired_velocity, .. } = context.ports();
        let takes_over = context.takes_over();
        let inputs = [position, desired_position.last(), desired_velocity.last()];
        context.begin_axes(inputs, |_, [x, last, last_velocity]| {
            if takes_over && last.is_finite() && last_velocity.is_finite() {
                Axis { centre: last, velocity: CompensatedSum::new(last_velocity), ..Axis::default() }
            } else {
                Axis { centre: x, ..Axis::default() }
            }
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { external_force, desired_position, desired_velocity, .. } = context.ports();
        context.map_axes([external_force], [desired_position, desired_velocity], |gains, axis, [force]| {
            let law = gains.law;
            let (deviation, v) = (axis.deviation.value(), axis.velocity.value());
            let acceleration = force * gains.per_mass - deviation * law.stiffness;
            let moved = axis.deviation.add(law.velocity * v + law.position * acceleration);
            let slowed = acceleration - v * law.damping;
            axis.velocity.add(law.velocity * slowed - law.position * law.stiffness * v);
            if moved.abs() > gains.limit {
                axis.deviation = CompensatedSum::new(math::limit(moved, gains.limit));
                axis.velocity = CompensatedSum::default();
            }
            [axis.centre + axis.deviation.value(), axis.velocity.value()]
        });
    }
}

impl Law {
    const DOUBLINGS: u8 = 24;

    /// After a time `t`, `A = [0 1; -K/M -D/M]`: the integral of `exp(A τ)` from 0 to `t` is `(e + q D/M) I + q A`, and that to
    /// `2 t` is it times `2 I + A` times it.
    fn of(damping: f32, stiffness: f32, period_s: f32) -> Self {
        let mut t = period_s;
        for _ in 0..Self::DOUBLINGS {
            t *= 0.5;
        }
        let mut position = t * t * (0.5 - t * damping / 6.0);
        let mut velocity = t * (1.0 - 0.5 * t * damping);
        for _ in 0..Self::DOUBLINGS {
            let (q, e) = (position, velocity);
            let p = e + q * damping;
            let rest = 2.0 - q * stiffness;
            position = p * e + q * rest - q * e * damping;
            velocity = p * rest - q * e * stiffness - position * damping;
        }
        Self { damping, stiffness, velocity, position }
    }
}
