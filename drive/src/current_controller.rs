//! Field-oriented current control: two PI controllers in the rotor frame with decoupling and back-EMF feed-forward.
//!
//! The gains follow from pole cancellation (Harnefors and Nee, "Model-based current control of AC machines using the
//! internal model control method", IEEE Trans. Industry Applications 34(1), 1998), applied to the sampled motor with a
//! voltage held for one period:
//!
//! ```text
//!   u_d = Kp e_d + Σ Ki e_d - w L_q i_q               Ki = wc T R
//!   u_q = Kp e_q + Σ Ki e_q + w (L_d i_d + ψ)         Kp = Ki / (1 - exp(-T R/L)), nearly wc L
//! ```
//! In each period, the current changes by `wc T` times the error of the period before, independent of `R` and `L`.
//!
//! The voltage is limited to a circle with priority for `u_d`: the flux is kept and the torque reduced. The excess is
//! fed back through `1/Kp` into the integrals, which prevents windup.
//!
//! Each integral equals, after a low-pass of `L/R`, the applied voltage minus the feed-forward; `R i` equals, after the
//! same low-pass, the applied voltage minus the back-EMF and coupling of the motor. Their difference is the unexpected
//! motor voltage.

use crate::configuration::{Configuration, Inverter, Motor};
use crate::modulation::SupplyRange;
use crate::number::within;
use crate::vector::Dq;

/// Current controller of a motor.
#[derive(Debug, Clone)]
pub struct CurrentController {
    motor: Motor,
    direct: Gains,
    quadrature: Gains,
    integral_v: Dq,
}

#[derive(Debug, Clone, Copy)]
struct Gains {
    proportional_ohm: f32,
    /// Integral gain per step.
    integral_ohm: f32,
    /// Anti-windup gain: change of the integral per volt of excess and step.
    unwinding: f32,
}

impl Gains {
    #[inline]
    fn new(inductance_h: f32, configuration: &Configuration) -> Self {
        let Configuration { motor, inverter: Inverter { period_s, .. }, bandwidth_rad_per_s, .. } =
            configuration;
        let integral_ohm = bandwidth_rad_per_s * period_s * motor.resistance_ohm;
        let unwinding = decayed(period_s * motor.resistance_ohm / inductance_h);
        Self { proportional_ohm: integral_ohm / unwinding, integral_ohm, unwinding }
    }

    fn integrate(self, integral_v: f32, error_a: f32, cut_off_v: f32) -> f32 {
        integral_v + self.integral_ohm * error_a - self.unwinding * cut_off_v
    }
}

/// Returns `1 - exp(-x)` for `x >= 0`, relative error 2e-6: by its series for `x/256`, then `d(2x) = d(x) (2 - d(x))`.
#[inline]
fn decayed(x: f32) -> f32 {
    let small = x / 256.0;
    let first = small * (1.0 - small * (0.5 - small / 6.0));
    (0..8).fold(first.min(1.0), |decayed, _| decayed * (2.0 - decayed))
}

impl CurrentController {
    /// Creates the controller of a [valid](Configuration::check) configuration.
    #[inline]
    #[must_use]
    pub fn new(configuration: &Configuration) -> Self {
        let motor = configuration.motor;
        let [direct, quadrature] = [motor.direct_inductance_h, motor.quadrature_inductance_h]
            .map(|inductance_h| Gains::new(inductance_h, configuration));
        Self { motor, direct, quadrature, integral_v: Dq::default() }
    }

    /// Clears the integrals; called while the bridge is off.
    pub fn reset(&mut self) {
        self.integral_v = Dq::default();
    }

    /// Returns the d-axis voltage of the motor beyond the feed-forward, `V`. An error of `R` has little effect, because
    /// the d-axis current is nearly 0.
    #[inline]
    #[must_use]
    pub fn d_axis_residual_v(&self, direct_a: f32) -> f32 {
        self.integral_v.d - self.motor.resistance_ohm * direct_a
    }

    /// Returns the voltage for the next period, `V`, limited by the supply, from currents in `A` and the electrical
    /// speed.
    #[must_use]
    pub fn step(&mut self, wanted_a: Dq, is_a: Dq, electrical_rad_per_s: f32, supply: &SupplyRange) -> Dq {
        let Motor { direct_inductance_h, quadrature_inductance_h, flux_linkage_vs, .. } = self.motor;
        let error_a = Dq { d: wanted_a.d - is_a.d, q: wanted_a.q - is_a.q };
        let coupling_d_v = -electrical_rad_per_s * quadrature_inductance_h * is_a.q;
        let coupling_q_v = electrical_rad_per_s * (direct_inductance_h * is_a.d + flux_linkage_vs);
        let asked_v = Dq {
            d: self.direct.proportional_ohm * error_a.d + self.integral_v.d + coupling_d_v,
            q: self.quadrature.proportional_ohm * error_a.q + self.integral_v.q + coupling_q_v,
        };
        let given_v = within_circle(asked_v, supply.max_v, supply.inverse_max_v);
        self.integral_v = Dq {
            d: self.direct.integrate(self.integral_v.d, error_a.d, asked_v.d - given_v.d),
            q: self.quadrature.integrate(self.integral_v.q, error_a.q, asked_v.q - given_v.q),
        };
        given_v
    }
}

/// Limits a voltage to the circle, with priority for `d`.
///
/// The limit of `q`, `r sqrt(1 - x²)` with `x = d/r`, is computed by its series with all terms after `x⁴` combined into
/// `x⁶`: never too large, exact for `d = 0` and `d = r`, and 0.5 % of `r` too small at `d = r/2`, a value reached by
/// decoupling only.
#[inline]
fn within_circle(Dq { d, q }: Dq, radius: f32, per_radius: f32) -> Dq {
    let d = within(d, radius);
    let share = d * per_radius;
    let square = share * share;
    let room = radius * (1.0 - square * (0.5 + square * (0.125 + 0.375 * square)));
    Dq { d, q: within(q, room) }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;

    #[test]
    fn what_is_decayed_is_one_less_the_exponential() {
        for x in [1e-6_f32, 1e-3, 0.05, 0.7, 2.0, 10.0, 100.0, 1e4] {
            let expected = -f64::from(-x).exp_m1();
            assert!((f64::from(decayed(x)) / expected - 1.0).abs() < 2e-6, "{x}: {} {expected}", decayed(x));
        }
    }

    #[test]
    fn a_voltage_stays_in_its_circle_with_the_flux_first() {
        let within = |d, q| within_circle(Dq { d, q }, 5.0, 0.2);
        assert_eq!(within(3.0, 2.0), Dq { d: 3.0, q: 2.0 });
        assert_eq!(within(0.0, -9.0), Dq { d: 0.0, q: -5.0 });
        assert_eq!(within(-7.0, 1.0).d.to_bits(), (-5.0_f32).to_bits());
        assert!(within(-7.0, 1.0).q.abs() < 1e-6);
        for step in 0..=100_u8 {
            let d = f32::from(step) * 0.05;
            let Dq { q, .. } = within(d, 9.0);
            let length = (d * d + q * q).sqrt();
            assert!(length <= 5.0 + 1e-5, "{d} {q}");
            assert!(length > 0.994 * 5.0 || d > 2.5, "{d} {q}");
        }
    }
}
