//! The nucleo-g474re with ST's three-phase shield, with its flash image, a motor at its bridge and either encoder.

use std::sync::LazyLock;

use dimsart_core::{SafetyReason, types};
use drive::Encoder;

use crate::client::Client;
use crate::encoders::{As5047pModel, As5600Model, Mt6701Model};
use crate::motor::{PERIOD_CYCLES, Powered};

const ABSOLUTE: [Encoder; 3] = [Encoder::As5047p, Encoder::Mt6701, Encoder::As5600];
const INCREMENTAL: Encoder = Encoder::Incremental { counts_per_turn: 4096 };
/// Maximum time until motion is enabled and the rotor is aligned.
const LONGEST_ALIGNING_S: f64 = 8.0;

/// A board with enabled motor and arbitrary rotor position; `None` without images.
fn started(encoder: Encoder) -> Option<(Powered, Client)> {
    let mut powered = Powered::with_shield(encoder)?;
    powered.motor.set_rotor(0.3, 0.0);
    powered.run_for(0.3);
    let mut client = Client::new(&mut powered);
    client.take_lease(&mut powered);
    Some((powered, client))
}

/// A board with an incremental encoder after the alignment. Created once for all tests.
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
    // Includes that no half bridge was ever short-circuited.
    assert_eq!(powered.bench.violations(), [] as [&str; 0]);
    assert_eq!(powered.bench.processor.faults(), []);
}

/// A torque step on a locked rotor.
fn follow_a_step((mut powered, mut client): (Powered, Client), name: &str) {
    powered.lock(true);
    // 0.05 N m/A. The board limits the slew to 5 A in 10 ms.
    let (wanted_nm, wanted_a) = (0.15_f32, 3.0);
    client.want(&mut powered, wanted_nm);
    let (mut max_a, mut reached_s) = (0.0_f64, None);
    let begun_s = powered.time_s();
    while powered.time_s() < begun_s + 0.05 {
        client.period(&mut powered);
        let state = powered.motor.state();
        max_a = max_a.max(state.quadrature_a);
        if state.quadrature_a > 0.95 * wanted_a && reached_s.is_none() {
            reached_s = Some(powered.time_s() - begun_s);
        }
    }
    let made_nm = powered.motor.torque_nm();
    eprintln!("{name}: {made_nm:.4} N m, at most {max_a:.3} A, after {reached_s:?} s");
    assert!((made_nm - f64::from(wanted_nm)).abs() < 0.03 * f64::from(wanted_nm), "{made_nm} N m");
    assert!(max_a < 1.1 * wanted_a, "{max_a} A");
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
        // No alignment: the configuration contains the position of the magnets.
        assert!((started.0.motor.state().angle_rad - 0.3).abs() < 1e-3);
        follow_a_step(started, &format!("{encoder:?}"));
    }
}

#[test]
fn the_age_of_an_absolute_angle_is_made_up_for_while_the_rotor_turns() {
    for encoder in ABSOLUTE {
        let Some((mut powered, mut client)) = started(encoder) else { return };
        // Small enough to neglect its acceleration.
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
        let middle = powered.chip().next_low_side_midpoint().unwrap() - PERIOD_CYCLES;
        let chip = powered.chip();
        let asked = chip.spi_selected_at("SPI3").or_else(|| chip.i2c_read_at("I2C4")).unwrap();
        #[expect(clippy::cast_precision_loss, reason = "a few periods")]
        let share = (asked as f64 - middle as f64) / PERIOD_CYCLES as f64;
        let askew_rad = sum / periods;
        eprintln!(
            "{encoder:?}: angle error of the current {askew_rad:.4} rad; sampled {share:.3} of a period after the middle"
        );
        // Without compensation the angle would lag by 0.033 rad, and with an AS5600 by 0.2 rad.
        // With half as many readings, the observer lags more during acceleration.
        let max_rad = if encoder == Encoder::As5600 { 0.02 } else { 0.012 };
        assert!(askew_rad.abs() < max_rad, "{askew_rad}");
        // As in `boards/src/current_loop.rs`. An AS5600 has received two bytes when it samples its angle: 18.5 bits of 1.15 us.
        if encoder == Encoder::As5600 {
            let taken = share.rem_euclid(1.0) + 18.5 * 1.15 / 50.0;
            assert!((2.0 - taken - 1.51).abs() < 0.03, "{share}");
        } else {
            assert!((1.0 - share - 0.785).abs() < 0.03, "{share}");
        }
        assert_eq!(client.reason(&mut powered), None);
        assert_sound(&powered);
    }
}

#[test]
fn a_period_of_the_current_loop_takes_a_quarter_of_its_time_at_most_with_any_encoder() {
    for (encoder, board) in
        ABSOLUTE.map(|encoder| (encoder, started(encoder))).into_iter().chain([(INCREMENTAL, aligned())])
    {
        let Some((mut powered, mut client)) = board else { return };
        client.want(&mut powered, 0.05);
        client.run_for(&mut powered, 0.01);
        let mut cycles = [0; 100].map(|_: u64| powered.current_loop_cycles());
        cycles.sort_unstable();
        eprintln!("{encoder:?}: {} to {} cycles, median {}", cycles[0], cycles[99], cycles[50]);
        assert!(cycles[99] < PERIOD_CYCLES / 4, "{cycles:?}");
    }
}

