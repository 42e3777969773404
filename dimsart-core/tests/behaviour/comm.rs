//! Two controllers over a bad line: no packet is used twice or invented, and all are counted.
#![expect(clippy::cast_possible_truncation, clippy::float_cmp, reason = "rounded and compared on purpose")]

use crate::common::way::{Way, chance, energy};
use crate::common::{Bench, H};
use dimsart_core::{MAX_PACKET_BYTES, Packet, PacketError, types};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

#[test]
fn a_packet_is_used_once_and_never_after_a_newer_one() {
    let mut random = Pcg32::seed_from_u64(1);
    let mut way = Way::new("COMM_RXMOD STALE ZERO");
    let mut line: Vec<Packet> = Vec::new();
    let (mut newest, mut accepted, mut delivered) = (0, 0, 0);
    for number in 1..=20_000_u16 {
        let packet = way.send(f32::from(number));
        // Lost, duplicated, and up to four of the last packets in any order.
        for _ in 0..[0, 1, 1, 2][random.next_u32() as usize % 4] {
            let place = random.next_u32() as usize % (line.len() + 1);
            line.insert(place, packet.clone());
        }
        let due = line.len().saturating_sub(random.next_u32() as usize % 6);
        let arriving: Vec<Packet> = line.drain(..due).collect();
        delivered += arriving.len();
        let wave = way.receive(&arriving);
        let best = arriving.iter().map(|packet| packet.counter).max().unwrap_or(0);
        if best > newest {
            newest = best;
            accepted += 1;
            assert_eq!(f64::from(wave), f64::from(newest), "the newest packet, as it was sent");
            assert_eq!(way.count("LINK_AGE"), 0);
        } else {
            assert_eq!(wave, 0.0, "no new packet, no output");
        }
        assert_eq!(way.count("LINK_LOST"), u32::from(newest) - accepted);
        assert_eq!(way.count("LINK_REFUSED"), u32::try_from(delivered).unwrap() - accepted);
    }
    assert!(accepted > 5_000 && newest > 19_000);
}

/// Random waves over a lossy line; `look` gets what was sent, whether it arrived, and the output.
fn lossy_run(policy: &str, loss: f64, seed: u64, mut look: impl FnMut(f32, bool, f32)) -> Way {
    let mut random = Pcg32::seed_from_u64(seed);
    let mut way = Way::new(&format!("COMM_RXMOD STALE {policy}"));
    let mut slow = 0.0;
    for _ in 0..100_000 {
        // Slow motion with noise, so that the debt both accumulates and cancels.
        slow = 0.999 * slow + 0.05 * (chance(&mut random) - 0.5);
        let wave = (3.0 * slow + 0.5 * (chance(&mut random) - 0.5)) as f32;
        let packet = way.send(wave);
        let arrives = chance(&mut random) >= loss;
        let given = way.receive(arrives.then_some(&packet));
        look(wave, arrives, given);
    }
    way
}

const LOSSES: [f64; 4] = [0.0, 0.01, 0.1, 0.5];

#[test]
fn zero_gives_out_no_more_energy_than_was_sent() {
    for (loss, seed) in LOSSES.into_iter().zip(10..) {
        let (mut sent, mut given_out) = (0.0, 0.0);
        lossy_run("ZERO", loss, seed, |wave, arrives, given| {
            assert_eq!(given, if arrives { wave } else { 0.0 });
            sent += energy(wave);
            given_out += energy(given);
            assert!(given_out <= sent);
        });
        assert!(loss == 0.0 || given_out < (1.0 - loss / 2.0) * sent);
    }
}

#[test]
fn limited_never_gives_out_more_energy_than_it_has_received() {
    for (loss, seed) in LOSSES.into_iter().zip(20..) {
        let (mut sent, mut received, mut given_out) = (0.0, 0.0, 0.0);
        lossy_run("LIMITED", loss, seed, |wave, arrives, given| {
            sent += energy(wave);
            if arrives {
                received = sent;
            }
            given_out += energy(given);
            assert!(given_out <= received, "loss {loss}: {given_out} J of {received} J");
        });
        assert!(given_out > 0.5 * received, "loss {loss}: output {given_out} J of {received} J");
    }
}

