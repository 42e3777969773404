//! Exact step of a linear mode with constant inputs.
//!
//! `s = (x, v, i)`, `s' = A s + c + r t`  =>  `s(t) = s(0) + Ψ s'(0) + Φ r`, `s'(t) = e^{At} s'(0) + Ψ r`
//!
//! with `Φ = ∫Ψ`, `Ψ = ∫e^{Aτ} dτ = t + A Φ`, `e^{At} = 1 + A Ψ`. Using `s'` as a state avoids force evaluations
//! between events, keeps a mass at rest exactly at rest and avoids cancellation of large offsets. `Φ` is a Taylor
//! series over a short time, followed by doubling (scaling and squaring, as in Higham, "Functions of Matrices", SIAM
//! 2008, ch. 10).

use nalgebra::Matrix3;

/// Coefficients of a linear mode.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Dynamics {
    /// `N/m`.
    pub(super) stiffness_n_per_m: f64,
    /// `N s/m`.
    pub(super) damping_n_s_per_m: f64,
    /// `1/kg`.
    pub(super) inverse_mass_per_kg: f64,
    /// Bandwidth of the current loop, `1/s`: `i' = ... - bandwidth i`; 0 without a winding.
    pub(super) bandwidth_per_s: f64,
    /// `N/A`; 0 without a winding.
    pub(super) force_n_per_a: f64,
}

/// Motion state.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Motion {
    pub(super) position_m: f64,
    pub(super) velocity_m_per_s: f64,
    pub(super) acceleration_m_per_s2: f64,
}

/// A step of a mode.
#[derive(Debug, Clone, Copy)]
pub(super) struct Transition {
    /// `1/kg`.
    pub(super) inverse_mass_per_kg: f64,
    /// `Ψ`.
    increments: Matrix3<f64>,
    /// Effect of a jerk on the position, from `Φ`.
    ramp: f64,
    /// `e^{At}`.
    growth: Matrix3<f64>,
    /// `∫ e^{-bandwidth t} v dt` by velocity, acceleration and rate of the current at the start, and by jerk.
    lagged: [f64; 4],
    /// `∫ t v dt` by the same.
    late: [f64; 4],
}

/// `(1/2)^17 / 18!` is far below the last bit.
const TAYLOR_TERMS: u32 = 17;

impl Transition {
    /// Computes the exact step of `dynamics` over `step_s`.
    pub(super) fn over(dynamics: &Dynamics, step_s: f64) -> Self {
        let Dynamics {
            stiffness_n_per_m,
            damping_n_s_per_m,
            inverse_mass_per_kg,
            bandwidth_per_s,
            force_n_per_a,
        } = *dynamics;
        #[rustfmt::skip]
        let a = Matrix3::new(
            0.0, 1.0, 0.0,
            -stiffness_n_per_m * inverse_mass_per_kg, -damping_n_s_per_m * inverse_mass_per_kg,
            force_n_per_a * inverse_mass_per_kg,
            0.0, 0.0, -bandwidth_per_s,
        );
        let frequency_rad_per_s = (stiffness_n_per_m.abs() * inverse_mass_per_kg).sqrt();
        let fastest_per_s =
            frequency_rad_per_s + damping_n_s_per_m.abs() * inverse_mass_per_kg + bandwidth_per_s;
        let Integrals { third, second: ramps, first: increments, growth } =
            Integrals::over(&a, fastest_per_s, step_s);
        // By parts: ∫ t v = t x - ∫ x, and ∫ e^{-bt} ∫v = (∫ e^{-bt} v - e^{-bt} ∫v)/b.
        let lag = growth.m33;
        let late = [
            step_s * increments.m11 - ramps.m11,
            step_s * increments.m12 - ramps.m12,
            step_s * increments.m13 - ramps.m13,
            step_s * ramps.m12 - third.m12,
        ];
        let mut lagged = [0.0; 4];
        if bandwidth_per_s > 0.0 {
            let faster = a - Matrix3::from_diagonal_element(bandwidth_per_s);
            let weighted = Integrals::over(&faster, fastest_per_s + bandwidth_per_s, step_s).first;
            let by_jerk = (weighted.m12 - lag * increments.m12) / bandwidth_per_s;
            lagged = [weighted.m11, weighted.m12, weighted.m13, by_jerk];
        }
        Self { inverse_mass_per_kg, increments, ramp: ramps.m12, growth, lagged, late }
    }

