//! Admittance controller: an external force moves a virtual mass, spring and damper; their motion is the desired
//! position.
//!
//! `M d'' + D d' + K d = F_e`, `x_d = x_0 + d`, `v_d = d'`. `F_e`, `EXTERNAL_FORCE`, is held between ticks, so the
//! discretisation is exact. Each tick computes, with `a = F_e/M - d K/M`:
//!
//! `d += e v + q a`, `v += e (a - v D/M) - q v K/M`,
//!
//! where `q` and `e` are the position and velocity after one tick of the step response of `d'' + d' D/M + d K/M = 1`
//! (zero-order hold; Åström & Wittenmark, *Computer-Controlled Systems*, section 2.3). They are computed outside the
//! tick: by their series for `h/2²⁴`, then doubled 24 times.
//!
//! Initial state: `d = 0` around the measured position; on takeover, around the last desired position with its
//! velocity. The sums are compensated (Kahan). `d` is limited to `±LIMIT`; the mass stops there.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all ADMITTANCE_MOD M_PARAM 2
//!             all MOD_ENG MOD_ON ADMITTANCE_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION, types::EXTERNAL_FORCE], rows)?;
//! // A free mass of 2 kg at 0.5 m, 8 N for one second.
//! let last = (0..1000).filter_map(|_| bench.tick(&[0.5, 8.0], "DES_POSITION")).last().unwrap_or_default();
//! assert!((last - 2.5).abs() < 1e-5, "{last}");
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use dimsart_core::math::{self, CompensatedSum};
use dimsart_core::{Context, DeviceDescriptor, Input, Module, Output, Unit, types, words};

words! {
    /// Parameters of one axis.
    pub parameters Gains {
        /// Virtual mass.
        mass: f32 = per_axis("M_PARAM", Unit::Inertia, 1e-4..=1e4, 1.0),
        /// Virtual damping to ground.
        damping: f32 = per_axis("D_PARAM", Unit::Damping, 0.0..=1e4, 0.0),
        /// Virtual stiffness towards the initial position.
        stiffness: f32 = per_axis("K_PARAM", Unit::Stiffness, 0.0..=1e6, 0.0),
        /// Maximum deviation from the initial position, in either direction.
        limit: f32 = per_axis("LIMIT", Unit::Position, 0.0..=1e3, 1e3),
        /// `1/M`.
        per_mass: f32,
        law: Law,
    }
    /// Coefficients of one tick.
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
    /// State of one axis.
    pub struct AxisState { centre: f32, deviation: CompensatedSum, velocity: CompensatedSum }
    /// Ports.
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
    const SUMMARY: &'static str = "Admittance controller: converts an external force to a desired position.";
    type Settings = ();
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
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
                AxisState {
                    centre: last,
                    velocity: CompensatedSum::new(last_velocity),
                    ..AxisState::default()
                }
            } else {
                AxisState { centre: x, ..AxisState::default() }
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

    /// Computes the coefficients by doubling the time. With `A = [0 1; -K/M -D/M]`, the integral `S(t)` of `exp(A τ)`
    /// from 0 to `t` is `(e + q D/M) I + q A`, and `S(2 t) = S(t) (2 I + A S(t))`.
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
