//! Link faults: damaged, old, duplicate or forged packets are never accepted unnoticed, and a lost link is
//! detected in time, without false alarms.
//!
//! `cargo test` runs short versions; `cargo xtask long` runs them at full length. All random numbers are
//! seeded.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

mod bit_errors;
mod classic_can;
mod clocks;
mod forgery;
mod order;
mod stream;

use crate::common::way::chance;
use rand_core::Rng;
use rand_pcg::Pcg64Mcg;

/// A number below `bound`.
fn below(random: &mut Pcg64Mcg, bound: usize) -> usize {
    usize::try_from(random.next_u64() % bound as u64).unwrap()
}

/// True with this probability.
fn happens(random: &mut Pcg64Mcg, probability: f64) -> bool {
    chance(random) < probability
}

/// Fails unless the count of `trials` is within the 95 % interval for this probability.
#[track_caller]
#[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53")]
fn assert_share(count: u64, trials: u64, probability: f64) {
    let expected = trials as f64 * probability;
    let interval = 1.96 * (expected * (1.0 - probability)).sqrt();
    println!("{count} of {trials}, expected {expected:.1} +- {interval:.1}");
    assert!(
        (count as f64 - expected).abs() <= interval,
        "{count} of {trials} instead of {expected} +- {interval}"
    );
}