    /// Advances `motion` by one step; `jerk` is the rate of the acceleration by time alone, `m/s³`.
    #[inline]
    pub(super) fn step(&self, motion: &Motion, jerk: f64) -> Motion {
        let Motion { position_m, velocity_m_per_s, acceleration_m_per_s2 } = *motion;
        let Self { increments: by, growth, .. } = self;
        Motion {
            position_m: position_m
                + (by.m11 * velocity_m_per_s + by.m12 * acceleration_m_per_s2 + self.ramp * jerk),
            velocity_m_per_s: growth.m11 * velocity_m_per_s
                + growth.m12 * acceleration_m_per_s2
                + by.m12 * jerk,
            acceleration_m_per_s2: growth.m21 * velocity_m_per_s
                + growth.m22 * acceleration_m_per_s2
                + by.m22 * jerk,
        }
    }

    /// Like `advance`, with a current that changes at `rate_a_per_s` at the start.
    #[inline]
    pub(super) fn driven_step(&self, motion: &Motion, rate_a_per_s: f64, jerk: f64) -> Motion {
        let Self { increments: by, growth, .. } = self;
        let passive = self.step(motion, jerk);
        Motion {
            position_m: passive.position_m + by.m13 * rate_a_per_s,
            velocity_m_per_s: passive.velocity_m_per_s + growth.m13 * rate_a_per_s,
            acceleration_m_per_s2: passive.acceleration_m_per_s2 + growth.m23 * rate_a_per_s,
        }
    }

    /// `e^{-bandwidth t}` at the end of the step, and its integral, `s`.
    pub(super) fn lag(&self) -> (f64, f64) {
        (self.growth.m33, self.increments.m33)
    }

    /// `∫ e^{-bandwidth t} v dt` over the step, `m`.
    pub(super) fn lagged_m(&self, motion: &Motion, rate_a_per_s: f64, jerk: f64) -> f64 {
        weigh(&self.lagged, motion, rate_a_per_s, jerk)
    }

    /// `∫ t v dt` over the step, `m s`.
    pub(super) fn late_ms(&self, motion: &Motion, rate_a_per_s: f64, jerk: f64) -> f64 {
        weigh(&self.late, motion, rate_a_per_s, jerk)
    }
}

fn weigh(
    [velocity, acceleration, rate, by_jerk]: &[f64; 4],
    motion: &Motion,
    rate_a_per_s: f64,
    jerk: f64,
) -> f64 {
    velocity * motion.velocity_m_per_s
        + acceleration * motion.acceleration_m_per_s2
        + rate * rate_a_per_s
        + by_jerk * jerk
}

/// `e^{At}` and its integrals, each over the one before.
struct Integrals {
    growth: Matrix3<f64>,
    first: Matrix3<f64>,
    second: Matrix3<f64>,
    third: Matrix3<f64>,
}

impl Integrals {
    fn over(a: &Matrix3<f64>, fastest_per_s: f64, step_s: f64) -> Self {
        let mut doublings = 0;
        let mut short_s = step_s;
        while fastest_per_s * short_s > 0.5 && doublings < 64 {
            short_s *= 0.5;
            doublings += 1;
        }
        let unit = Matrix3::from_diagonal_element;
        let mut third = taylor(a, short_s, 3);
        let mut second = taylor(a, short_s, 2);
        let mut first = a * second + unit(short_s);
        let mut growth = a * first + unit(1.0);
        for _ in 0..doublings {
            third = third + second * short_s + first * (0.5 * short_s * short_s) + growth * third;
            second = second + first * short_s + growth * second;
            first += growth * first;
            growth = a * first + unit(1.0);
            short_s *= 2.0;
        }
        Self { growth, first, second, third }
    }
}

/// `tⁿ/n! (1 + At/(n+1) (1 + At/(n+2) (1 + ...)))`, the `n`-th integral of `e^{At}`.
fn taylor(a: &Matrix3<f64>, t: f64, integral: u32) -> Matrix3<f64> {
    let mut series = Matrix3::identity();
    for n in (integral + 1..=TAYLOR_TERMS + integral).rev() {
        series = (a * series) * (t / f64::from(n)) + Matrix3::identity();
    }
    series * (1..=integral).map(|n| t / f64::from(n)).product::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dynamics(stiffness: f64, damping: f64) -> Dynamics {
        Dynamics {
            stiffness_n_per_m: stiffness,
            damping_n_s_per_m: damping,
            inverse_mass_per_kg: 2.0,
            ..Dynamics::default()
        }
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
