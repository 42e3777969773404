//! Master and slave on two nucleo-g474re with one image and two stamps, over the modelled CAN bus.

use std::f64::consts::TAU;

use dimsart_core::{Command, SafetyReason, TickResult, types};
use dimsart_link::EventKind;
use dimsart_link::protocol::{NotCommandedReason, Request};

use crate::pair::{COUNTS_PER_TURN, FULL_NM, MASTER, Pair, SLAVE, SPRING_NM_PER_RAD};

/// Values of the scheme (`schemes/small_motors.scheme`).
const MASTER_NM_PER_RAD: f64 = 0.3;
const SLAVE_NM_PER_RAD: f64 = 0.5;
const IMPEDANCE_NMS_PER_RAD: f64 = 0.001;
const DELAY_TICKS: f64 = 20.0;
/// The slave's spring pulls, and the master's shaft is held here.
const HAND_RAD: f64 = 0.5;
/// Time until echoes between the ends have decayed.
const SETTLED_TICKS: u64 = 1_200;
/// Disables the timeout of the link.
const PATIENT: &[(&str, &str)] = &[("STALE", "INTEGRAL"), ("TIMEOUT_TICKS", "0")];

/// Springs in series (Niemeyer and Slotine): `1/K = 1/K_m + n h/(2 b) + 1/K_s + 1/K_e`, `N m/rad`.
fn series_nm_per_rad(round_trip_ticks: u32) -> f64 {
    let line = (f64::from(round_trip_ticks) + DELAY_TICKS) * 1e-3 / (2.0 * IMPEDANCE_NMS_PER_RAD);
    1.0 / (1.0 / MASTER_NM_PER_RAD + line + 1.0 / SLAVE_NM_PER_RAD + 1.0 / SPRING_NM_PER_RAD)
}

/// The slave's rest position agrees with the closed form, up to one count of either encoder, the quantisation of the line, and
/// the step of a duty cycle.
fn assert_closed_form(pair: &mut Pair, round_trip_ticks: u32) -> [f64; 2] {
    let mut angle_rad = 0.0;
    for _ in 0..200 {
        pair.run(1);
        angle_rad += pair.joint.state().position / 200.0;
    }
    let stiffness = series_nm_per_rad(round_trip_ticks);
    let expected_rad = HAND_RAD * stiffness / SPRING_NM_PER_RAD;
    let count_rad = TAU / COUNTS_PER_TURN;
    let duty_step_nm = FULL_NM / 4200.0;
    let allowed_rad = (2.0 * count_rad * stiffness + duty_step_nm) / SPRING_NM_PER_RAD;
    assert!(
        (angle_rad - expected_rad).abs() < allowed_rad,
        "{angle_rad} rad instead of {expected_rad} within {allowed_rad}"
    );
    [angle_rad, expected_rad]
}

fn assert_well(pair: &mut Pair) {
    for board in [MASTER, SLAVE] {
        let bench = pair.bench(board);
        assert_eq!(bench.violations(), [] as [&str; 0]);
        assert_eq!(bench.processor.faults(), []);
        assert_eq!(bench.chip().resets(), []);
    }
}

#[test]
fn two_boards_exchange_waves_and_the_slave_stands_where_the_closed_form_has_it() {
    let Some(mut pair) = Pair::start(PATIENT) else { return };
    let lost = [MASTER, SLAVE].map(|board| pair.word(board, types::LINK_LOST));
    pair.take_frames(MASTER);
    pair.take_frames(SLAVE);
    pair.run(1_000);
    for board in [MASTER, SLAVE] {
        let (passed, others) = pair.take_frames(board);
        println!("board {board}: {passed} packets in a second");
        assert!((999..=1_001).contains(&passed) && others == 0, "{passed}, {others}");
        assert_eq!(pair.blocked(board), None);
    }
    pair.turn_hand(HAND_RAD, 200);
    pair.run(SETTLED_TICKS);
    let round_trip_ticks = pair.word(MASTER, types::LINK_ROUND_TRIP);
    let [angle_rad, expected_rad] = assert_closed_form(&mut pair, round_trip_ticks);
    println!(
        "round trip {round_trip_ticks} ticks; slave at {angle_rad:.5} rad, closed form {expected_rad:.5} rad"
    );
    assert!((1..=3).contains(&round_trip_ticks), "{round_trip_ticks}");
    assert_eq!([MASTER, SLAVE].map(|board| pair.word(board, types::LINK_LOST)), lost);
    assert_well(&mut pair);
}

