//! The current loop of b-g431b-esc1, with its flash image and a motor at its bridge.

use std::sync::LazyLock;

use dimsart_core::{SafetyReason, types};

use crate::client::Client;
use crate::motor::{PERIOD_CYCLES, Powered};

/// Cycles of the whole loop, from its first to its last instruction: half of the drive's period.
const MAX_LOOP_CYCLES: u64 = PERIOD_CYCLES / 6;
/// Cycles of 1 us.
const MAX_JITTER_CYCLES: u64 = 168;
/// Maximum time until motion is enabled and the rotor is aligned: `boards/src/b_g431b_esc1.rs`.
const LONGEST_ALIGNING_S: f64 = 8.0;

/// A board with aligned rotor and no torque; `None` without images. Created once for all tests.
pub(crate) fn aligned() -> Option<(Powered, Client)> {
    static ALIGNED: LazyLock<Option<(Powered, Client)>> = LazyLock::new(|| {
        let (mut powered, mut client) = started()?;
        client.take_lease(&mut powered);
        let begun_s = powered.time_s();
        let (mut had_current, mut direct_a) = (false, 0.0);
        while !had_current || direct_a > 0.1 {
            client.run_for(&mut powered, 0.01);
            direct_a = powered.motor.state().direct_a.abs();
            had_current |= direct_a > 1.0;
            assert!(powered.time_s() - begun_s < LONGEST_ALIGNING_S, "{:?}", client.reason(&mut powered));
        }
        client.run_for(&mut powered, 0.3);
        assert_eq!(client.reason(&mut powered), None);
        Some((powered, client))
    });
    ALIGNED.clone()
}

/// A board with its scheme, still disabled; `None` without images.
fn started() -> Option<(Powered, Client)> {
    let mut powered = Powered::new()?;
    powered.motor.set_rotor(0.3, 0.0);
    powered.run_for(0.3);
    let client = Client::new(&mut powered);
    Some((powered, client))
}

/// Returns the cycles from `cycle` until the bridge was switched off permanently.
fn off_after(powered: &Powered, cycle: u64) -> Option<u64> {
    let last = powered.switched.last().filter(|(_, is_on)| !is_on)?;
    last.0.checked_sub(cycle)
}

#[test]
fn without_current_it_measures_none_and_its_bridge_is_off() {
    let Some((mut powered, mut client)) = started() else { return };
    assert!(powered.switched.is_empty(), "{:?}", powered.switched);
    let [current_a, supply_v, bridge_c] =
        [types::MOTOR_CURRENT, types::SUPPLY_VOLTAGE, types::BRIDGE_TEMPERATURE]
            .map(|signal| client.signal(&mut powered, signal.id));
    assert!(current_a.abs() < 0.05, "{current_a} A");
    assert!((supply_v - 12.0).abs() < 0.02, "{supply_v} V");
    assert!((bridge_c - 25.0).abs() < 1.0, "{bridge_c} °C");
    assert_eq!(powered.bench.violations(), [] as [&str; 0]);
}

#[test]
fn a_shunt_that_shows_a_current_at_rest_is_told_and_nothing_moves() {
    let Some(mut powered) = Powered::new() else { return };
    // Its other end is not grounded.
    powered.chip().set_voltage('A', 5, 0.03);
    powered.run_for(0.3);
    let mut client = Client::new(&mut powered);
    client.take_lease(&mut powered);
    client.run_for(&mut powered, 0.2);
    assert_eq!(client.reason(&mut powered), Some(SafetyReason::CurrentSensors));
    assert!(!powered.is_on());
}

#[test]
fn a_current_follows_a_step_of_the_torque() {
    let Some((mut powered, mut client)) = aligned() else { return };
    powered.lock(true);
    // 0.05 N m/A. The board limits the slew to 5 A in 10 ms.
    let (wanted_nm, wanted_a) = (0.15_f32, 3.0);
    client.want(&mut powered, wanted_nm);
    let (mut max_a, mut max_direct_a, mut reached_s) = (0.0_f64, 0.0_f64, None);
    let begun_s = powered.time_s();
    while powered.time_s() < begun_s + 0.05 {
        client.period(&mut powered);
        let state = powered.motor.state();
        max_a = max_a.max(state.quadrature_a);
        max_direct_a = max_direct_a.max(state.direct_a.abs());
        if state.quadrature_a > 0.95 * wanted_a && reached_s.is_none() {
            reached_s = Some(powered.time_s() - begun_s);
        }
    }
    let made_nm = powered.motor.torque_nm();
    eprintln!("{made_nm:.4} N m, at most {max_a:.3} A, across {max_direct_a:.3} A, after {reached_s:?} s");
    assert!((made_nm - f64::from(wanted_nm)).abs() < 0.03 * f64::from(wanted_nm), "{made_nm} N m");
    assert!(max_a < 1.1 * wanted_a, "{max_a} A");
    assert!(max_direct_a < 0.3, "{max_direct_a} A");
    assert!(reached_s.is_some_and(|reached_s| reached_s < 0.01), "{reached_s:?}");
    let told_a = client.signal(&mut powered, types::MOTOR_CURRENT.id);
    assert!((f64::from(told_a) - wanted_a).abs() < 0.1, "{told_a} A");
    assert_eq!(powered.bench.violations(), [] as [&str; 0]);
}

