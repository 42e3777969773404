//! The nucleo-g474re with ST's three-phase shield, as it is flashed, with a motor at its bridge and one encoder or the other.

use std::sync::LazyLock;

use dimsart_core::{Reason, types};
use drive::Encoder;

use crate::client::Client;
use crate::encoders::{As5047pModel, Mt6701Model};
use crate::motor::{PERIOD_CYCLES, Powered};

const ABSOLUTE: [Encoder; 2] = [Encoder::As5047p, Encoder::Mt6701];
const INCREMENTAL: Encoder = Encoder::Incremental { counts_per_turn: 4096 };
/// Until motion is allowed and the rotor is aligned, at most.
const LONGEST_ALIGNING_S: f64 = 8.0;

/// A board that may move its motor, whose rotor stands anywhere; none without images.
fn started(encoder: Encoder) -> Option<(Powered, Client)> {
    let mut powered = Powered::with_shield(encoder)?;
    powered.motor.set_rotor(0.3, 0.0);
    powered.run_for(0.3);
    let mut client = Client::new(&mut powered);
    client.take_lease(&mut powered);
    Some((powered, client))
}

/// And one with an incremental encoder that has aligned it. It is done once, for all tests.
fn aligned() -> Option<(Powered, Client)> {
    static ALIGNED: LazyLock<Option<(Powered, Client)>> = LazyLock::new(|| {
        let (mut powered, mut client) = started(INCREMENTAL)?;
        let begun_s = powered.time_s();
        let (mut had_current, mut direct_a) = (false, 0.0);
        while !had_current || direct_a > 0.1 {
            client.run_for(&mut powered, 0.01);
            direct_a = powered.motor.state().direct_a.abs();
            had_current |= direct_a > 1.0;
            assert!(powered.time_s() - begun_s < LONGEST_ALIGNING_S, "{:?}", client.reason(&mut powered));
        }
        client.run_for(&mut powered, 0.3);
        Some((powered, client))
    });
    ALIGNED.clone()
}

#[track_caller]
fn assert_sound(powered: &Powered) {
    // That no half bridge was ever short-circuited is among it.
    assert_eq!(powered.bench.violations(), [] as [&str; 0]);
    assert_eq!(powered.bench.processor.faults(), []);
}

/// A locked rotor gets a step of its torque.
fn follow_a_step((mut powered, mut client): (Powered, Client), name: &str) {
    powered.lock(true);
    // 0.05 N m/A. It rises as fast as the board lets it: 5 A in 10 ms.
    let (wanted_nm, wanted_a) = (0.15_f32, 3.0);
    client.want(&mut powered, wanted_nm);
    let (mut most_a, mut reached_s) = (0.0_f64, None);
    let begun_s = powered.time_s();
    while powered.time_s() < begun_s + 0.05 {
        client.period(&mut powered);
        let state = powered.motor.state();
        most_a = most_a.max(state.quadrature_a);
        if state.quadrature_a > 0.95 * wanted_a && reached_s.is_none() {
            reached_s = Some(powered.time_s() - begun_s);
        }
    }
    let made_nm = powered.motor.torque_nm();
    eprintln!("{name}: {made_nm:.4} N m, at most {most_a:.3} A, after {reached_s:?} s");
    assert!((made_nm - f64::from(wanted_nm)).abs() < 0.03 * f64::from(wanted_nm), "{made_nm} N m");
    assert!(most_a < 1.1 * wanted_a, "{most_a} A");
    assert!(reached_s.is_some_and(|reached_s| reached_s < 0.01), "{reached_s:?}");
    let told_a = client.signal(&mut powered, types::MOTOR_CURRENT.id);
    assert!((f64::from(told_a) - wanted_a).abs() < 0.1, "{told_a} A");
    assert_eq!(client.reason(&mut powered), None);
    assert_sound(&powered);
}

#[test]
fn without_current_it_measures_none_and_its_bridge_is_off() {
    let Some((mut powered, mut client)) = started(INCREMENTAL) else { return };
    let [current_a, supply_v, bridge_c] =
        [types::MOTOR_CURRENT, types::SUPPLY_VOLTAGE, types::BRIDGE_TEMPERATURE]
            .map(|signal| client.signal(&mut powered, signal.id));
    assert!(current_a.abs() < 0.05, "{current_a} A");
    assert!((supply_v - 12.0).abs() < 0.02, "{supply_v} V");
    assert!((bridge_c - 25.0).abs() < 1.0, "{bridge_c} °C");
    assert_sound(&powered);
}

#[test]
fn a_current_follows_a_step_of_the_torque_with_an_incremental_encoder() {
    let Some(aligned) = aligned() else { return };
    follow_a_step(aligned, "incremental");
}