/// The unchanged scheme: a link that is silent for 20 ticks is lost until a reset.
#[test]
fn a_bus_that_is_cut_leaves_both_without_torque_until_they_are_reset() {
    let Some(mut pair) = Pair::start(&[]) else { return };
    pair.turn_hand(HAND_RAD, 200);
    pair.run(200);
    assert!(pair.torque_nm(SLAVE).unwrap().abs() > 1e-3);
    pair.bus.set_connected(SLAVE, false);
    pair.take_frames(MASTER);
    let mut driven_ticks = 0;
    for _ in 0..100 {
        pair.run(1);
        driven_ticks += u32::from(pair.torque_nm(SLAVE).is_some());
    }
    println!("driven for {driven_ticks} ticks after the cut");
    assert!((20..=22).contains(&driven_ticks), "{driven_ticks}");
    assert_eq!(pair.take_frames(MASTER).0, 0);
    pair.bus.set_connected(SLAVE, true);
    pair.run(150);
    for board in [MASTER, SLAVE] {
        assert!(pair.word(board, types::LINK_AGE) <= 3);
        assert!(!pair.bench(board).chip().is_can_off());
        assert_eq!(pair.blocked(board), Some(NotCommandedReason::Tick(TickResult::LinkLost { link: 0 })));
        assert_eq!(pair.torque_nm(board), None);
        assert_eq!(pair.word(board, types::CAN_REJOINS), 0);
    }
    for board in [MASTER, SLAVE] {
        pair.ask(board, &Request::Command(Command::Reset), |_| ());
        assert_eq!(pair.torque_nm(board), None);
    }
    // The lost link disabled motion.
    pair.arm();
    pair.run(300);
    for board in [MASTER, SLAVE] {
        assert_eq!(pair.blocked(board), None);
        assert!(pair.torque_nm(board).is_some());
    }
    assert_well(&mut pair);
}

/// Waiting packets are compensated by the integral policy.
#[test]
fn what_was_lost_while_the_bus_was_cut_is_made_up_for() {
    let Some(mut pair) = Pair::start(PATIENT) else { return };
    pair.turn_hand(0.2, 100);
    pair.bus.set_connected(SLAVE, false);
    pair.turn_hand(HAND_RAD, 100);
    pair.bus.set_connected(SLAVE, true);
    pair.run(SETTLED_TICKS);
    let lost = pair.word(SLAVE, types::LINK_LOST);
    println!("{lost} packets lost");
    assert!((90..=101).contains(&lost), "{lost}");
    let round_trip_ticks = pair.word(MASTER, types::LINK_ROUND_TRIP);
    assert_closed_form(&mut pair, round_trip_ticks);
    assert_well(&mut pair);
}

#[test]
fn wires_that_touch_drive_both_off_the_bus_and_both_join_it_again() {
    let Some(mut pair) = Pair::start(PATIENT) else { return };
    pair.bus.set_shorted(true);
    pair.run(20);
    assert!([MASTER, SLAVE].into_iter().all(|board| pair.bench(board).chip().is_can_off()));
    pair.bus.set_shorted(false);
    let mut off_ticks = 20;
    while [MASTER, SLAVE].into_iter().any(|board| pair.bench(board).chip().is_can_off()) {
        pair.run(1);
        off_ticks += 1;
        assert!(off_ticks < 200, "off for {off_ticks} ticks");
    }
    println!("off for {off_ticks} ticks");
    // 100 ms, then 129 sequences, polled every 10 ms.
    assert!(off_ticks >= 100, "{off_ticks}");
    pair.run(50);
    for board in [MASTER, SLAVE] {
        assert_eq!(pair.word(board, types::CAN_REJOINS), 1);
        assert!(pair.word(board, types::LINK_AGE) <= 3);
    }
    assert_well(&mut pair);
}

