//! The exact step of one linear regime under held inputs.
//!
//! `s = (x, v)`, `s' = A s + c + r t`  =>  `s(t) = s(0) + Ψ s'(0) + Φ r`, `s'(t) = e^{At} s'(0) + Ψ r`
//!
//! with `Φ = ∫Ψ`, `Ψ = ∫e^{Aτ} dτ = t + A Φ`, `e^{At} = 1 + A Ψ`. Carrying `s'` along needs no force between
//! events, keeps a mass at rest exactly at rest and leaves no large offsets to cancel. `Φ` comes from its Taylor
//! series over a short time, which is then doubled (scaling and squaring, as in Higham, "Functions of Matrices",
//! SIAM 2008, ch. 10).

/// The coefficients of one linear regime.
#[derive(Debug, Clone, Copy)]
pub(super) struct Dynamics {
    /// `N/m`.
    pub(super) stiffness_n_per_m: f64,
    /// `N s/m`.
    pub(super) damping_ns_per_m: f64,
    /// `1/kg`.
    pub(super) inverse_mass_per_kg: f64,
}

/// What moves, and how fast it does.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Motion {
    pub(super) position_m: f64,
    pub(super) velocity_m_per_s: f64,
    pub(super) acceleration_m_per_s2: f64,
}

/// One step of one regime.
#[derive(Debug, Clone, Copy)]
pub(super) struct Transition {
    /// `1/kg`.
    pub(super) inverse_mass_per_kg: f64,
    /// `Ψ`.
    increments: Matrix,
    /// What a jerk adds to the position, of `Φ`.
    ramp: f64,
    /// `e^{At}`.
    growth: Matrix,
}

/// `(1/2)^17 / 18!` is far below the last bit.
const TAYLOR_TERMS: u32 = 17;

type Matrix = [[f64; 2]; 2];

impl Transition {
    /// The exact step of `dynamics` over `step_s`.
    pub(super) fn over(dynamics: &Dynamics, step_s: f64) -> Self {
        let Dynamics { stiffness_n_per_m, damping_ns_per_m, inverse_mass_per_kg } = *dynamics;
        let frequency_rad_per_s = (stiffness_n_per_m.abs() * inverse_mass_per_kg).sqrt();
        let a =
            [[0.0, 1.0], [-stiffness_n_per_m * inverse_mass_per_kg, -damping_ns_per_m * inverse_mass_per_kg]];
        let fastest_per_s = frequency_rad_per_s + damping_ns_per_m.abs() * inverse_mass_per_kg;
        let mut doublings = 0;
        let mut short_s = step_s;
        while fastest_per_s * short_s > 0.5 && doublings < 64 {
            short_s *= 0.5;
            doublings += 1;
        }
        let mut ramps = taylor(&a, short_s);
        let mut increments = plus(&product(&a, &ramps), short_s);
        let mut growth = plus(&product(&a, &increments), 1.0);
        for _ in 0..doublings {
            ramps = sum(&sum(&ramps, &scaled(&increments, short_s)), &product(&growth, &ramps));
            increments = sum(&increments, &product(&growth, &increments));
            growth = plus(&product(&a, &increments), 1.0);
            short_s *= 2.0;
        }
        let ramp = ramps[0][1];
        Self { inverse_mass_per_kg, increments, ramp, growth }
    }

    /// `motion` one step later, where `jerk` is how the acceleration changes with time alone, `m/s³`.
    #[inline]
    pub(super) fn step(&self, motion: &Motion, jerk: f64) -> Motion {
        let Motion { position_m, velocity_m_per_s, acceleration_m_per_s2 } = *motion;
        let ([x, v], [e, a]) = (&self.increments, &self.growth);
        Motion {
            position_m: position_m
                + (x[0] * velocity_m_per_s + x[1] * acceleration_m_per_s2 + self.ramp * jerk),
            velocity_m_per_s: e[0] * velocity_m_per_s + e[1] * acceleration_m_per_s2 + x[1] * jerk,
            acceleration_m_per_s2: a[0] * velocity_m_per_s + a[1] * acceleration_m_per_s2 + v[1] * jerk,
        }
    }
}

