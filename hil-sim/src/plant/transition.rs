//! The exact step of one linear regime under held inputs.
//!
//! `s = (x, v, F_motor)`, `s' = A s + c`  =>  `s(t) = s(0) + Ψ(t) s'(0)`, `Ψ(t) = ∫₀ᵗ e^{Aτ} dτ`
//!
//! Stepping by increments keeps a mass at rest exactly at rest and leaves no large offsets to cancel.
//! `Ψ` by its Taylor series over a short time, then `Ψ(2t) = Ψ(t) (2 + A Ψ(t))` (scaling and squaring, as in
//! Higham, "Functions of Matrices", SIAM 2008, ch. 10).

/// The coefficients of one linear regime.
#[derive(Debug, Clone, Copy)]
pub(super) struct Dynamics {
    /// `N/m`.
    pub(super) stiffness_n_per_m: f64,
    /// `N s/m`.
    pub(super) damping_ns_per_m: f64,
    /// `1/kg`; 0 for a mass that friction holds.
    pub(super) inverse_mass_per_kg: f64,
    /// Decay of the motor's force, `1/s`: `F' = ... - decay F`.
    pub(super) decay_per_s: f64,
    /// How speed takes force away, `N/m`: `F' = ... - counter v`.
    pub(super) counter_n_per_m: f64,
}

/// How far the state moves in one step, per unit of its rate of change at the start.
#[derive(Debug, Clone, Copy)]
pub(super) struct Transition {
    /// Length of the step, `s`.
    pub(super) step_s: f64,
    /// `1/kg`; 0 for a mass that friction holds.
    pub(super) inverse_mass_per_kg: f64,
    /// Whether the mass turns around so fast that an event could hide within the step.
    pub(super) is_too_coarse: bool,
    rows: Matrix,
}

/// Largest natural frequency times step: a third of a half oscillation.
const ANGLE_MAX_RAD: f64 = 1.0;
/// `(1/2)^17 / 18!` is far below the last bit.
const TAYLOR_TERMS: u32 = 17;

type Row = [f64; 3];
type Matrix = [Row; 3];

impl Transition {
    /// The exact step of `dynamics` over `step_s`.
    pub(super) fn over(dynamics: &Dynamics, step_s: f64) -> Self {
        let Dynamics {
            stiffness_n_per_m,
            damping_ns_per_m,
            inverse_mass_per_kg,
            decay_per_s,
            counter_n_per_m,
        } = *dynamics;
        let frequency_rad_per_s = (stiffness_n_per_m.abs() * inverse_mass_per_kg).sqrt();
        let a = [
            [0.0, 1.0, 0.0],
            [
                -stiffness_n_per_m * inverse_mass_per_kg,
                -damping_ns_per_m * inverse_mass_per_kg,
                inverse_mass_per_kg,
            ],
            [0.0, -counter_n_per_m, -decay_per_s],
        ];
        let fastest_per_s = frequency_rad_per_s
            + damping_ns_per_m.abs() * inverse_mass_per_kg
            + decay_per_s
            + (counter_n_per_m.abs() * inverse_mass_per_kg).sqrt();
        let mut doublings = 0;
        let mut short_s = step_s;
        while fastest_per_s * short_s > 0.5 && doublings < 64 {
            short_s *= 0.5;
            doublings += 1;
        }
        let mut rows = taylor(&a, short_s);
        for _ in 0..doublings {
            let growth = plus_identity(&product(&a, &rows), 2.0);
            rows = product(&rows, &growth);
        }
        let is_too_coarse = frequency_rad_per_s * step_s > ANGLE_MAX_RAD;
        Self { step_s, inverse_mass_per_kg, is_too_coarse, rows }
    }

    /// The increments of position (`m`) and velocity (`m/s`) where the motor's force does not change.
    #[inline]
    pub(super) fn increments(&self, velocity: f64, acceleration: f64) -> (f64, f64) {
        let [x, v, _] = &self.rows;
        (x[0] * velocity + x[1] * acceleration, v[0] * velocity + v[1] * acceleration)
    }

    /// The increments of position (`m`), velocity (`m/s`) and motor force (`N`).
    #[inline]
    pub(super) fn driven_increments(
        &self,
        velocity: f64,
        acceleration: f64,
        force_rate: f64,
    ) -> (f64, f64, f64) {
        let [x, v, f] = &self.rows;
        (
            x[0] * velocity + x[1] * acceleration + x[2] * force_rate,
            v[0] * velocity + v[1] * acceleration + v[2] * force_rate,
            f[0] * velocity + f[1] * acceleration + f[2] * force_rate,
        )
    }
}

