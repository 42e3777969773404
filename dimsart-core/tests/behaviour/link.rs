//! Receiver of a link: state, jitter, timeout; packets without counters.
#![expect(clippy::indexing_slicing, clippy::unwrap_used, reason = "in helpers of tests as in tests")]
#![expect(clippy::float_cmp, reason = "compared to the bit on purpose")]

use crate::common::way::{Ends, Way, sender_with};
use crate::common::{self, Bench};
use dimsart_core::{CommandError, LinkState, Packet, PacketError, ParameterError, TickResult, scheme, types};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

const SIDES: [&str; 2] = ["master", "slave"];
const NO_DATA: u32 = LinkState::NoData as u32;
const OK: u32 = LinkState::Ok as u32;
const SOME_LOST: u32 = LinkState::OkSomeLost as u32;
const REPEATED: u32 = LinkState::Repeated as u32;
const WRONG_SEQUENCE: u32 = LinkState::WrongSequence as u32;
const ERROR: u32 = LinkState::Error as u32;

#[test]
fn the_link_state_says_what_came() {
    let mut way = Way::new("COMM_RXMOD STALE ZERO");
    let packets: Vec<Packet> = (1..=20).map(|number| way.send(number as f32)).collect();
    let strange = Packet { content: 1, ..packets[12].clone() };
    let mut not_finite = packets[12].clone();
    not_finite.words[0] = f32::NAN.to_bits();
    // Index of the packet, wave, state.
    let rows = [
        (None, 0.0, NO_DATA),
        (Some(&packets[2]), 3.0, OK),
        (Some(&packets[3]), 4.0, OK),
        (None, 0.0, NO_DATA),
        (Some(&packets[5]), 6.0, SOME_LOST),
        (Some(&packets[8]), 9.0, SOME_LOST),
        (Some(&packets[8]), 0.0, REPEATED),
        (Some(&packets[7]), 0.0, WRONG_SEQUENCE),
        (Some(&packets[12]), 13.0, WRONG_SEQUENCE),
        (Some(&strange), 0.0, ERROR),
        (Some(&not_finite), 0.0, ERROR),
        (Some(&packets[13]), 14.0, OK),
    ];
    for (row, (packet, wave, state)) in rows.into_iter().enumerate() {
        assert_eq!(way.receive(packet), wave, "{row}");
        assert_eq!(way.count("LINK_STATE"), state, "{row}");
    }
    let mut damaged = packets[14].to_bytes();
    damaged[9] ^= 0x80;
    for (state, good) in [(ERROR, None), (NO_DATA, None), (OK, Some(&packets[14])), (OK, Some(&packets[15]))]
    {
        if state == ERROR || good.is_some_and(|packet| packet.counter == 16) {
            assert!(way.receiver.dimsart.receive(0, &damaged).is_err());
        }
        assert_eq!(way.receive(good) == 0.0, good.is_none());
        assert_eq!(way.count("LINK_STATE"), state);
    }
}

#[test]
fn jitter_follows_rfc_3550() {
    for every in [1, 4, 10] {
        let mut random = Pcg32::seed_from_u64(60);
        let mut way = Way::every("", every);
        let (mut expected, mut previous) = (0.0, None::<(i64, i64)>);
        let mut line: Vec<(i64, Packet)> = Vec::new();
        let mut last_arrival = 0;
        for tick in 0..4000_i64 {
            if let Some(packet) = way.try_send(1.0) {
                last_arrival = (tick + i64::from(random.next_u32() % 4)).max(last_arrival);
                line.push((last_arrival, packet));
            }
            let due = line.iter().take_while(|(arrival, _)| *arrival <= tick).count();
            let due: Vec<Packet> = line.drain(..due).map(|(_, packet)| packet).collect();
            // Of several packets the newest counts, from its arrival, even if it has to wait.
            if let Some(packet) = due.last() {
                let sent = i64::from(packet.counter) * i64::from(every);
                if let Some((came, was_sent)) = previous {
                    let deviation = ((tick - came) - (sent - was_sent)).abs() as f32;
                    expected += (deviation - expected) / 16.0;
                }
                previous = Some((tick, sent));
            }
            way.receive(&due);
            if way.count("LINK_AGE") == 0 {
                common::assert_close(way.receiver.signal("LINK_JITTER")[0], expected, 1e-5);
            }
        }
        assert!(expected > 0.3, "{every}: {expected}");
    }
}

