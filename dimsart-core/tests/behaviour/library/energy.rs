//! Modules that watch energy: what counts that wrap, restart or stay away do, and what begins without a jump.

use crate::common::Bench;
use dimsart_core::{Tick, Word, types};

/// Counts of a joule.
const COUNTS_PER_J: u32 = 1 << 24;

/// A bench of one axis that measures position and force or position of the other side, and its count.
fn bench(far: crate::common::Types, rows: &str) -> Bench {
    let mut bench: Bench = Bench::of(1, far, &[]);
    bench.run(rows);
    bench
}

fn tick(bench: &mut Bench, reals: [f32; 2], count: u32) {
    let words = [Word::from(reals[0]), Word::from(reals[1]), Word::from(count)];
    assert_eq!(bench.try_tick(&words).0, Tick::Ran);
}

fn tank() -> Bench {
    bench(
        &[types::POSITION, types::FAR_FORCE, types::FAR_ENERGY],
        "TANK_MOD PORT_FORCE_IN FAR_FORCE\nTANK_MOD SHARE 0\nMOD_ENG MOD_ON TANK_MOD",
    )
}

#[test]
fn a_count_that_wraps_goes_on_and_one_that_begins_anew_brings_nothing() {
    let mut bench = tank();
    let start = u32::MAX - COUNTS_PER_J / 4;
    tick(&mut bench, [0.0, 0.0], start);
    assert_eq!(bench.signal("PORT_ENERGY"), [0.0], "what was counted before belongs to others");
    tick(&mut bench, [0.0, 0.0], start.wrapping_add(COUNTS_PER_J / 2));
    assert_eq!(bench.signal("PORT_ENERGY"), [0.5]);
    tick(&mut bench, [0.0, 0.0], 0);
    assert_eq!(bench.signal("PORT_ENERGY"), [0.5]);
    tick(&mut bench, [0.0, 0.0], COUNTS_PER_J / 4);
    assert_eq!(bench.signal("PORT_ENERGY"), [0.75]);
}

#[test]
fn a_tank_commands_what_it_can_pay_for_and_nothing_once_it_is_empty() {
    let mut bench = tank();
    let mut position = 0.0_f32;
    tick(&mut bench, [position, 5.0], 0);
    tick(&mut bench, [position, 5.0], COUNTS_PER_J / 100);
    assert_eq!(bench.signal("DES_FORCE"), [5.0], "10 mJ, and nothing moves");
    let mut given_j = 0.0;
    for _ in 0..100 {
        given_j += f64::from(bench.signal("DES_FORCE")[0]) * 1e-3;
        position += 1e-3;
        tick(&mut bench, [position, 5.0], COUNTS_PER_J / 100);
    }
    assert_eq!(bench.signal("DES_FORCE"), [0.0]);
    assert!((given_j - 0.01).abs() < 1e-6, "{given_j} J of 10 mJ");
}

#[test]
fn a_reference_waits_for_energy_and_then_goes_to_where_the_master_is() {
    let mut bench = bench(
        &[types::POSITION, types::FAR_POSITION, types::FAR_ENERGY],
        "TDPA_MOD CAUSALITY ADMITTANCE\nMOD_ENG MOD_ON TDPA_MOD\nPCTRL_MOD K_PARAM 1000\nMOD_ENG MOD_ON PCTRL_MOD",
    );
    tick(&mut bench, [0.0, 0.0], 0);
    // The device is held, so that every millimetre of the reference costs: 0.5 K x² in all.
    for step in 1_u8..=20 {
        tick(&mut bench, [0.0, 1e-3 * f32::from(step)], 0);
    }
    for _ in 0..500 {
        tick(&mut bench, [0.0, 0.02], 0);
    }
    let waiting = bench.signal("DES_POSITION")[0];
    assert!(waiting.abs() < 2e-3, "nobody has paid for {waiting} m");
    for _ in 0..1000 {
        tick(&mut bench, [0.0, 0.02], COUNTS_PER_J);
    }
    let arrived = bench.signal("DES_POSITION")[0];
    assert!((arrived - 0.02).abs() < 1e-5, "{arrived} m");
}

#[test]
fn a_clutch_that_takes_over_goes_on_from_what_was_commanded() {
    let mut bench: Bench = Bench::of(1, &[types::POSITION, types::FAR_POSITION, types::CONDITION], &[]);
    bench.run("NORMALIZER_MOD PORT_SIGNAL_IN FAR_POSITION\nNORMALIZER_MOD PORT_SIGNAL_OUT DES_POSITION\nMOD_ENG MOD_ON NORMALIZER_MOD");
    bench.tick(&[0.1, 0.7, 1.0]);
    assert_eq!(bench.signal("DES_POSITION"), [0.7]);
    bench.rows("MOD_ENG BEGIN\nMOD_ENG MOD_OFF NORMALIZER_MOD\nMOD_ENG MOD_ON CLUTCH_MOD\nMOD_ENG COMMIT");
    bench.tick(&[0.1, 0.9, 1.0]);
    assert_eq!(bench.signal("DES_POSITION"), [0.7]);
    bench.tick(&[0.1, 1.0, 1.0]);
    assert!((bench.signal("DES_POSITION")[0] - 0.8).abs() < 1e-6);
}

#[test]
fn a_share_that_changes_hands_slews_and_does_not_jump() {
    let mut bench: Bench = Bench::of(1, &[types::DES_POSITION, types::FAR_POSITION], &[]);
    bench.run(
        "SHARED_MOD RATE 10\nSHARED_MOD PORT_OPERATOR DES_POSITION\nSHARED_MOD PORT_PROGRAM FAR_POSITION\nMOD_ENG MOD_ON SHARED_MOD",
    );
    bench.tick(&[0.0, 1.0]);
    bench.rows("SHARED_MOD SHARE 1");
    let mut last = 0.0;
    for _ in 0..200 {
        bench.tick(&[0.0, 1.0]);
        let share = bench.signal("SIGNAL_OUT")[0];
        assert!(share - last < 0.010_01, "{share} after {last}");
        last = share;
    }
    assert!((last - 1.0).abs() < 1e-5);
}