#[test]
fn limited_hands_waves_through_while_nothing_is_lost() {
    // The wave whose energy in one tick is one count, 2^-30 J: less may be deferred.
    let smallest = (2.0 / 1_073_741_824.0 / f64::from(H)).sqrt();
    let (mut owed, mut volume) = (0.0, 0.0);
    lossy_run("LIMITED", 0.0, 25, |wave, _, given| {
        owed += f64::from(wave) - f64::from(given);
        volume += f64::from(wave).abs();
        assert!((f64::from(given) - f64::from(wave)).abs() <= smallest, "{given} of {wave}");
    });
    assert!(owed.abs() < 1e-4 * volume, "{owed} of {volume}");
}

#[test]
fn integral_gives_out_all_that_was_sent_to_the_counter_quantum() {
    const QUANTUM: f64 = 1.0 / 268_435_456.0;
    for (loss, seed) in LOSSES.into_iter().zip(30..) {
        let (mut sent, mut given_out, mut volume) = (0.0, 0.0, 0.0);
        let mut way = lossy_run("INTEGRAL", loss, seed, |wave, _, given| {
            sent += f64::from(H) * f64::from(wave);
            given_out += f64::from(H) * f64::from(given);
            volume += f64::from(H) * f64::from(wave).abs();
        });
        let last = way.send(0.0);
        given_out += f64::from(H) * f64::from(way.receive([&last]));
        // One count, plus the f32 rounding of each output wave.
        assert!((given_out - sent).abs() <= QUANTUM + 1e-8 * volume, "loss {loss}: {given_out} of {sent}");
        assert_eq!(way.receive([]), 0.0, "then zero");
    }
}

#[test]
fn hold_holds_for_so_many_ticks_and_no_longer() {
    for ticks in [0, 1, 20] {
        let mut way = Way::new(&format!("COMM_RXMOD STALE HOLD\nCOMM_RXMOD HOLD_TICKS {ticks}"));
        for start in [1.5, -2.5] {
            let packet = way.send(start);
            assert_eq!(way.receive([&packet]), start);
            for tick in 1..=50 {
                let expected = if tick <= ticks { start } else { 0.0 };
                assert_eq!(way.receive([&packet]), expected, "HOLD_TICKS {ticks}, {tick}");
            }
        }
    }
}

#[test]
fn signals_that_are_no_waves_keep_their_last_value() {
    for policy in ["ZERO", "HOLD", "LIMITED", "INTEGRAL"] {
        let mut sender = Bench::of(2, &[types::POSITION, types::FORCE], &[]);
        sender.run(
            "COMM_TXMOD CTX_ADD_DATA FORCE\nCOMM_TXMOD CTX_ADD_DATA POSITION\nMOD_ENG MOD_ON COMM_TXMOD",
        );
        let mut receiver = Bench::of(2, &[], &[]);
        receiver.run(&format!(
            "COMM_RXMOD TIMEOUT_TICKS 0\nCOMM_RXMOD STALE {policy}\nCOMM_RXMOD CRX_ADD_DATA FORCE.2\nCOMM_RXMOD CRX_ADD_DATA DES_POSITION\n\
             MOD_ENG MOD_ON COMM_RXMOD"
        ));
        sender.tick(&[1.0, 2.0, 3.0, 4.0]);
        let packet = sender.dimsart.take_outgoing(0).unwrap();
        receiver.dimsart.receive(0, &packet.to_bytes()).unwrap();
        for _ in 0..200 {
            receiver.tick(&[]);
            assert_eq!(receiver.signal("FORCE.2"), [3.0, 4.0], "{policy}");
            assert_eq!(receiver.signal("DES_POSITION"), [1.0, 2.0], "{policy}");
        }
    }
}