/// Returns the result of the receiver's tick, with this packet or none.
fn outcome(way: &mut Way, packet: Option<&Packet>) -> TickResult {
    if let Some(packet) = packet {
        way.receiver.dimsart.receive(0, &packet.to_bytes()).unwrap();
    }
    way.receiver.dimsart.set_motion_allowed(true);
    way.receiver.try_tick(&[]).0
}

#[test]
fn nineteen_lost_ticks_never_trip_and_twenty_always_do() {
    for every in [1, 2, 5] {
        for lost_ticks in (1..=25).chain([100, 1000]) {
            let mut way = Way::every("", every);
            let burst = 50..50 + lost_ticks;
            let mut tripped = None;
            let mut last_accepted = 0;
            for tick in 1..1300 {
                let packet = way.try_send(1.0);
                // Packets due during the burst are missing.
                let packet = packet.filter(|_| !burst.contains(&tick));
                let is_lost = outcome(&mut way, packet.as_ref()) != TickResult::Ran;
                if packet.is_some() && tripped.is_none() {
                    last_accepted = tick;
                }
                if is_lost {
                    tripped.get_or_insert(tick);
                    assert_eq!(way.count("LINK_STATE"), LinkState::Timeout as u32);
                }
                assert_eq!(is_lost, tripped.is_some(), "latched");
            }
            // A packet was due `every` ticks after the last one: later ticks without a packet count.
            let every_ticks = every as i32;
            let next_due = |tick: i32| (tick + every_ticks - 1) / every_ticks * every_ticks;
            let (first_missing, end) = (next_due(50), next_due(50 + lost_ticks));
            let silent = end - first_missing;
            assert_eq!(tripped.is_some(), silent >= 20, "every {every}, burst of {lost_ticks}: {tripped:?}");
            if let Some(tick) = tripped {
                assert_eq!(tick - last_accepted, 19 + every as i32, "every {every}, burst of {lost_ticks}");
            }
        }
    }
}

/// Runs a tick of both sides, with or without a packet to the receiver; returns the command and the packet's
/// age.
fn commanded_and_age(sender: &mut Bench, receiver: &mut Bench, receives: bool) -> (TickResult, f32, u32) {
    sender.tick(&[2.5]);
    let packet = sender.dimsart.take_outgoing(0).unwrap();
    if receives {
        receiver.dimsart.receive(0, &packet.to_bytes()).unwrap();
    }
    let (tick, commanded) = receiver.try_tick(&[]);
    (tick, f32::from_bits(commanded[0].0), receiver.bits("LINK_AGE")[0])
}

#[test]
fn a_lost_link_gives_the_safe_input_until_a_reset() {
    let mut sender = Bench::of(1, &[types::FORCE], &[]);
    sender.run("COMM_TXMOD CTX_ADD_DATA FORCE\nMOD_ENG MOD_ON COMM_TXMOD");
    let mut receiver = Bench::of(1, &[], &[types::DES_FORCE]);
    receiver.run("COMM_RXMOD CRX_ADD_DATA DES_FORCE\nMOD_ENG MOD_ON COMM_RXMOD");
    let mut step = |receives| commanded_and_age(&mut sender, &mut receiver, receives);
    let lost = TickResult::LinkLost { link: 0 };
    assert!((0..100).all(|_| step(true) == (TickResult::Ran, 2.5, 0)));
    for age in 1..=19 {
        assert_eq!(step(false), (TickResult::Ran, 2.5, age));
    }
    for age in 20..30 {
        assert_eq!(step(false), (lost, 0.0, age));
    }
    // It keeps receiving and stays lost.
    assert!((0..100).all(|_| step(true) == (lost, 0.0, 0)));
    assert_eq!(receiver.dimsart.refused_ticks(), 0);
    receiver.rows("MOD_ENG MOD_RESET COMM_RXMOD");
    let mut step = |receives| commanded_and_age(&mut sender, &mut receiver, receives);
    assert!((0..10).all(|_| step(true) == (lost, 0.0, 0)), "its module does not reset a fault");
    receiver.rows("MOD_ENG RESET");
    let mut step = |receives| commanded_and_age(&mut sender, &mut receiver, receives);
    assert!((0..100).all(|_| step(true) == (TickResult::Ran, 2.5, 0)));
}

