//! Policies: statements about every tick of both sides of the shipped scheme, under any faults and any operator.
//!
//! Scenarios are drawn by a seed. One in which a policy does not hold is made as small as it gets and written out, so that
//! it can be run again as it is; `DIMSART_SEED` runs the scenarios of one seed.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "in helpers of tests as in tests"
)]

mod fault_latency;
mod fault_table;
mod faulty_pair;
mod moment;
mod parts;
mod play;
mod policy;
mod scenario;
mod seen;
mod sensors;

use std::env::var;

use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestError, TestRng, TestRunner};

use play::{Logs, play};
use policy::POLICIES;
use scenario::scenarios;

/// Scenarios of a seed.
const OF_A_SEED: u32 = 250;

/// Plays the scenarios of a seed; gives how many ticks each policy was about, and how many scenarios swing to their end.
fn play_seed(seed: u64, logs: Logs) -> Vec<u64> {
    let mut bytes = [0; 32];
    bytes[..8].copy_from_slice(&seed.to_le_bytes());
    let config = Config { cases: OF_A_SEED, failure_persistence: None, ..Config::default() };
    let random = TestRng::from_seed(RngAlgorithm::ChaCha, &bytes);
    let about = std::cell::RefCell::new(vec![0; POLICIES.len() + 1]);
    let played = TestRunner::new_with_rng(config, random).run(&scenarios(), |scenario| {
        let fail = |why| Err(TestCaseError::fail(why));
        let first = match play(&scenario, logs) {
            Ok(first) => first,
            Err(why) => return fail(why),
        };
        let counts = first.about.iter().copied().chain([first.is_swinging.into()]);
        about.borrow_mut().iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
        // The same again, now and then: twice the time for one word.
        if first.digest % 16 == 0 && play(&scenario, logs).is_ok_and(|again| again.digest != first.digest) {
            return fail("the same scenario gives other forces".to_owned());
        }
        Ok(())
    });
    match played {
        Ok(()) => about.into_inner(),
        Err(TestError::Fail(why, scenario)) => panic!("DIMSART_SEED={seed}: {why}\n{scenario:#?}"),
        Err(TestError::Abort(why)) => panic!("DIMSART_SEED={seed}: {why}"),
    }
}

/// A million scenarios in the long run.
#[test]
fn every_policy_holds_in_every_tick_whatever_happens() {
    let seeds = test_requirements::length(8, 4_000);
    let one = var("DIMSART_SEED").ok().and_then(|seed| seed.parse().ok());
    let seeds: Vec<u64> = one.map_or_else(|| (1..=seeds).collect(), |seed| vec![seed]);
    let about = std::thread::scope(|threads| {
        let workers = [0, 1].map(|worker| {
            let seeds = seeds.iter().skip(worker).step_by(2);
            threads.spawn(move || {
                let logs = Logs::new();
                seeds.map(|seed| play_seed(*seed, logs)).collect::<Vec<_>>()
            })
        });
        workers.map(|worker| worker.join().unwrap()).concat()
    });
    let swinging: u64 = about.iter().map(|about| about[POLICIES.len()]).sum();
    println!(
        "{swinging} of {} scenarios swing between their limits at the end",
        seeds.len() * OF_A_SEED as usize
    );
    for (place, policy) in POLICIES.iter().enumerate() {
        let ticks: u64 = about.iter().map(|about| about[place]).sum();
        println!("{ticks:>12} ticks: {}", policy.says);
        // What is about nothing holds always; one seed need not be about all.
        assert!(ticks > 0 || one.is_some(), "no scenario was about it: {}", policy.says);
    }
}
