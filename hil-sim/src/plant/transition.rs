//! The exact step of one linear regime under held inputs.
//!
//! `s = (x, v, F_motor)`, `s' = A s + c + r t`  =>  `s(t) = s(0) + Ψ s'(0) + Φ r`, `s'(t) = e^{At} s'(0) + Ψ r`
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
    /// `1/kg`; 0 for a mass that friction holds.
    pub(super) inverse_mass_per_kg: f64,
    /// Decay of the motor's force, `1/s`: `F' = ... - decay F`.
    pub(super) decay_per_s: f64,
    /// How speed takes force away, `N/m`: `F' = ... - counter v`.
    pub(super) counter_n_per_m: f64,
}

/// What moves, and how fast it does.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Motion {
    pub(super) position_m: f64,
    pub(super) velocity_m_per_s: f64,
    pub(super) acceleration_m_per_s2: f64,
    /// What the motor applies, `N`.
    pub(super) actuator_n: f64,
    pub(super) actuator_rate_n_per_s: f64,
}

/// One step of one regime.
#[derive(Debug, Clone, Copy)]
pub(super) struct Transition {
    /// Length of the step, `s`.
    pub(super) step_s: f64,
    /// `1/kg`; 0 for a mass that friction holds.
    pub(super) inverse_mass_per_kg: f64,
    /// Square of the natural frequency where the mass turns around so fast that an event could hide within the
    /// step, `(rad/s)²`; none where it cannot.
    pub(super) hiding_rad2_per_s2: Option<f64>,
    /// `Ψ`.
    increments: Matrix,
    /// What a jerk adds to position and motor force: column `v` of `Φ`.
    ramp: [f64; 2],
    /// `e^{At}`.
    growth: Matrix,
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
        let mut ramps = taylor(&a, short_s);
        let mut increments = plus(&product(&a, &ramps), short_s);
        let mut growth = plus(&product(&a, &increments), 1.0);
        for _ in 0..doublings {
            ramps = sum(&sum(&ramps, &scaled(&increments, short_s)), &product(&growth, &ramps));
            increments = sum(&increments, &product(&growth, &increments));
            growth = plus(&product(&a, &increments), 1.0);
            short_s *= 2.0;
        }
        let can_hide = frequency_rad_per_s * step_s > ANGLE_MAX_RAD;
        let hiding_rad2_per_s2 = can_hide.then_some(frequency_rad_per_s * frequency_rad_per_s);
        let ramp = [ramps[0][1], ramps[2][1]];
        Self { step_s, inverse_mass_per_kg, hiding_rad2_per_s2, increments, ramp, growth }
    }

    /// `motion` one step later, where `jerk` is how the acceleration changes with time alone, `m/s³`.
    #[inline]
    pub(super) fn step(&self, motion: &Motion, jerk: f64) -> Motion {
        let Motion { position_m, velocity_m_per_s, acceleration_m_per_s2, .. } = *motion;
        let ([x, v, _], [e, a, _]) = (&self.increments, &self.growth);
        Motion {
            position_m: position_m
                + (x[0] * velocity_m_per_s + x[1] * acceleration_m_per_s2 + self.ramp[0] * jerk),
            velocity_m_per_s: e[0] * velocity_m_per_s + e[1] * acceleration_m_per_s2 + x[1] * jerk,
            acceleration_m_per_s2: a[0] * velocity_m_per_s + a[1] * acceleration_m_per_s2 + v[1] * jerk,
            ..*motion
        }
    }

    /// Up to `most` such steps, as long as the position and velocity that each one leads to are as `holds` wants
    /// them; returns how many.
    #[inline]
    pub(super) fn glide(
        &self,
        motion: &mut Motion,
        jerk: f64,
        most: u32,
        holds: impl Fn(f64, f64) -> bool,
    ) -> u32 {
        let ([x, v, _], [e, a, _]) = (&self.increments, &self.growth);
        let (shift, push, surge) = (self.ramp[0] * jerk, x[1] * jerk, v[1] * jerk);
        let (mut position, mut velocity) = (motion.position_m, motion.velocity_m_per_s);
        let mut acceleration = motion.acceleration_m_per_s2;
        let mut done = 0;
        while done < most {
            let next_position = position + (x[0] * velocity + x[1] * acceleration + shift);
            let next_velocity = e[0] * velocity + e[1] * acceleration + push;
            if !holds(next_position, next_velocity) {
                break;
            }
            acceleration = a[0] * velocity + a[1] * acceleration + surge;
            (position, velocity) = (next_position, next_velocity);
            done += 1;
        }
        motion.position_m = position;
        motion.velocity_m_per_s = velocity;
        motion.acceleration_m_per_s2 = acceleration;
        done
    }

    /// The same with a motor whose force moves too.
    #[inline]
    pub(super) fn driven_step(&self, motion: &Motion, jerk: f64) -> Motion {
        let Motion {
            velocity_m_per_s, acceleration_m_per_s2, actuator_n, actuator_rate_n_per_s: rate, ..
        } = *motion;
        let ([x, _, f], [e, a, r]) = (&self.increments, &self.growth);
        let passive = self.step(motion, jerk);
        Motion {
            position_m: passive.position_m + x[2] * rate,
            velocity_m_per_s: passive.velocity_m_per_s + e[2] * rate,
            acceleration_m_per_s2: passive.acceleration_m_per_s2 + a[2] * rate,
            actuator_n: actuator_n
                + (f[0] * velocity_m_per_s
                    + f[1] * acceleration_m_per_s2
                    + f[2] * rate
                    + self.ramp[1] * jerk),
            actuator_rate_n_per_s: r[0] * velocity_m_per_s
                + r[1] * acceleration_m_per_s2
                + r[2] * rate
                + f[1] * jerk,
        }
    }
}