/// A module fault and a link fault in the same tick: the next reset ends both.
#[test]
fn a_link_that_was_lost_behind_another_fault_is_not_lost_after_the_reset() {
    let mut sender = Bench::of(1, &[types::DES_POSITION], &[]);
    sender.run("COMM_TXMOD CTX_ADD_DATA DES_POSITION\nMOD_ENG MOD_ON COMM_TXMOD");
    let mut receiver = Bench::of(1, &[types::POSITION], &[types::DES_FORCE]);
    receiver.run(
        "COMM_RXMOD CRX_ADD_DATA DES_POSITION\nMOD_ENG MOD_ON COMM_RXMOD\n\
         PDCTRL_MOD K_PARAM 1000\nMOD_ENG MOD_ON PDCTRL_MOD",
    );
    let mut step = |receiver: &mut Bench, position_m, receives| {
        sender.tick(&[0.0]);
        let packet = sender.dimsart.take_outgoing(0).unwrap();
        if receives {
            receiver.dimsart.receive(0, &packet.to_bytes()).unwrap();
        }
        receiver.try_tick(&common::words(&[position_m])).0
    };
    assert!((0..10).all(|_| step(&mut receiver, 0.0, true) == TickResult::Ran));
    assert!((0..30).all(|_| matches!(step(&mut receiver, 1e30, false), TickResult::ModuleFailed(_))));
    assert_eq!(receiver.bits("LINK_STATE"), [LinkState::Timeout as u32]);
    receiver.rows("MOD_ENG RESET");
    assert!((0..30).all(|_| step(&mut receiver, 0.0, true) == TickResult::Ran));
}

#[test]
fn a_link_without_a_first_packet_is_down_until_it_comes() {
    let down = TickResult::LinkDown { link: 0 };
    let mut way = Way::timed("");
    assert!((0..19).all(|_| outcome(&mut way, None) == TickResult::Ran));
    assert!((0..1000).all(|_| outcome(&mut way, None) == down));
    assert_eq!(way.count("LINK_STATE"), LinkState::NoData as u32);
    let packet = way.send(1.0);
    assert_eq!(outcome(&mut way, Some(&packet)), down, "modules begin in the next tick");
    assert!((0..19).all(|_| outcome(&mut way, None) == TickResult::Ran));
    assert!((0..1000).all(|_| outcome(&mut way, None) == TickResult::LinkLost { link: 0 }));
    way.receiver.rows("MOD_ENG RESET");
    assert!((0..19).all(|_| outcome(&mut way, None) == TickResult::Ran));
    assert_eq!(outcome(&mut way, None), down, "a reset alone does not restore it");
    // Without a receiver there is no link.
    let mut way = Way::timed("");
    assert!((0..100).any(|_| outcome(&mut way, None) == down));
    way.receiver.rows("MOD_ENG MOD_OFF COMM_RXMOD");
    assert_eq!(outcome(&mut way, None), down);
    assert!((0..100).all(|_| outcome(&mut way, None) == TickResult::Ran));
}