/// CAN bus event codes among these.
fn of_bus(events: &[u8]) -> Vec<u8> {
    let is_of_bus = |what: &&u8| (EventKind::BusOff as u8..=EventKind::BusOffPermanent as u8).contains(*what);
    events.iter().filter(is_of_bus).copied().collect()
}

/// Both boards give up a bus that is shorted for 20 ms four times in 1.7 s; after the repair, a reset joins it.
#[test]
fn a_bus_that_was_given_up_is_joined_by_a_reset_and_no_reset_hides_that_it_is_silent() {
    let Some(mut pair) = Pair::start(&[]) else { return };
    for _ in 0..4 {
        pair.bus.set_shorted(true);
        pair.run(20);
        pair.bus.set_shorted(false);
        pair.run(400);
    }
    pair.run(300);
    let [left, joined, given_up] =
        [EventKind::BusOff, EventKind::BusRejoined, EventKind::BusOffPermanent].map(|kind| kind as u8);
    for board in [MASTER, SLAVE] {
        assert!(pair.bench(board).chip().is_can_off());
        assert_eq!(pair.blocked(board), Some(NotCommandedReason::Tick(TickResult::LinkLost { link: 0 })));
        let events = pair.events(board);
        assert_eq!(of_bus(&events), [left, joined, left, joined, left, joined, left, given_up], "{events:?}");
    }
    // One board alone: its link is down, and its device gets the safe value.
    pair.ask(MASTER, &Request::Command(Command::Reset), |_| ());
    pair.arm();
    pair.run(100);
    assert!(!pair.bench(MASTER).chip().is_can_off());
    assert_eq!(pair.blocked(MASTER), Some(NotCommandedReason::Tick(TickResult::LinkDown { link: 0 })));
    assert_eq!(pair.torque_nm(MASTER), None);
    // With the other board: both move.
    pair.ask(SLAVE, &Request::Command(Command::Reset), |_| ());
    pair.run(50);
    pair.arm();
    pair.run(300);
    for board in [MASTER, SLAVE] {
        assert!(!pair.bench(board).chip().is_can_off());
        assert!(pair.word(board, types::LINK_AGE) <= 3);
        assert_eq!(pair.blocked(board), None);
        assert!(pair.torque_nm(board).is_some());
        let events = pair.events(board);
        assert_eq!(of_bus(&events).last(), Some(&joined), "{events:?}");
    }
    assert_well(&mut pair);
}

/// Crystals that differ by 2 %: no packet passes.
#[test]
fn boards_that_never_hear_each_other_are_not_driven_and_say_why() {
    let Some(mut pair) = Pair::power_up(&[], 1.02) else { return };
    pair.run(100);
    pair.arm();
    for _ in 0..30 {
        pair.run(100);
        for board in [MASTER, SLAVE] {
            let blocked = pair.blocked(board);
            assert!(
                matches!(
                    blocked,
                    Some(
                        NotCommandedReason::Tick(TickResult::LinkDown { link: 0 })
                            | NotCommandedReason::Tick(TickResult::LinkLost { link: 0 })
                    )
                ),
                "{blocked:?}"
            );
            assert_eq!(pair.torque_nm(board), None);
        }
    }
    let events = pair.events(MASTER);
    assert!(events.contains(&SafetyReason::LinkDown.number()), "{events:?}");
}

/// The board that is armed first waits for the other.
#[test]
fn a_board_that_is_armed_before_its_peer_is_there_moves_when_it_is() {
    let Some(mut pair) = Pair::power_up(&[], 1.0) else { return };
    pair.bus.set_connected(SLAVE, false);
    pair.run(100);
    pair.arm();
    pair.run(300);
    for board in [MASTER, SLAVE] {
        assert_eq!(pair.blocked(board), Some(NotCommandedReason::Tick(TickResult::LinkDown { link: 0 })));
        assert_eq!(pair.torque_nm(board), None);
    }
    pair.bus.set_connected(SLAVE, true);
    pair.run(200);
    for board in [MASTER, SLAVE] {
        assert_eq!(pair.blocked(board), None);
        assert!(pair.torque_nm(board).is_some());
    }
    assert_well(&mut pair);
}
