//! Counter overflow, and restart of either side.
#![expect(clippy::float_cmp, reason = "compared to the bit on purpose")]

use crate::common::way::{Ends, Way, sender, sender_with};
use crate::common::{self, Bench, DelayedLink};
use dimsart_core::{Packet, PacketError, types};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

#[test]
fn counters_may_wrap_and_nothing_is_lost_or_used_twice() {
    for policy in ["ZERO", "INTEGRAL"] {
        let mut random = Pcg32::seed_from_u64(50);
        let mut way = Way::new(&format!("COMM_RXMOD STALE {policy}"));
        let (mut sent, mut given_out, mut accepted) = (0.0, 0.0, 0);
        let mut late: Option<Packet> = None;
        for number in 1..=200_000_u32 {
            // Around the overflow every third packet is lost, and some are repeated after newer ones.
            let is_near = (number + 300) % 65_435 < 600;
            let packet = way.send(1.0);
            sent += 1.0;
            let arrives = !is_near || random.next_u32() % 3 != 0;
            accepted += u32::from(arrives);
            let old = late.take_if(|_| arrives && random.next_u32() % 2 == 0);
            let given = way.receive(old.iter().chain(arrives.then_some(&packet)));
            given_out += f64::from(given);
            if arrives {
                assert_eq!(way.count("LINK_AGE"), 0, "{policy}, {number}");
                assert_eq!(way.count("LINK_LOST"), number - accepted, "{policy}, {number}");
                late = Some(packet);
            }
            assert!(given >= 0.0 && given_out <= sent + 1e-3, "{policy}, {number}: {given_out} of {sent}");
        }
        if policy == "INTEGRAL" {
            common::assert_close(given_out, sent, 1e-6);
        }
    }
}

#[test]
fn a_channel_hears_only_its_own_packets() {
    let mut way = Way::new("COMM_RXMOD CRX_CHANNEL 2047");
    assert_eq!(way.receiver.dimsart.receive_channel(0), 2047);
    assert_eq!(way.receiver.dimsart.receive_channel(1), 0);
    let packet = way.send(1.0);
    assert_eq!(way.receiver.dimsart.receive(0, &packet.to_bytes()), Err(PacketError::Crc));
    way.sender = sender_with("COMM_TXMOD CTX_CHANNEL 2047");
    let packet = way.send(1.0);
    assert_eq!((packet.channel, packet.counter), (2047, 1));
    assert_eq!(way.receive([&packet]), 1.0);
    way.receiver.rows("MOD_ENG MOD_OFF COMM_RXMOD");
    assert_eq!(way.receiver.dimsart.receive_channel(0), 0, "no receiver");
}

/// Counters wrap after 65 535 packets: the first packets of a restarted sender can look like later ones of
/// its previous run. Its old debt is then dropped, and no wave is invented.
#[test]
fn a_sender_that_starts_anew_at_any_counter_owes_nothing() {
    for policy in ["LIMITED", "INTEGRAL"] {
        let mut ends = Ends::new(&format!("COMM_RXMOD STALE {policy}"), 3);
        for life in [10, 500, 33_000, 65_000, 65_430] {
            let start = ends.tick;
            while ends.tick < start + life {
                ends.tick([1.0, 0.25]);
            }
            ends.ends[0] = Ends::end(&format!("COMM_RXMOD STALE {policy}"));
            let mut heard = None;
            for tick in 0..300 {
                ends.tick([0.5, 0.25]);
                let wave = ends.ends[1].signal("CH2_WAVES")[0];
                assert!((0.0..=1.001).contains(&wave), "{policy}, {life}, {tick}: {wave}");
                heard = heard.or((tick > 3 && ends.ends[1].bits("LINK_AGE") == [0]).then_some(tick));
                assert!(ends.ends[0].bits("LINK_ROUND_TRIP")[0] <= 110, "{policy}, {life}, {tick}");
            }
            assert!(heard.is_some_and(|tick| tick < 120), "{policy}, {life}: {heard:?}");
            common::assert_close(ends.ends[1].signal("CH2_WAVES")[0], 0.5, 1e-3);
        }
    }
}

