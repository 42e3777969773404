//! Packets every few ticks: no energy is generated, no displacement is lost.
#![expect(clippy::cast_possible_truncation, reason = "rounded on purpose")]

use crate::common::H;
use crate::common::way::{Way, chance, energy};
use dimsart_core::Packet;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

/// Random waves sent every few ticks over a line with loss and delay; after every tick `look` gets the sums
/// of energy and displacement that were sent and output.
fn rate_run(policy: &str, every: u32, loss: f64, jitter: u32, mut look: impl FnMut(u32, [f64; 2], [f64; 2])) {
    let mut random = Pcg32::seed_from_u64(u64::from(70 + every));
    let mut way = Way::every(&format!("COMM_RXMOD TIMEOUT_TICKS 0\nCOMM_RXMOD STALE {policy}"), every);
    let (mut sent, mut given_out, mut slow) = ([0.0; 2], [0.0; 2], 0.0);
    let mut line: Vec<(u32, Packet)> = Vec::new();
    let mut last_arrival = 0;
    for tick in 0..20_000 {
        slow = 0.999 * slow + 0.05 * (chance(&mut random) - 0.5);
        let wave = (3.0 * slow + 0.5 * (chance(&mut random) - 0.5)) as f32;
        sent = [sent[0] + energy(wave), sent[1] + f64::from(wave) * f64::from(H)];
        if let Some(packet) = way.try_send(wave)
            && chance(&mut random) >= loss
        {
            last_arrival = (tick + random.next_u32() % (jitter + 1)).max(last_arrival);
            line.push((last_arrival, packet));
        }
        let due = line.first().is_some_and(|(arrival, _)| *arrival <= tick).then(|| line.remove(0).1);
        let given = way.receive(&due);
        given_out = [given_out[0] + energy(given), given_out[1] + f64::from(given) * f64::from(H)];
        look(tick, sent, given_out);
    }
}

/// The mean of a block has no more energy than the block (Jensen), and the same sum.
#[test]
fn a_rate_change_keeps_the_sum_of_a_wave_and_adds_no_energy() {
    for every in [1, 2, 3, 10, 100] {
        for policy in ["ZERO", "HOLD", "LIMITED", "INTEGRAL"] {
            let (mut displacements, mut last) = (vec![0.0], 0.0);
            rate_run(policy, every, 0.0, 0, |tick, sent, given_out| {
                assert!(
                    given_out[0] <= sent[0] * (1.0 + 1e-6),
                    "{policy}, {every}, {tick}: {given_out:?} of {sent:?}"
                );
                // A block is output from the tick in which it is sent until the tick before the next block.
                displacements.push(sent[1]);
                last = given_out[1];
                let (block, part) = ((tick + 1) / every, (tick + 1) % every);
                if block > 0 && part == every - 1 {
                    let expected = displacements[(block * every) as usize];
                    assert!(
                        (last - expected).abs() < 1e-6,
                        "{policy}, {every}, {tick}: {last} of {expected}"
                    );
                }
            });
            assert!(last != 0.0);
        }
    }
}

#[test]
fn no_loss_and_no_jitter_makes_energy_out_of_a_rate_change() {
    for every in [2, 5, 20] {
        for (policy, loss, jitter) in
            [("ZERO", 0.2, 0), ("ZERO", 0.1, 30), ("LIMITED", 0.2, 0), ("LIMITED", 0.1, 30)]
        {
            rate_run(policy, every, loss, jitter, |tick, sent, given_out| {
                assert!(
                    given_out[0] <= sent[0] * (1.0 + 1e-6),
                    "{policy}, {every}, {tick}: {given_out:?} of {sent:?}"
                );
            });
        }
        // Everything lost or late is made up for.
        let mut difference = 0.0;
        rate_run("INTEGRAL", every, 0.2, 7, |_, sent, given_out| difference = sent[1] - given_out[1]);
        assert!(difference.abs() < 0.02, "{every}: {difference}");
    }
}

#[test]
fn packets_that_are_early_wait_and_none_is_cut_short() {
    let every = 10;
    let mut random = Pcg32::seed_from_u64(80);
    let mut way = Way::every("COMM_RXMOD STALE ZERO", every);
    let (mut line, mut last_arrival): (Vec<(u32, Packet)>, u32) = (Vec::new(), 0);
    let mut given_out = 0.0;
    for tick in 1..=20_000 {
        if let Some(packet) = way.try_send(1.0) {
            last_arrival = (tick + random.next_u32() % 8).max(last_arrival);
            line.push((last_arrival, packet));
        }
        let due = line.first().is_some_and(|(arrival, _)| *arrival <= tick).then(|| line.remove(0).1);
        given_out += way.receive(&due);
    }
    assert_eq!((way.count("LINK_LOST"), way.count("LINK_REFUSED")), (0, 0));
    assert!(given_out >= 19_980.0, "{given_out}");
}