#[test]
fn damaged_and_foreign_packets_are_refused_and_counted() {
    let mut way = Way::new("");
    let good = way.send(1.0);
    let mut damaged = good.to_bytes();
    damaged[8] ^= 4;
    let elsewhere = Packet { channel: 7, ..good.clone() }.to_bytes();
    let dimsart = &mut way.receiver.dimsart;
    assert_eq!(dimsart.receive(0, &damaged), Err(PacketError::Crc));
    assert_eq!(dimsart.receive(0, &elsewhere), Err(PacketError::Crc));
    assert_eq!(dimsart.receive(0, &[]), Err(PacketError::Length { bytes: 0 }));
    let long = [2; MAX_PACKET_BYTES + 54];
    assert_eq!(dimsart.receive(0, &long), Err(PacketError::Length { bytes: long.len() }));
    assert_eq!(
        dimsart.receive(dimsart_core::limits::Capacities::DEFAULT.links, &good.to_bytes()),
        Err(PacketError::NoLink)
    );
    assert_eq!(way.receive([]), 0.0);
    assert_eq!(way.count("LINK_REFUSED"), 4);
    let mut short = good.clone();
    short.words.pop();
    assert_eq!(way.receive([&short]), 0.0, "wrong content");
    assert_eq!((way.count("LINK_REFUSED"), way.count("LINK_AGE")), (5, 2));
    assert_eq!(way.receive([&good]), 1.0);
}

#[test]
fn limited_charges_a_large_wave_with_all_its_energy() {
    let mut way = Way::new("COMM_RXMOD STALE LIMITED");
    let (mut sent, mut given) = (0.0, 0.0);
    let mut last = way.send(0.0);
    way.receive([&last]);
    for _ in 0..4 {
        last = way.send(40.0);
        sent += energy(40.0);
    }
    given += energy(way.receive([&last]));
    for _ in 0..10 {
        given += energy(way.receive([]));
        assert!(given <= sent, "{given} J output, {sent} J received");
    }
}

#[test]
fn a_debt_that_cannot_be_paid_is_not_paid_with_the_wrong_sign() {
    let mut way = Way::new("COMM_RXMOD STALE LIMITED");
    for tick in 0..20_000 {
        let packet = way.send(4.0);
        let given = way.receive((tick % 2 == 0).then_some(&packet));
        assert!(given >= 0.0, "{tick}: {given} of a wave that was always 4");
    }
}

#[test]
fn a_reset_of_the_sender_is_not_a_wave() {
    for policy in ["LIMITED", "INTEGRAL"] {
        for rows in ["MOD_ENG MOD_RESET COMM_TXMOD", "MOD_ENG MOD_OFF COMM_TXMOD\nMOD_ENG MOD_ON COMM_TXMOD"]
        {
            let mut way = Way::new(&format!("COMM_RXMOD STALE {policy}"));
            for tick in 0..400 {
                if tick == 200 {
                    way.sender.rows(rows);
                }
                let packet = way.send(1.0);
                let given = way.receive((tick != 200).then_some(&packet));
                assert!(
                    (0.0..2.01).contains(&given),
                    "{policy}, {tick}: {given} of a wave that was always 1"
                );
            }
        }
    }
}

#[test]
fn one_wave_that_is_no_number_does_not_silence_the_channel() {
    for policy in ["LIMITED", "INTEGRAL"] {
        let mut way = Way::new(&format!("COMM_RXMOD STALE {policy}"));
        way.sender = Bench::of(1, &[types::SIGNAL], &[]);
        way.sender.run(
            "SUM_MOD PORT_SIGNAL_OUT CH1_WAVES\nSUM_MOD A_GAIN 1000000\nSUM_MOD B_GAIN -999999\n\
             MOD_ENG MOD_ON SUM_MOD\nCOMM_TXMOD CTX_ADD_DATA CH1_WAVES\nMOD_ENG MOD_ON COMM_TXMOD",
        );
        let mut given = 0.0;
        for tick in 0..200 {
            // A failed sender sends no packet until a reset.
            let is_wrong = tick == 100;
            let packet = way.try_send(if is_wrong { f32::MAX } else { 1.0 });
            assert_eq!(packet.is_none(), is_wrong, "{tick}");
            if is_wrong {
                way.sender.rows("MOD_ENG RESET");
            }
            given = way.receive(packet.as_ref().filter(|_| tick != 198));
        }
        // After the loss of one packet its wave is made up for, as far as the energy allows.
        assert!(given > 1.4, "{policy}: {given} of two waves of 1");
    }
}