/// Windup while the device waits for its peer is discarded when the peer arrives.
#[test]
fn motion_begins_anew_with_the_first_packet() {
    let mut sender = Bench::of(1, &[types::DES_POSITION], &[]);
    sender.run("COMM_TXMOD CTX_ADD_DATA DES_POSITION\nMOD_ENG MOD_ON COMM_TXMOD");
    let mut receiver = Bench::of(1, &[types::POSITION], &[types::DES_FORCE]);
    receiver.run(
        "COMM_RXMOD CRX_ADD_DATA DES_POSITION\nMOD_ENG MOD_ON COMM_RXMOD\n\
         PIDCTRL_MOD I_PARAM 1000\nMOD_ENG MOD_ON PIDCTRL_MOD",
    );
    let mut step = |receives| {
        sender.tick(&[0.0]);
        let packet = sender.dimsart.take_outgoing(0).unwrap();
        if receives {
            receiver.dimsart.receive(0, &packet.to_bytes()).unwrap();
        }
        receiver.dimsart.set_motion_allowed(true);
        let (tick, commanded) = receiver.try_tick(&common::words(&[-1.0]));
        (tick, f32::from_bits(commanded[0].0))
    };
    (0..19).for_each(|_| assert_eq!(step(false).0, TickResult::Ran));
    let down = (TickResult::LinkDown { link: 0 }, 0.0);
    assert!((0..500).all(|_| step(false) == down));
    assert_eq!(step(true), down);
    let (tick, force) = step(true);
    assert_eq!(tick, TickResult::Ran);
    assert!(force < 3.0, "windup: {force} N");
}

#[test]
fn a_timeout_that_is_switched_off_never_comes() {
    let mut way = Way::timed("COMM_RXMOD TIMEOUT_TICKS 0");
    assert!((0..1000).all(|_| outcome(&mut way, None) == TickResult::Ran));
    let mut way = Way::timed("COMM_RXMOD TIMEOUT_TICKS 0");
    let packet = way.send(1.0);
    assert_eq!(outcome(&mut way, Some(&packet)), TickResult::Ran);
    assert!((0..1000).all(|_| outcome(&mut way, None) == TickResult::Ran));
}

#[test]
fn without_counters_a_packet_is_samples_only() {
    let mut way = Way::new("COMM_RXMOD CRX_COUNTERS OFF\nCOMM_RXMOD STALE HOLD");
    let packet = way.send(1.0);
    assert_eq!(packet.words.len(), 3);
    assert_eq!(way.receive([&packet]), 0.0, "another content");
    way.sender = sender_with("COMM_TXMOD CTX_COUNTERS OFF");
    let packet = way.send(1.5);
    assert_eq!(packet.words.len(), 1);
    assert_eq!(way.receive([&packet]), 1.5);
    assert_eq!(way.receive([]), 1.5);
}

#[test]
fn policies_that_need_counters_are_refused_without_them() {
    let refused = Err(CommandError::Parameter(ParameterError::NeedsCounters));
    for policy in ["LIMITED", "INTEGRAL"] {
        let mut bench = Bench::of(1, &[], &[]);
        bench.rows("COMM_RXMOD CRX_COUNTERS OFF\nCOMM_RXMOD STALE HOLD");
        let before = bench.snapshot();
        assert_eq!(bench.order(&format!("COMM_RXMOD STALE {policy}")), refused);
        assert_eq!(bench.snapshot(), before);
        bench.rows(&format!("COMM_RXMOD CRX_COUNTERS ON\nCOMM_RXMOD STALE {policy}"));
        let before = bench.snapshot();
        assert_eq!(bench.order("COMM_RXMOD CRX_COUNTERS OFF"), refused);
        assert_eq!(bench.snapshot(), before);
    }
}