#[test]
fn a_current_follows_a_step_of_the_torque_at_once_with_an_absolute_encoder() {
    for encoder in ABSOLUTE {
        let Some(started) = started(encoder) else { return };
        // Nothing has turned the rotor: the configuration says where its magnets are.
        assert!((started.0.motor.state().angle_rad - 0.3).abs() < 1e-3);
        follow_a_step(started, &format!("{encoder:?}"));
    }
}

#[test]
fn the_age_of_an_absolute_angle_is_made_up_for_while_the_rotor_turns() {
    for encoder in ABSOLUTE {
        let Some((mut powered, mut client)) = started(encoder) else { return };
        // So little that its acceleration is no matter.
        client.want(&mut powered, 0.05);
        let (mut sum, mut periods, mut speed_rad_per_s) = (0.0, 0.0, 0.0);
        while speed_rad_per_s < 150.0 {
            client.period(&mut powered);
            let state = powered.motor.state();
            speed_rad_per_s = state.speed_rad_per_s;
            if speed_rad_per_s > 100.0 {
                sum += state.direct_a / state.quadrature_a;
                periods += 1.0;
            }
        }
        let middle = powered.chip().next_middle().unwrap() - PERIOD_CYCLES;
        let asked = powered.chip().spi_selected_at("SPI3").unwrap();
        let (share, askew_rad) = ((asked - middle) as f64 / PERIOD_CYCLES as f64, sum / periods);
        eprintln!(
            "{encoder:?}: the current is {askew_rad:.4} rad askew; asked {share:.3} of a period after the middle"
        );
        // As old as it is, the angle would be 0.033 rad behind.
        assert!(askew_rad.abs() < 0.012, "{askew_rad}");
        // As `boards/src/current_loop.rs` has it.
        assert!((1.0 - share - 0.80).abs() < 0.03, "{share}");
        assert_eq!(client.reason(&mut powered), None);
        assert_sound(&powered);
    }
}

#[test]
fn an_absolute_encoder_that_is_unplugged_is_a_named_fault_in_the_tick_after() {
    for encoder in ABSOLUTE {
        let Some((mut powered, mut client)) = started(encoder) else { return };
        client.want(&mut powered, 0.05);
        client.run_for(&mut powered, 0.05);
        assert!(powered.is_on());
        powered.plug(false);
        let unplugged = powered.bench.processor.cycles();
        // Three readings have to be missing, and a tick to see it.
        client.run_for(&mut powered, 2e-3);
        let off = powered.switched.last().filter(|(_, is_on)| !is_on).unwrap();
        eprintln!("{encoder:?}: off after {} cycles", off.0 - unplugged);
        assert!(off.0 - unplugged < 5 * PERIOD_CYCLES, "{off:?} {unplugged}");
        assert_eq!(client.reason(&mut powered), Some(Reason::EncoderLost));
        assert_sound(&powered);
    }
}

#[test]
fn a_magnet_that_is_too_weak_is_a_named_fault() {
    for (encoder, place, state) in
        [(Encoder::As5047p, 1, As5047pModel::WEAK | 0x180), (Encoder::Mt6701, 1, Mt6701Model::WEAK)]
    {
        let Some((mut powered, mut client)) = started(encoder) else { return };
        client.want(&mut powered, 0.05);
        client.run_for(&mut powered, 0.05);
        powered.chip().spi_device("SPI3").unwrap().state[place] = state;
        client.run_for(&mut powered, 2e-3);
        assert!(!powered.is_on());
        assert_eq!(client.reason(&mut powered), Some(Reason::EncoderMagnet));
        assert_sound(&powered);
    }
}

#[test]
fn a_short_circuit_opens_the_bridge_within_two_periods() {
    let Some((mut powered, mut client)) = started(Encoder::Mt6701) else { return };
    client.want(&mut powered, 0.02);
    client.run_for(&mut powered, 0.05);
    assert!(powered.is_on());
    for short_circuit_a in [15.0, 28.0, -28.0] {
        let (mut powered, mut client) = (powered.clone(), client.clone());
        powered.short_circuit_a = short_circuit_a;
        let shown = powered.bench.processor.cycles();
        client.run_for(&mut powered, 0.1);
        let off = powered.switched.last().filter(|(_, is_on)| !is_on).unwrap();
        eprintln!("{short_circuit_a} A: off {} cycles after it could be sampled", off.0 - shown);
        assert!(off.0 - shown < PERIOD_CYCLES, "{off:?} {shown}");
        assert_eq!(client.reason(&mut powered), Some(Reason::Overcurrent));
        assert_sound(&powered);
    }
}
