//! What goes wrong on a link, in the whole two-sided loop: a link that is lost is noticed in time, and only then. What
//! the core alone shows of damaged, late and forged packets is in `dimsart-core/tests/behaviour/faults`.
//!
//! Short as `cargo test` runs them; `cargo xtask long` runs them at full length. All chance is seeded.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

mod bus_off;
mod line;
#[path = "../common/loops.rs"]
mod loops;
mod loss;

use rand_core::Rng;
use rand_pcg::Pcg64Mcg;

/// True with this probability.
fn happens(random: &mut Pcg64Mcg, probability: f64) -> bool {
    f64::from(random.next_u32()) / 4_294_967_296.0 < probability
}
