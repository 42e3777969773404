//! Link faults in the two-sided loop: a lost link is detected in time, without false alarms. Tests of
//! corrupt, late and forged packets in the core are in `dimsart-core/tests/behaviour/faults`.
//!
//! Short in `cargo test`; `cargo xtask long` runs the full length. All random numbers are seeded.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

mod bus_off;
mod line;
#[path = "../common/loops.rs"]
mod loops;
mod loss;

use rand_core::Rng;
use rand_pcg::Pcg64Mcg;

/// Returns true with this probability.
fn happens(random: &mut Pcg64Mcg, probability: f64) -> bool {
    f64::from(random.next_u32()) / 4_294_967_296.0 < probability
}