#[test]
fn the_delivered_torque_is_the_commanded_one_at_every_speed() {
    let Some((powered, client)) = aligned() else { return };
    for (speed_rad_per_s, wanted_nm) in
        [(0.0, 0.25_f32), (60.0, 0.25), (60.0, -0.1), (150.0, 0.25), (150.0, -0.25)]
    {
        let (mut powered, mut client) = (powered.clone(), client.clone());
        powered.turn_at(speed_rad_per_s);
        client.run_for(&mut powered, 0.02);
        client.want(&mut powered, wanted_nm);
        client.run_for(&mut powered, 0.03);
        let (mut sum_nm, mut periods) = (0.0, 0.0);
        while periods < 400.0 {
            client.period(&mut powered);
            (sum_nm, periods) = (sum_nm + powered.motor.torque_nm(), periods + 1.0);
        }
        let error_nm = sum_nm / periods - f64::from(wanted_nm);
        eprintln!("{speed_rad_per_s} rad/s: {wanted_nm} N m and {error_nm:.4}");
        assert_eq!(client.reason(&mut powered), None, "{speed_rad_per_s} rad/s");
        // 2 %, and half a count of the converters.
        assert!(
            error_nm.abs() < 0.02 * f64::from(wanted_nm.abs()) + 0.001,
            "{speed_rad_per_s} rad/s: {error_nm}"
        );
    }
}

/// Runs until the bridge is off, at most for a time; returns the time.
fn until_off(
    powered: &mut Powered,
    client: &mut Client,
    max_s: f64,
    mut each: impl FnMut(&mut Powered, f64),
) -> f64 {
    let begun_s = powered.time_s();
    let mut time_s = 0.0;
    while powered.is_on() && time_s < max_s {
        each(powered, time_s);
        client.period(powered);
        time_s = powered.time_s() - begun_s;
    }
    client.run_for(powered, 0.005);
    time_s
}

const COUNT_RAD: f64 = core::f64::consts::TAU / 4096.0;

/// A count in each ms, 200 of them.
fn lose_counts(powered: &mut Powered, time_s: f64) {
    powered.slip_rad = -(time_s * 1e3).floor().min(200.0) * COUNT_RAD;
}

#[test]
fn an_incremental_encoder_that_loses_counts_is_a_named_fault_and_the_rotor_does_not_run_away() {
    type Slip = fn(&mut Powered, f64);
    let Some((powered, client)) = aligned() else { return };
    // Without torque the rotor is at rest; with torque the fault is detected before it is fast.
    let (mut standing, mut waiting) = (powered.clone(), client.clone());
    until_off(&mut standing, &mut waiting, 0.3, lose_counts);
    assert_eq!(waiting.reason(&mut standing), None);
    assert!(standing.motor.state().speed_rad_per_s.abs() < 1.0, "{:?}", standing.motor.state());
    waiting.want(&mut standing, 0.08);
    let after_s = until_off(&mut standing, &mut waiting, 0.5, |_, _| {});
    let speed_rad_per_s = standing.motor.state().speed_rad_per_s;
    eprintln!("0.08 N m afterwards: off after {after_s:.4} s at {speed_rad_per_s:.1} rad/s");
    assert_eq!(waiting.reason(&mut standing), Some(SafetyReason::EncoderSlipped));
    assert!(after_s < 0.05 && speed_rad_per_s.abs() < 60.0, "{after_s} s, {speed_rad_per_s} rad/s");
    // While it turns.
    let missing: Slip = |powered, _| powered.slip_rad = -0.01 * powered.motor.state().angle_rad;
    for (name, slip) in [("a count in each ms", lose_counts as Slip), ("1 % of the counts", missing)] {
        let (mut powered, mut client) = (powered.clone(), client.clone());
        // Aligned at its present position.
        let zero_rad = powered.motor.state().angle_rad;
        powered.slip_rad = if name.starts_with('1') { -0.01 * zero_rad } else { 0.0 };
        client.want(&mut powered, 0.08);
        let (mut wrong_s, mut least) = (None, 0.0_f64);
        let after_s = until_off(&mut powered, &mut client, 2.0, |powered, time_s| {
            slip(powered, time_s);
            let state = powered.motor.state();
            let begun_rad = if name.starts_with('1') { 0.01 * zero_rad } else { 0.0 };
            // 60° electrical, and 1.2 V of back-EMF.
            if 7.0 * (powered.slip_rad + begun_rad).abs() > 1.05 && state.speed_rad_per_s.abs() > 36.0 {
                wrong_s.get_or_insert(time_s);
            }
            least = least.min(state.speed_rad_per_s);
        });
        eprintln!("{name}: off after {after_s:.4} s, wrong since {wrong_s:?}, at least {least:.1} rad/s");
        assert_eq!(client.reason(&mut powered), Some(SafetyReason::EncoderSlipped), "{name}");
        assert!(
            wrong_s.is_none_or(|wrong_s| after_s - wrong_s < 0.02) && least > -30.0,
            "{name}: {after_s} s"
        );
    }
}

