//! Duplicate, late and reordered packets: none is used twice or after a newer one.

use std::collections::BTreeMap;

use dimsart_core::Packet;
use rand_core::SeedableRng;
use rand_pcg::Pcg64Mcg;

use super::{below, happens};
use crate::common::way::Way;
use test_requirements::length;

/// Sends packets `1, 2, 3, ..`, with this share duplicated and this share late by at most `depth` ticks;
/// checks the output wave, which is the packet's number, or 0 if none was used.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "whole, below 2^24"
)]
fn run(twice: f64, late: f64, depth: usize, packets: u64, seed: u64) {
    let what = format!("{twice} twice, {late} late by up to {depth}, seed {seed}");
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut way = Way::new("COMM_RXMOD STALE ZERO");
    let mut line: BTreeMap<u64, Vec<Packet>> = BTreeMap::new();
    let (mut first, mut newest, mut used, mut delivered) = (0, 0, 0, 0);
    for tick in 1..=packets + depth as u64 {
        if tick <= packets {
            let packet = way.send(tick as f32);
            let on_time = !happens(&mut random, late);
            let ticks = if on_time { 0 } else { 1 + below(&mut random, depth) };
            if happens(&mut random, twice) {
                let again = ticks + below(&mut random, depth + 1);
                line.entry(tick + again as u64).or_default().push(packet.clone());
            }
            let due = line.entry(tick + ticks as u64).or_default();
            // Packets of one tick come in any order, too.
            let place = below(&mut random, due.len() + 1);
            due.insert(place, packet);
        }
        let due = line.remove(&tick).unwrap_or_default();
        delivered += due.len() as u64;
        let number = way.receive(&due) as u64;
        if number != 0 {
            assert!(number > newest, "{what}: {number} used after {newest}");
            assert!(
                due.iter().any(|packet| packet.words[0] == (number as f32).to_bits()),
                "{what}: {number}"
            );
            (newest, used) = (number, used + 1);
            first = if first == 0 { number } else { first };
        }
    }
    // Each received packet was used or counted as refused; each packet sent since the first was used or
    // counted as lost.
    assert_eq!(delivered, used + u64::from(way.count("LINK_REFUSED")), "{what}");
    assert_eq!(newest + 1 - first, used + u64::from(way.count("LINK_LOST")), "{what}");
    assert!(used > packets / 3, "{what}: only {used} of {packets}");
}

/// 10^6 packets in the long run, with counter overflow.
#[test]
fn nothing_is_used_twice_or_out_of_order() {
    let packets = length(6_000, 70_000);
    for (seed, share) in (100..).zip([0.01, 0.1, 0.5]) {
        for (kind, depth) in [2, 3, 4, 8, 16].into_iter().enumerate() {
            let seed = seed + 10 * kind as u64;
            run(share, 0.0, depth, packets, seed);
            run(0.0, share, depth, packets, seed);
            run(share, share, depth, packets, seed);
        }
    }
}