#[test]
fn an_absolute_encoder_that_is_unplugged_is_a_named_fault_in_the_tick_after() {
    // Three readings must be missing, plus a tick to detect it. An AS5600 is read every other period.
    for (encoder, max_periods) in ABSOLUTE.into_iter().zip([5, 5, 10]) {
        let Some((mut powered, mut client)) = started(encoder) else { return };
        client.want(&mut powered, 0.05);
        client.run_for(&mut powered, 0.05);
        assert!(powered.is_on());
        powered.plug(false);
        let unplugged = powered.bench.processor.cycles();
        client.run_for(&mut powered, 2e-3);
        let off = powered.switched.last().filter(|(_, is_on)| !is_on).unwrap();
        eprintln!("{encoder:?}: off after {} cycles", off.0 - unplugged);
        assert!(off.0 - unplugged < max_periods * PERIOD_CYCLES, "{off:?} {unplugged}");
        assert_eq!(client.reason(&mut powered), Some(SafetyReason::EncoderLost));
        assert_sound(&powered);
    }
}

#[test]
fn a_data_line_of_an_as5600_that_is_low_is_a_named_fault_and_one_that_a_reset_left_low_is_freed() {
    let Some((mut powered, mut client)) = started(Encoder::As5600) else { return };
    client.want(&mut powered, 0.05);
    client.run_for(&mut powered, 0.05);
    let mut stuck = (powered.clone(), client.clone());
    stuck.0.chip().hold_sda_low("I2C4", true);
    let held = stuck.0.bench.processor.cycles();
    stuck.1.run_for(&mut stuck.0, 2e-3);
    let off = stuck.0.switched.last().filter(|(_, is_on)| !is_on).unwrap();
    assert!(off.0 - held < 16 * PERIOD_CYCLES, "{off:?} {held}");
    assert_eq!(stuck.1.reason(&mut stuck.0), Some(SafetyReason::EncoderLost));
    assert_sound(&stuck.0);
    // In the middle of a byte.
    let begun = powered.chip().i2c_read_at("I2C4");
    while powered.chip().i2c_read_at("I2C4") == begun {
        powered.bench.run_until(powered.bench.processor.cycles() + 100).unwrap();
    }
    let middle = powered.bench.processor.cycles() + 5_000;
    powered.bench.run_until(middle).unwrap();
    powered.bench.reset();
    powered.run_for(0.3);
    let mut client = Client::new(&mut powered);
    client.take_lease(&mut powered);
    client.want(&mut powered, 0.02);
    client.run_for(&mut powered, 0.05);
    assert_eq!(client.reason(&mut powered), None);
    assert!(powered.is_on());
    assert_sound(&powered);
}

#[test]
fn a_magnet_that_is_too_weak_is_a_named_fault() {
    for (encoder, state) in [
        (Encoder::As5047p, As5047pModel::WEAK | 0x180),
        (Encoder::Mt6701, Mt6701Model::WEAK),
        (Encoder::As5600, As5600Model::WEAK),
    ] {
        let Some((mut powered, mut client)) = started(encoder) else { return };
        client.want(&mut powered, 0.05);
        client.run_for(&mut powered, 0.05);
        let chip = powered.chip();
        if let Some(device) = chip.spi_device("SPI3") {
            device.state[1] = state;
        }
        if let Some(device) = chip.i2c_device("I2C4") {
            device.state[1] = state;
        }
        client.run_for(&mut powered, 2e-3);
        assert!(!powered.is_on());
        assert_eq!(client.reason(&mut powered), Some(SafetyReason::EncoderMagnet));
        assert_sound(&powered);
    }
}

#[test]
fn an_absolute_encoder_whose_magnet_slips_is_a_named_fault() {
    for encoder in ABSOLUTE {
        let Some((mut powered, mut client)) = started(encoder) else { return };
        client.want(&mut powered, 0.05);
        client.run_for(&mut powered, 0.05);
        let begun_s = powered.time_s();
        let mut wrong_s = None;
        while powered.is_on() && powered.time_s() < begun_s + 0.5 {
            // A quarter of an electrical turn, within 20 ms.
            let time_s = powered.time_s() - begun_s;
            powered.slip_rad = core::f64::consts::PI / 14.0 * (time_s / 0.02).min(1.0);
            if 7.0 * powered.slip_rad > 1.05 {
                wrong_s.get_or_insert(time_s);
            }
            client.period(&mut powered);
        }
        let late_s = powered.time_s() - begun_s - wrong_s.unwrap_or(f64::MAX);
        eprintln!("{encoder:?}: off {late_s:.4} s after an error of 60°");
        client.run_for(&mut powered, 0.005);
        assert_eq!(client.reason(&mut powered), Some(SafetyReason::EncoderSlipped), "{encoder:?}");
        assert!(late_s < 0.02, "{encoder:?}: {late_s} s");
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
        assert_eq!(client.reason(&mut powered), Some(SafetyReason::Overcurrent));
        assert_sound(&powered);
    }
}