#[test]
fn a_saturated_shunt_and_a_short_circuit_are_named_in_every_phase_of_the_tick() {
    let Some((mut powered, mut client)) = aligned() else { return };
    powered.lock(true);
    client.want(&mut powered, 0.15);
    client.run_for(&mut powered, 0.05);
    for phase in 0..20 {
        client.period(&mut powered);
        let shunts = (0..3).flat_map(|phase| [(phase, 1.0), (phase, -1.0)]).map(Some);
        // One fault in each phase of the tick, and a short circuit in all.
        for saturated in [None].into_iter().chain(shunts.skip(phase % 6).take(1)) {
            let (mut powered, mut client) = (powered.clone(), client.clone());
            powered.saturated = saturated;
            powered.short_circuit_a = if saturated.is_none() { 80.0 } else { 0.0 };
            let reason =
                if saturated.is_none() { SafetyReason::Overcurrent } else { SafetyReason::CurrentSensors };
            client.run_for(&mut powered, 0.003);
            assert!(!powered.is_on());
            assert_eq!(client.reason(&mut powered), Some(reason), "{saturated:?}, {phase}");
        }
    }
}

#[test]
fn a_short_circuit_opens_the_bridge_within_two_periods() {
    let Some((mut powered, mut client)) = aligned() else { return };
    client.want(&mut powered, 0.02);
    client.run_for(&mut powered, 0.05);
    for short_circuit_a in [15.0, 80.0, -80.0] {
        let (mut powered, mut client) = (powered.clone(), client.clone());
        assert!(powered.is_on());
        powered.short_circuit_a = short_circuit_a;
        let shown = powered.bench.processor.cycles();
        client.run_for(&mut powered, 0.1);
        let after = off_after(&powered, shown).unwrap();
        eprintln!("{short_circuit_a} A: off {after} cycles after it could be sampled");
        // It may have started a period before it could be sampled.
        assert!(after < PERIOD_CYCLES, "{after} cycles");
        assert_eq!(client.reason(&mut powered), Some(SafetyReason::Overcurrent));
        assert_eq!(powered.bench.violations(), [] as [&str; 0]);
    }
}

#[test]
fn a_supply_out_of_its_range_opens_the_bridge() {
    let Some((powered, client)) = aligned() else { return };
    for (supply_v, reason) in [
        (28.5, SafetyReason::Overvoltage),
        (7.5, SafetyReason::Undervoltage),
        (0.0, SafetyReason::Undervoltage),
    ] {
        let (mut powered, mut client) = (powered.clone(), client.clone());
        assert!(powered.is_on());
        powered.set_supply(supply_v);
        let shown = powered.bench.processor.cycles();
        client.run_for(&mut powered, 0.1);
        let after = off_after(&powered, shown).unwrap();
        eprintln!("{supply_v} V: off after {after} cycles");
        assert!(after < 2 * PERIOD_CYCLES, "{after} cycles");
        assert_eq!(client.reason(&mut powered), Some(reason));
        assert!(!powered.is_on());
    }
}

#[test]
fn a_bridge_that_is_too_hot_or_says_nothing_of_it_is_opened() {
    let Some((powered, client)) = aligned() else { return };
    for celsius in [105.0, -60.0] {
        let (mut powered, mut client) = (powered.clone(), client.clone());
        powered.set_bridge_temperature(celsius);
        client.run_for(&mut powered, 0.1);
        assert_eq!(client.reason(&mut powered), Some(SafetyReason::Overtemperature), "{celsius} °C");
        assert!(!powered.is_on());
    }
}