#[test]
fn a_round_trip_is_in_ticks_at_any_rate() {
    for every in [1, 2, 7] {
        let rows = format!("COMM_TXMOD CTX_EVERY {every}\nCOMM_RXMOD CRX_EVERY {every}");
        let mut ends = [Ends::end(&rows), Ends::end(&rows)];
        let mut lines: [Vec<(u32, u32, Packet)>; 2] = Default::default();
        let mut sent_at = std::collections::BTreeMap::new();
        for tick in 0..500 {
            for side in [0, 1] {
                let due = lines[side].first().is_some_and(|(arrival, ..)| *arrival <= tick);
                let received = due.then(|| lines[side].remove(0).2);
                if let Some(packet) = &received {
                    ends[side].dimsart.receive(0, &packet.to_bytes()).unwrap();
                }
                ends[side].tick(&[1.0]);
                if let Some(packet) = received.filter(|packet| packet.echo != 0) {
                    let expected: u32 = tick - sent_at[&(side, packet.echo)];
                    assert_eq!(ends[side].bits("LINK_ROUND_TRIP"), [expected], "{every}, {tick}");
                }
                if let Some(packet) = ends[side].dimsart.take_outgoing(0) {
                    sent_at.insert((side, packet.counter), tick);
                    lines[1 - side].push((tick + 4, 0, packet));
                }
            }
        }
        assert!(ends.iter().all(|end| end.bits("LINK_ROUND_TRIP")[0] >= 8));
    }
}

/// After a gap in the measurements, the device does not continue with old values.
#[test]
fn time_goes_on_for_a_link_while_measurements_are_refused() {
    for (missed, is_alive) in [(5, false), (19, false), (20, false), (10_000, false), (10_000, true)] {
        let mut sender = Bench::of(1, &[types::FORCE], &[]);
        sender.run("COMM_TXMOD CTX_ADD_DATA FORCE\nMOD_ENG MOD_ON COMM_TXMOD");
        let mut receiver = Bench::of(1, &[types::POSITION], &[types::DES_FORCE]);
        receiver.run("COMM_RXMOD CRX_ADD_DATA DES_FORCE\nMOD_ENG MOD_ON COMM_RXMOD");
        let mut step = |is_allowed: bool, force: f32, measured: f32, arrives: bool| {
            sender.tick(&[force]);
            let packet = sender.dimsart.take_outgoing(0).unwrap();
            if arrives {
                receiver.dimsart.receive(0, &packet.to_bytes()).unwrap();
            }
            receiver.dimsart.set_motion_allowed(is_allowed);
            let (tick, commanded) = receiver.try_tick(&[measured.into()]);
            (tick, f32::from_bits(commanded[0].0))
        };
        assert!((0..50).all(|_| step(true, 2.5, 0.0, true) == (TickResult::Ran, 2.5)));
        for tick in 0..missed {
            // No packet received in the meantime is left at the end.
            let (tick, force) = step(false, 2.5, f32::NAN, is_alive || tick == 0);
            assert!(matches!(tick, TickResult::MeasurementRefused(_)) && force == 0.0);
        }
        if is_alive {
            assert!((0..50).all(|_| step(true, 1.5, 0.0, true) == (TickResult::Ran, 1.5)));
        } else {
            let moved = (0..100).take_while(|_| step(true, 1.5, 0.0, false).0 == TickResult::Ran).count();
            assert_eq!(moved, 19_usize.saturating_sub(missed), "{missed}");
        }
    }
}

#[test]
fn what_a_line_gives_back_is_not_taken_for_the_other_side() {
    for text in [
        include_str!("../../../schemes/bilateral.scheme"),
        include_str!("../../../schemes/position_position.scheme"),
    ] {
        for side in SIDES {
            let mut bench = Bench::of(1, &[types::POSITION], &[types::DES_FORCE]);
            assert_eq!(scheme::load(text, side, &SIDES, &mut bench.dimsart, |_| {}), 0);
            for _ in 0..100 {
                bench.tick(&[0.1]);
                let own = bench.dimsart.take_outgoing(0).unwrap();
                assert_eq!(own.echo, 0, "{side}");
                assert_eq!(bench.dimsart.receive(0, &own.to_bytes()), Err(PacketError::Crc), "{side}");
            }
        }
    }
}