#[test]
fn a_repeated_packet_is_never_used_again() {
    let mut way = Way::new("COMM_RXMOD STALE ZERO");
    let packet = way.send(3.0);
    assert_eq!(way.receive([&packet]), 3.0);
    for tick in 1..300 {
        assert_eq!(way.receive([&packet]), 0.0, "repeated after {tick} ticks");
    }
}

#[test]
fn a_wave_that_is_no_number_does_not_reach_the_other_side() {
    for policy in ["ZERO", "HOLD", "LIMITED", "INTEGRAL"] {
        let mut way = Way::new(&format!("COMM_RXMOD STALE {policy}"));
        for wave in [1.0, f32::NAN, 1.0, f32::NEG_INFINITY, 1.0] {
            let mut packet = way.send(1.0);
            packet.words[0] = wave.to_bits();
            let given = way.receive([&packet]);
            assert!(given.is_finite() && (given >= 1.0 || !wave.is_finite()), "{policy}: {given}");
        }
    }
}

#[test]
fn limited_keeps_its_account_for_waves_of_any_size() {
    for (scale, seed) in [1e-3_f64, 2e-3, 0.1, 10.0, 40.0].into_iter().zip(40..) {
        let mut random = Pcg32::seed_from_u64(seed);
        let mut way = Way::new("COMM_RXMOD STALE LIMITED");
        let (mut sent, mut received, mut given_out) = (0.0, 0.0, 0.0);
        for _ in 0..20_000 {
            let wave = (scale * (2.0 * chance(&mut random) - 1.0)) as f32;
            let packet = way.send(wave);
            sent += energy(wave);
            let arrives = chance(&mut random) < 0.7;
            if arrives {
                received = sent;
            }
            given_out += energy(way.receive(arrives.then_some(&packet)));
            assert!(given_out <= received, "{scale}: {given_out} J of {received} J");
        }
        assert!(given_out > 0.5 * received, "{scale}: {given_out} J of {received} J");
    }
}

/// Bursts of up to 2000 √W, kilojoules per tick, with packet losses: `INTEGRAL` makes up for all of them, and
/// `LIMITED` never outputs energy that its counters cannot represent.
#[test]
fn what_violent_bursts_have_moved_is_made_up_for() {
    for (policy, seed) in [("INTEGRAL", 1), ("INTEGRAL", 2), ("INTEGRAL", 3), ("LIMITED", 4), ("LIMITED", 5)]
    {
        let mut random = Pcg32::seed_from_u64(seed);
        let mut way = Way::new(&format!("COMM_RXMOD STALE {policy}"));
        let (mut sent, mut given) = ([0.0; 2], [0.0; 2]);
        for tick in 0..4000 {
            let is_burst = (500..3500).contains(&tick) && tick % 500 < 3;
            let size = if is_burst { [80.0, 100.0, 300.0, 2000.0][tick / 500 % 4] } else { 0.1 };
            let side = if is_burst && tick / 500 % 2 == 0 { 1.0 } else { chance(&mut random) - 0.5 };
            let wave = (size * side) as f32;
            sent = [sent[0] + energy(wave), sent[1] + f64::from(wave) * f64::from(H)];
            let packet = way.send(wave);
            let is_lost = (10..3600).contains(&tick) && (chance(&mut random) < 0.5 || tick % 500 < 2);
            let received = way.receive(Some(&packet).filter(|_| !is_lost));
            given = [given[0] + energy(received), given[1] + f64::from(received) * f64::from(H)];
            assert!(
                policy == "INTEGRAL" || given[0] <= sent[0] * (1.0 + 1e-6),
                "{tick}: {given:?} of {sent:?}"
            );
        }
        let left = sent[1] - given[1];
        assert!(policy == "LIMITED" || left.abs() < 1e-5, "{seed}: {left} of {sent:?} missing");
    }
}