#[test]
fn an_encoder_that_is_unplugged_while_the_rotor_turns_is_a_named_fault_and_the_rotor_is_aligned_anew() {
    let Some((mut powered, mut client)) = aligned() else { return };
    client.want(&mut powered, 0.01);
    while powered.motor.state().speed_rad_per_s < 28.0 {
        client.run_for(&mut powered, 0.005);
    }
    let speed_rad_per_s = powered.motor.state().speed_rad_per_s;
    assert!(speed_rad_per_s > 20.0, "{speed_rad_per_s} rad/s");
    powered.has_encoder = false;
    let (mut max_a, begun_s, unplugged) = (0.0_f64, powered.time_s(), powered.bench.processor.cycles());
    while powered.is_on() && powered.time_s() < begun_s + 1.0 {
        client.period(&mut powered);
        max_a = powered.motor.phase_a().into_iter().fold(max_a, |max_a, phase_a| max_a.max(phase_a.abs()));
    }
    let after_s = off_after(&powered, unplugged).unwrap() as f64 / 168e6;
    eprintln!("{speed_rad_per_s:.1} rad/s, at most {max_a:.2} A, off after {after_s:.4} s");
    assert!(max_a < f64::from(powered.drive.configuration.limits.trip_current_a), "{max_a} A");
    assert!(after_s < 0.1, "{after_s} s");
    client.run_for(&mut powered, 0.005);
    // An incremental encoder does not report a disconnection: the back-EMF shows it.
    assert_eq!(client.reason(&mut powered), Some(SafetyReason::EncoderLost));
    // It is connected again, at another position.
    powered.motor.set_rotor(2.0, 0.0);
    powered.has_encoder = true;
    powered.run_for(0.05);
    client.reset(&mut powered);
    let begun_s = powered.time_s();
    while powered.motor.state().direct_a.abs() < 1.0 {
        client.run_for(&mut powered, 0.01);
        assert!(powered.time_s() < begun_s + 0.5, "{:?}", client.reason(&mut powered));
    }
}

#[test]
fn the_end_of_the_lease_opens_the_bridge() {
    let Some((mut powered, _)) = aligned() else { return };
    let begun_s = powered.time_s();
    assert!(powered.is_on());
    while powered.is_on() && powered.time_s() < begun_s + 1.0 {
        powered.period();
    }
    let after_s = powered.time_s() - begun_s;
    assert!(after_s < 0.21, "{after_s} s");
}

#[test]
fn a_period_of_the_current_loop_takes_a_sixth_of_its_time_at_most() {
    const PERIODS: u64 = 500;
    let Some((mut powered, mut client)) = aligned() else { return };
    // Increasing speed, while the tick runs from flash.
    client.want(&mut powered, 0.08);
    let mut cycles = Vec::new();
    for _ in 0..PERIODS {
        client.period(&mut powered);
        cycles.push(powered.current_loop_cycles());
    }
    assert!(powered.is_on() && powered.motor.state().speed_rad_per_s > 10.0);
    let mean = cycles.iter().sum::<u64>() / PERIODS;
    let (least, most) = (cycles.iter().min().unwrap(), cycles.iter().max().unwrap());
    eprintln!("{least} to {most} cycles, mean {mean}");
    assert!(*most <= MAX_LOOP_CYCLES, "{most} cycles");
}

#[test]
fn the_current_loop_comes_in_time_while_the_command_line_is_busy() {
    let Some((mut powered, mut client)) = aligned() else { return };
    client.want(&mut powered, 0.01);
    powered.chip().take_response_cycles();
    // As many requests as are answered; then a burst, of which some are lost.
    for gap_s in [1e-3, 0.0] {
        let (mut asked, mut next_s, end_s) = (0, 0.0, powered.time_s() + 0.3);
        while powered.time_s() < end_s {
            if !powered.chip().is_receiving("USART2") && powered.time_s() >= next_s {
                next_s = powered.time_s() + gap_s;
                client.ask_in_passing(&mut powered, asked);
                asked += 1;
            }
            client.period(&mut powered);
        }
        let (least, most) = powered.chip().take_response_cycles().unwrap();
        eprintln!("{asked} requests: {least} to {most} cycles from the last sample to the loop");
        assert!(asked > 200);
        assert!(most - least <= MAX_JITTER_CYCLES, "{least} to {most} cycles");
        powered.run_for(0.02);
        powered.received.clear();
        let reason = client.reason(&mut powered);
        assert!(gap_s <= 0.0 || powered.is_on(), "{reason:?}");
    }
    assert_eq!(powered.bench.violations(), [] as [&str; 0]);
}
