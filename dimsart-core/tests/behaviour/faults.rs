//! What goes wrong on a link, in numbers: nothing damaged, old, doubled or forged gets through unseen, and a link that
//! is lost is noticed in time, and only then.
//!
//! Short as `cargo test` runs them; `cargo xtask long` runs them at full length. All chance is seeded.
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

/// Below `bound`.
fn below(random: &mut Pcg64Mcg, bound: usize) -> usize {
    usize::try_from(random.next_u64() % bound as u64).unwrap()
}

/// True with this probability.
fn happens(random: &mut Pcg64Mcg, probability: f64) -> bool {
    chance(random) < probability
}

/// Fails unless so many of `trials` are within the 95 % interval of what each has the probability for.
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