/// `Ψ(t) = t (1 + At/2 (1 + At/3 (1 + ...)))`.
fn taylor(a: &Matrix, t: f64) -> Matrix {
    let mut sum = scaled(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], 1.0);
    for n in (2..=TAYLOR_TERMS + 1).rev() {
        sum = plus_identity(&scaled(&product(a, &sum), t / f64::from(n)), 1.0);
    }
    scaled(&sum, t)
}

fn product(left: &Matrix, right: &Matrix) -> Matrix {
    let [a, b, c] = right;
    left.map(|[p, q, r]| {
        [p * a[0] + q * b[0] + r * c[0], p * a[1] + q * b[1] + r * c[1], p * a[2] + q * b[2] + r * c[2]]
    })
}

fn scaled(matrix: &Matrix, factor: f64) -> Matrix {
    matrix.map(|row| row.map(|value| value * factor))
}

fn plus_identity(matrix: &Matrix, factor: f64) -> Matrix {
    let [[a, b, c], [d, e, f], [g, h, i]] = *matrix;
    [[a + factor, b, c], [d, e + factor, f], [g, h, i + factor]]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dynamics(stiffness: f64, damping: f64) -> Dynamics {
        Dynamics {
            stiffness_n_per_m: stiffness,
            damping_ns_per_m: damping,
            inverse_mass_per_kg: 2.0,
            decay_per_s: 0.0,
            counter_n_per_m: 0.0,
        }
    }

    /// Closed form of an under- or overdamped oscillator under a unit step of acceleration, from rest.
    #[test]
    fn a_spring_damper_steps_as_its_closed_form_says() {
        for (k, b, t) in
            [(400.0, 8.0, 5e-5), (400.0, 8.0, 1e-3), (400.0, 0.0, 1e-1), (1e9, 10.0, 5e-5), (1e4, 0.5, 2e-2)]
        {
            let (x, v) = Transition::over(&dynamics(k, b), t).increments(0.0, 1.0);
            let (rate, natural) = (b, (2.0 * k).sqrt());
            let damped = (natural * natural - rate * rate).sqrt();
            let decay = libm::exp(-rate * t);
            let (sine, cosine) = (libm::sin(damped * t), libm::cos(damped * t));
            let x_exact = (1.0 - decay * (cosine + rate / damped * sine)) / (natural * natural);
            let v_exact = decay * sine / damped;
            let scale = 1.0 / natural;
            assert!((x - x_exact).abs() < 1e-13 * scale * scale, "k {k} t {t}: {x} {x_exact}");
            assert!((v - v_exact).abs() < 1e-13 * scale, "k {k} t {t}: {v} {v_exact}");
        }
    }

    /// Two half steps are one whole step, in every regime with a motor.
    #[test]
    fn steps_compose() {
        let motor = Dynamics { decay_per_s: 9748.0, counter_n_per_m: 700.0, ..dynamics(1e5, 3.0) };
        let (whole, half) = (Transition::over(&motor, 2e-4), Transition::over(&motor, 1e-4));
        let rate =
            |x: f64, v: f64, f: f64| (v, 2.0 * (-1e5 * x - 3.0 * v + f + 1.5), 40.0 - 9748.0 * f - 700.0 * v);
        let step = |transition: &Transition, (x, v, f): (f64, f64, f64)| {
            let (dx, dv, df) = rate(x, v, f);
            let (x1, v1, f1) = transition.driven_increments(dx, dv, df);
            (x + x1, v + v1, f + f1)
        };
        let start = (1e-3, -0.2, 0.4);
        let (x1, v1, f1) = step(&whole, start);
        let (x2, v2, f2) = step(&half, step(&half, start));
        assert!((x1 - x2).abs() < 1e-17 && (v1 - v2).abs() < 1e-14 && (f1 - f2).abs() < 1e-14);
    }

    #[test]
    fn only_a_stiff_regime_asks_for_finer_steps() {
        assert!(!Transition::over(&dynamics(1e4, 0.0), 5e-5).is_too_coarse);
        assert!(Transition::over(&dynamics(1e9, 0.0), 5e-5).is_too_coarse);
        assert!(!Transition::over(&dynamics(1e9, 0.0), 5e-5 / 4.0).is_too_coarse);
    }
}