/// `Φ(t) = t²/2 (1 + At/3 (1 + At/4 (1 + ...)))`.
fn taylor(a: &Matrix, t: f64) -> Matrix {
    let mut series = plus(&[[0.0; 3]; 3], 1.0);
    for n in (3..=TAYLOR_TERMS + 2).rev() {
        series = plus(&scaled(&product(a, &series), t / f64::from(n)), 1.0);
    }
    scaled(&series, 0.5 * t * t)
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

fn sum(left: &Matrix, right: &Matrix) -> Matrix {
    let [[a, b, c], [d, e, f], [g, h, i]] = *right;
    let [[j, k, l], [m, n, o], [p, q, r]] = *left;
    [[a + j, b + k, c + l], [d + m, e + n, f + o], [g + p, h + q, i + r]]
}

/// `matrix + diagonal·1`.
fn plus(matrix: &Matrix, diagonal: f64) -> Matrix {
    let [[a, b, c], [d, e, f], [g, h, i]] = *matrix;
    [[a + diagonal, b, c], [d, e + diagonal, f], [g, h, i + diagonal]]
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

    /// Two half steps are one whole step, with a motor that speed brakes and a force that grows.
    #[test]
    fn steps_compose() {
        let motor = Dynamics { decay_per_s: 9748.0, counter_n_per_m: 700.0, ..dynamics(1e5, 3.0) };
        let (whole, half) = (Transition::over(&motor, 2e-4), Transition::over(&motor, 1e-4));
        let start = Motion {
            position_m: 1e-3,
            velocity_m_per_s: -0.2,
            acceleration_m_per_s2: -195.0,
            actuator_n: 0.4,
            actuator_rate_n_per_s: -3700.0,
        };
        let close = |one: f64, two: f64| (one - two).abs() < 1e-13 * one.abs();
        for jerk in [0.0, 5e4] {
            let one = whole.driven_step(&start, jerk);
            let two = half.driven_step(&half.driven_step(&start, jerk), jerk);
            assert!(close(one.position_m, two.position_m), "{one:?} {two:?}");
            assert!(close(one.velocity_m_per_s, two.velocity_m_per_s), "{one:?} {two:?}");
            assert!(close(one.acceleration_m_per_s2, two.acceleration_m_per_s2), "{one:?} {two:?}");
            assert!(close(one.actuator_n, two.actuator_n), "{one:?} {two:?}");
            assert!(close(one.actuator_rate_n_per_s, two.actuator_rate_n_per_s), "{one:?} {two:?}");
        }
    }

    #[test]
    fn only_a_stiff_regime_asks_for_finer_steps() {
        assert!(Transition::over(&dynamics(1e4, 0.0), 5e-5).hiding_rad2_per_s2.is_none());
        assert!(Transition::over(&dynamics(1e9, 0.0), 5e-5).hiding_rad2_per_s2.is_some());
        assert!(Transition::over(&dynamics(1e9, 0.0), 5e-5 / 4.0).hiding_rad2_per_s2.is_none());
    }
}
