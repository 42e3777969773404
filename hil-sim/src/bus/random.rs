//! Seeded random numbers of simulated media.

use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Random number generator.
#[derive(Debug, Clone)]
pub struct Random(Pcg64Mcg);

impl Random {
    /// Creates a generator from a seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(Pcg64Mcg::seed_from_u64(seed))
    }

    /// Returns true with this probability. Draws a number only for probabilities between 0 and 1.
    pub fn bernoulli(&mut self, probability: f64) -> bool {
        probability > 0.0 && self.uniform() < probability
    }

    /// Uniform in [0, 1), in steps of 2^-53.
    pub fn uniform(&mut self) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "53 bits fit exactly")]
        let mantissa = (self.0.next_u64() >> 11) as f64;
        mantissa / 9_007_199_254_740_992.0
    }

    /// Uniform integer from 0 to `most`.
    pub fn uniform_integer(&mut self, most: u32) -> u64 {
        if most == 0 { 0 } else { self.0.next_u64() % (u64::from(most) + 1) }
    }

    /// Gamma-distributed with mean `shape`, > 0, after Marsaglia and Tsang, "A simple method for generating gamma
    /// variables", 2000. By `libm` alone: the same on any machine.
    pub fn gamma(&mut self, shape: f64) -> f64 {
        if shape < 1.0 {
            let power = libm::pow(1.0 - self.uniform(), shape.recip());
            return self.gamma(shape + 1.0) * power;
        }
        let d = shape - 1.0 / 3.0;
        let c = libm::sqrt(9.0 * d).recip();
        loop {
            let x = self.normal();
            let v = libm::pow(1.0 + c * x, 3.0);
            let is_taken = |u: f64| libm::log(1.0 - u) < 0.5 * x * x + d - d * v + d * libm::log(v);
            if v > 0.0 && is_taken(self.uniform()) {
                return d * v;
            }
        }
    }

    /// Standard normal (Box and Muller).
    pub fn normal(&mut self) -> f64 {
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - self.uniform()));
        radius * libm::cos(core::f64::consts::TAU * self.uniform())
    }

    /// Geometric: number of successful trials before the first failure, each failing with `probability`; by
    /// inversion. Saturates if no trial fails.
    pub fn geometric(&mut self, probability: f64) -> u64 {
        if probability <= 0.0 {
            return u64::MAX;
        }
        let trials = libm::floor(libm::log1p(-self.uniform()) / libm::log1p(-probability.min(1.0)));
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "not negative; a cast saturates"
        )]
        let trials = trials as u64;
        trials
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failures_come_as_often_as_asked() {
        let mut random = Random::new(3);
        assert_eq!(random.geometric(0.0), u64::MAX);
        assert_eq!(random.geometric(1.0), 0);
        for probability in [0.5, 0.1, 1e-3] {
            let draws = 20_000;
            let sum: u64 = (0..draws).map(|_| random.geometric(probability)).sum();
            let (mean, expected) = (sum as f64 / f64::from(draws), (1.0 - probability) / probability);
            let deviation = (1.0 - probability).sqrt() / probability / f64::from(draws).sqrt();
            assert!((mean - expected).abs() < 4.0 * deviation, "{probability}: {mean} for {expected}");
        }
    }
}