#[test]
fn a_sender_that_starts_anew_is_heard_again_and_owes_nothing() {
    for policy in ["ZERO", "HOLD", "LIMITED", "INTEGRAL"] {
        let mut way = Way::new(&format!("COMM_RXMOD STALE {policy}"));
        for _ in 0..500 {
            let packet = way.send(2.0);
            way.receive([&packet]);
        }
        way.sender = sender();
        let mut heard = None;
        for tick in 0..300 {
            let packet = way.send(0.25);
            let wave = way.receive([&packet]);
            if way.count("LINK_AGE") == 0 {
                heard = heard.or(Some(tick));
            }
            let is_held = policy == "HOLD" && wave == 2.0;
            assert!(is_held || (0.0..=0.2501).contains(&wave), "{policy}, {tick}: {wave}");
        }
        assert!((90..=110).contains(&heard.unwrap()), "{policy}: {heard:?}");
        let packet = way.send(0.25);
        assert!((way.receive([&packet]) - 0.25).abs() < 1e-4, "{policy}");
    }
}

#[test]
fn a_receiver_that_comes_late_or_is_reset_is_not_owed_what_it_did_not_hear() {
    for policy in ["ZERO", "HOLD", "LIMITED", "INTEGRAL"] {
        let mut way = Way::new(&format!("COMM_RXMOD STALE {policy}"));
        for start in 0..3 {
            for _ in 0..1000 {
                way.send(1.0);
            }
            for tick in 0..50 {
                let packet = way.send(0.5);
                let wave = way.receive([&packet]);
                assert!((0.0..=0.5001).contains(&wave), "{policy}, start {start}, {tick}: {wave}");
            }
            way.receiver.rows("MOD_ENG MOD_RESET COMM_RXMOD");
        }
    }
}

#[test]
fn the_round_trip_is_measured_to_the_tick() {
    for (forward, backward) in [(1, 1), (10, 1), (3, 8), (40, 4)] {
        let mut ends: [Bench; 2] = [(); 2].map(|()| {
            let mut bench = Bench::of(3, &[types::CH1_WAVES], &[]);
            bench.run(
                "COMM_RXMOD CRX_ADD_DATA CH2_WAVES\nMOD_ENG MOD_ON COMM_RXMOD\n\
                 COMM_TXMOD CTX_ADD_DATA CH1_WAVES\nMOD_ENG MOD_ON COMM_TXMOD",
            );
            bench
        });
        let (mut there, mut back) = (DelayedLink::new(forward), DelayedLink::new(backward));
        let round_trip = forward + backward;
        for tick in 0..3 * round_trip {
            back.deliver(tick, &mut ends[0].dimsart);
            ends[0].tick(&[0.0; 3]);
            there.send(tick, &mut ends[0].dimsart);
            there.deliver(tick, &mut ends[1].dimsart);
            ends[1].tick(&[0.0; 3]);
            back.send(tick, &mut ends[1].dimsart);
            let expected = if tick < round_trip { 0 } else { u32::try_from(round_trip).unwrap() };
            assert_eq!(ends[0].bits("LINK_ROUND_TRIP"), [expected], "{forward}+{backward}, {tick}");
        }
        assert_eq!(ends[1].bits("LINK_ROUND_TRIP"), [u32::try_from(round_trip).unwrap()]);
    }
}

#[test]
fn the_round_trip_is_plausible_after_a_restart() {
    let end = || Ends::end("");
    let mut ends = [end(), end()];
    let (mut there, mut back) = (DelayedLink::new(5), DelayedLink::new(5));
    for tick in 0..1000 {
        if tick == 500 {
            ends[0] = end();
        }
        back.deliver(tick, &mut ends[0].dimsart);
        ends[0].tick(&[0.0]);
        there.send(tick, &mut ends[0].dimsart);
        there.deliver(tick, &mut ends[1].dimsart);
        ends[1].tick(&[0.0]);
        back.send(tick, &mut ends[1].dimsart);
        for (side, end) in ends.iter().enumerate() {
            let found = end.bits("LINK_ROUND_TRIP")[0];
            assert!(found <= 200, "side {side} at {tick}: {found} ticks");
        }
    }
}