/// `Φ(t) = t²/2 (1 + At/3 (1 + At/4 (1 + ...)))`.
fn taylor(a: &Matrix, t: f64) -> Matrix {
    let mut series = plus(&[[0.0; 2]; 2], 1.0);
    for n in (3..=TAYLOR_TERMS + 2).rev() {
        series = plus(&scaled(&product(a, &series), t / f64::from(n)), 1.0);
    }
    scaled(&series, 0.5 * t * t)
}

fn product(left: &Matrix, right: &Matrix) -> Matrix {
    let [a, b] = right;
    left.map(|[p, q]| [p * a[0] + q * b[0], p * a[1] + q * b[1]])
}

fn scaled(matrix: &Matrix, factor: f64) -> Matrix {
    matrix.map(|row| row.map(|value| value * factor))
}

fn sum(left: &Matrix, right: &Matrix) -> Matrix {
    let [[a, b], [c, d]] = *right;
    let [[e, f], [g, h]] = *left;
    [[a + e, b + f], [c + g, d + h]]
}

/// `matrix + diagonal·1`.
fn plus(matrix: &Matrix, diagonal: f64) -> Matrix {
    let [[a, b], [c, d]] = *matrix;
    [[a + diagonal, b], [c, d + diagonal]]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dynamics(stiffness: f64, damping: f64) -> Dynamics {
        Dynamics { stiffness_n_per_m: stiffness, damping_ns_per_m: damping, inverse_mass_per_kg: 2.0 }
    }

    /// Closed form of an oscillator under a unit step of acceleration, from rest.
    #[test]
    fn a_spring_damper_steps_as_its_closed_form_says() {
        for (k, b, t) in
            [(400.0, 8.0, 5e-5), (400.0, 8.0, 1e-3), (400.0, 0.0, 1e-1), (1e9, 10.0, 5e-5), (1e4, 0.5, 2e-2)]
        {
            let start = Motion { acceleration_m_per_s2: 1.0, ..Motion::default() };
            let end = Transition::over(&dynamics(k, b), t).step(&start, 0.0);
            let (rate, natural) = (b, (2.0 * k).sqrt());
            let damped = (natural * natural - rate * rate).sqrt();
            let decay = libm::exp(-rate * t);
            let (sine, cosine) = (libm::sin(damped * t), libm::cos(damped * t));
            let x = (1.0 - decay * (cosine + rate / damped * sine)) / (natural * natural);
            let v = decay * sine / damped;
            let a = decay * (cosine - rate / damped * sine);
            assert!((end.position_m - x).abs() * natural * natural < 1e-13, "k {k} t {t}: {end:?} {x}");
            assert!((end.velocity_m_per_s - v).abs() * natural < 1e-13, "k {k} t {t}: {end:?} {v}");
            assert!((end.acceleration_m_per_s2 - a).abs() < 1e-13, "k {k} t {t}: {end:?} {a}");
        }
    }

    /// Two half steps are one whole step, with a force that grows.
    #[test]
    fn steps_compose() {
        let spring = dynamics(1e5, 3.0);
        let (whole, half) = (Transition::over(&spring, 2e-4), Transition::over(&spring, 1e-4));
        let start = Motion { position_m: 1e-3, velocity_m_per_s: -0.2, acceleration_m_per_s2: -195.0 };
        let close = |one: f64, two: f64| (one - two).abs() < 1e-13 * one.abs();
        for jerk in [0.0, 5e4] {
            let one = whole.step(&start, jerk);
            let two = half.step(&half.step(&start, jerk), jerk);
            assert!(close(one.position_m, two.position_m), "{one:?} {two:?}");
            assert!(close(one.velocity_m_per_s, two.velocity_m_per_s), "{one:?} {two:?}");
            assert!(close(one.acceleration_m_per_s2, two.acceleration_m_per_s2), "{one:?} {two:?}");
        }
    }
}
