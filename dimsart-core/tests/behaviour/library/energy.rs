//! Modules that monitor energy: counters that wrap, restart or are missing, and initialisation without a
//! jump.

#![expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "converted measurements")]

use dimsart_core::{TickResult, Word, types};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

use crate::common::{Bench, H};

/// Counts per joule.
const COUNTS_PER_J: u32 = 1 << 24;

/// A bench of one axis that measures position and force or the peer's position, and its count.
fn bench(far: crate::common::Types, rows: &str) -> Bench {
    let mut bench = Bench::of(1, far, &[]);
    bench.run(rows);
    bench
}

fn tick(bench: &mut Bench, reals: [f32; 2], count: u32) {
    let words = [Word::from(reals[0]), Word::from(reals[1]), Word::from(count)];
    assert_eq!(bench.try_tick(&words).0, TickResult::Ran);
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
    assert_eq!(bench.signal("PORT_ENERGY"), [0.0], "earlier counts are ignored");
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
    assert_eq!(bench.signal("DES_FORCE"), [5.0], "10 mJ, no motion");
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
    // The device is held, so that every millimetre of the reference needs energy: 0.5 K x² in total.
    for step in 1_u8..=20 {
        tick(&mut bench, [0.0, 1e-3 * f32::from(step)], 0);
    }
    for _ in 0..500 {
        tick(&mut bench, [0.0, 0.02], 0);
    }
    let waiting = bench.signal("DES_POSITION")[0];
    assert!(waiting.abs() < 2e-3, "no energy for {waiting} m");
    for _ in 0..1000 {
        tick(&mut bench, [0.0, 0.02], COUNTS_PER_J);
    }
    let arrived = bench.signal("DES_POSITION")[0];
    assert!((arrived - 0.02).abs() < 1e-5, "{arrived} m");
}

/// A reference with 1000 N/m and 5 N s/m moves 0.5 kg, sometimes against a wall, by a peer position that is
/// missing for up to a second and then jumps. The energy output, computed from forces and steps, never
/// exceeds the energy reported by the peer plus the credit.
#[test]
fn a_reference_gives_out_no_more_than_was_reported_and_its_credit_whatever_is_lost() {
    let (h, mass, credit_j) = (f64::from(H), 0.5, 0.1);
    for seed in 0..60 {
        let mut random = Pcg32::seed_from_u64(seed);
        let mut share = move || f64::from(random.next_u32()) / f64::from(u32::MAX);
        let mut bench = bench(
            &[types::POSITION, types::FAR_POSITION, types::FAR_ENERGY],
            "TDPA_MOD CAUSALITY ADMITTANCE\nTDPA_MOD DRIFT_RATE 5\nMOD_ENG MOD_ON TDPA_MOD\nPDCTRL_MOD K_PARAM 1000\n\
             PDCTRL_MOD D_PARAM 5\nMOD_ENG MOD_ON PDCTRL_MOD",
        );
        let (size, rate) = (0.02 + 0.3 * share(), 0.2 + 2.0 * share());
        let paid_w = if seed % 3 == 0 { 0.0 } else { 20.0 * share() };
        let (mut x, mut v, mut far, mut reported_j) = (0.0, 0.0, 0.0, 0.0);
        let (mut outage_ticks, mut desired, mut out_j, mut min_j) = (0.0, 0.0, 0.0, 0.0_f64);
        for tick in 0..6000 {
            if outage_ticks > 0.0 {
                outage_ticks -= 1.0;
            } else {
                far = size * (core::f64::consts::TAU * rate * h * f64::from(tick)).sin();
                reported_j = f64::from(tick) * h * paid_w;
                outage_ticks = if share() < 0.004 { 1000.0 * share() } else { 0.0 };
            }
            let counts = (reported_j * f64::from(COUNTS_PER_J)) as u64 as u32;
            self::tick(&mut bench, [x as f32, far as f32], counts);
            let force = f64::from(bench.signal("DES_FORCE")[0]);
            let now = f64::from(bench.signal("DES_POSITION")[0]);
            out_j += force * (now - desired);
            desired = now;
            min_j = min_j.min(reported_j - out_j);
            let wall = if x > 0.1 { -5000.0 * (x - 0.1) } else { 0.0 };
            v += h * (force - 3.0 * v + wall) / mass;
            x += h * v;
        }
        assert!(min_j > -credit_j - 1e-4, "{seed}: {min_j} J");
        assert!(min_j < -0.01 || paid_w > 0.0, "{seed}: it uses its credit: {min_j}");
    }
}

/// The same for a force: a hand moves 0.5 kg while the peer's force is missing and jumps.
#[test]
fn a_force_gives_out_no_more_than_was_reported_and_its_credit_whatever_is_lost() {
    let (h, mass) = (f64::from(H), 0.5);
    for seed in 0..60 {
        let mut random = Pcg32::seed_from_u64(seed);
        let mut share = move || f64::from(random.next_u32()) / f64::from(u32::MAX);
        let mut bench = bench(
            &[types::POSITION, types::FAR_FORCE, types::FAR_ENERGY],
            "TDPA_MOD PORT_FORCE_IN FAR_FORCE\nTDPA_MOD DAMPER 60\nMOD_ENG MOD_ON TDPA_MOD",
        );
        let (rate, paid_w) = (0.2 + 2.0 * share(), if seed % 3 == 0 { 0.0 } else { 5.0 * share() });
        let (mut x, mut v, mut far, mut reported_j) = (0.0_f64, 0.0_f64, 0.0, 0.0);
        let (mut outage_ticks, mut out_j, mut min_j) = (0.0, 0.0, 0.0_f64);
        let (mut last_x, mut force) = (0.0, 0.0);
        for tick in 0..6000 {
            if outage_ticks > 0.0 {
                outage_ticks -= 1.0;
            } else {
                far = 30.0 * (core::f64::consts::TAU * rate * h * f64::from(tick)).sin();
                reported_j = f64::from(tick) * h * paid_w;
                outage_ticks = if share() < 0.004 { 1000.0 * share() } else { 0.0 };
            }
            let counts = (reported_j * f64::from(COUNTS_PER_J)) as u64 as u32;
            let measured = x as f32;
            out_j += force * f64::from(measured - last_x);
            last_x = measured;
            self::tick(&mut bench, [measured, far as f32], counts);
            force = f64::from(bench.signal("DES_FORCE")[0]);
            min_j = min_j.min(reported_j - out_j);
            v += h * (force - 5.0 * v - 100.0 * x) / mass;
            x += h * v;
        }
        // Plus the effect of one tick of 30 N on 0.5 kg, which is known afterwards.
        assert!(min_j > -0.1 - 30.0 * 30.0 * h * h / mass, "{seed}: {min_j} J");
    }
}

#[test]
fn a_clutch_that_takes_over_goes_on_from_what_was_commanded() {
    let mut bench = Bench::of(1, &[types::POSITION, types::FAR_POSITION, types::CONDITION], &[]);
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
    let mut bench = Bench::of(1, &[types::DES_POSITION, types::FAR_POSITION], &[]);
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