#[test]
fn age_counts_the_ticks_since_the_last_new_packet() {
    let mut way = Way::new("");
    for expected in 1..=3 {
        way.receive([]);
        assert_eq!(way.count("LINK_AGE"), expected);
    }
    let packet = way.send(1.0);
    way.receive([&packet]);
    assert_eq!(way.count("LINK_AGE"), 0);
    for expected in 1..100 {
        way.receive([&packet]);
        assert_eq!(way.count("LINK_AGE"), expected, "an old packet does not reset the age");
    }
}

#[test]
fn one_old_packet_is_no_restart() {
    let mut way = Way::new("COMM_RXMOD STALE ZERO");
    let packets: Vec<Packet> = (0..10).map(|_| way.send(3.0)).collect();
    assert_eq!(way.receive([&packets[5]]), 3.0);
    (0..200).for_each(|_| assert_eq!(way.receive([]), 0.0));
    // Nor are two that do not increase; their successor is accepted at once.
    for old in [4, 3, 3, 5] {
        assert_eq!(way.receive([&packets[old]]), 0.0, "packet {old}");
    }
    assert_eq!(way.receive([&packets[6]]), 3.0);
    (0..200).for_each(|_| assert_eq!(way.receive([]), 0.0));
    assert_eq!(way.receive([&packets[5]]), 0.0, "one old packet in each silence");
    assert_eq!(way.receive([&packets[7]]), 3.0);
}

/// A packet that waited may be old, and from the sender's previous run.
#[test]
fn what_came_before_the_receiver_started_is_not_used() {
    let pauses = [
        ["MOD_ENG STOP", "MOD_ENG MATCHING_CHECK"],
        ["MOD_ENG MOD_OFF COMM_RXMOD", "MOD_ENG MOD_ON COMM_RXMOD"],
    ];
    for [stop, start] in pauses {
        let mut way = Way::new("COMM_RXMOD STALE HOLD");
        let mut packet = way.send(1.0);
        for _ in 0..2000 {
            assert_eq!(way.receive([&packet]), 1.0);
            packet = way.send(1.0);
        }
        way.receiver.rows(stop);
        for _ in 0..2 {
            let packet = way.send(7.0);
            way.receiver.dimsart.receive(0, &packet.to_bytes()).unwrap();
        }
        way.sender = sender();
        way.receiver.rows(start);
        assert_eq!(way.receive([]), 0.0, "{start}");
        assert_eq!(way.count("LINK_AGE"), 1, "{start}");
        let packet = way.send(0.5);
        assert_eq!(way.receive([&packet]), 0.5, "{start}: its first packet is accepted at once");
    }
}

/// A packet received while the receiver was isolated is old; its sender may have restarted.
#[test]
fn a_receiver_that_was_cut_out_begins_with_what_comes_then() {
    let mut way = Way::timed("");
    for _ in 0..500 {
        let packet = way.send(0.5);
        way.receive([&packet]);
    }
    // No wave is so large: the module that outputs it has failed.
    let packet = way.send(1e30);
    way.receiver.dimsart.receive(0, &packet.to_bytes()).unwrap();
    way.receiver.try_tick(&[]);
    assert!(way.receiver.dimsart.engine().module_fault().is_some());
    let packet = way.send(0.5);
    way.receiver.dimsart.receive(0, &packet.to_bytes()).unwrap();
    way.sender = sender();
    way.receiver.rows("MOD_ENG RESET");
    for tick in 0..100 {
        let packet = way.send(0.25);
        assert_eq!((way.receive([&packet]), way.count("LINK_AGE")), (0.25, 0), "{tick}");
    }
}
