//! Random draws of a simulated medium: the same seed gives the same fate.

use rand_core::{Rng, SeedableRng};
use rand_distr::{Distribution, Gamma};
use rand_pcg::Pcg64Mcg;

/// A seeded source of fate.
#[derive(Debug, Clone)]
pub(crate) struct Random(Pcg64Mcg);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(Pcg64Mcg::seed_from_u64(seed))
    }

    /// Whether something of this probability happens. Draws a number only when it is open.
    pub(crate) fn happens(&mut self, probability: f64) -> bool {
        probability > 0.0 && self.uniform() < probability
    }

    /// From 0 to below 1, in steps of 2^-53.
    pub(crate) fn uniform(&mut self) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "53 bits fit exactly")]
        let mantissa = (self.0.next_u64() >> 11) as f64;
        mantissa / 9_007_199_254_740_992.0
    }

    /// A whole number from 0 to `most`.
    pub(crate) fn up_to(&mut self, most: u32) -> u64 {
        if most == 0 { 0 } else { self.0.next_u64() % (u64::from(most) + 1) }
    }

    pub(crate) fn gamma(&mut self, distribution: &Gamma<f64>) -> f64 {
        distribution.sample(&mut self.0)
    }

    /// Trials that go well before the first that does not, each failing with `probability`: geometric, by
    /// inversion. More than can be counted when nothing fails.
    pub(crate) fn before_failure(&mut self, probability: f64) -> u64 {
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
        assert_eq!(random.before_failure(0.0), u64::MAX);
        assert_eq!(random.before_failure(1.0), 0);
        for probability in [0.5, 0.1, 1e-3] {
            let draws = 20_000;
            let sum: u64 = (0..draws).map(|_| random.before_failure(probability)).sum();
            let (mean, expected) = (sum as f64 / f64::from(draws), (1.0 - probability) / probability);
            let deviation = (1.0 - probability).sqrt() / probability / f64::from(draws).sqrt();
            assert!((mean - expected).abs() < 4.0 * deviation, "{probability}: {mean} for {expected}");
        }
    }
}
