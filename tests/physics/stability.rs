//! Stability of loops as a function of the delay.
//!
//! Master 0.1 kg, slave 0.5 kg, 8 `N s/m` each, `K = 3000` and `5000 N/m`, `b = 10 N s/m`, controllers
//! without damping; in contact, the slave is on a spring of 10 kN/m.

use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

use dimsart_core::types;
use hil_sim::experiment::{Experiment, Run};
use hil_sim::plant::ExternalForce;
use hil_sim::rig::Rig;

use crate::loops::{MASTER, Met, TICK_S, axis, bilateral, delays, push, rig, signal};

/// The loop of this file, with the slave `in_contact` or free, and a hand's force.
pub(crate) fn held(settings: &str, in_contact: bool, hand: Option<ExternalForce>) -> Rig {
    let met = if in_contact { Met::Spring(1e4) } else { Met::Nothing };
    rig(settings, axis(0.1, 8.0, Met::Nothing, hand), axis(0.5, 8.0, met, None))
}

/// Returns the maximum force command of the master's controller in the next `ticks`, `N`.
fn peak_n(rig: &mut Rig, ticks: u64) -> f64 {
    let mut peak_n = 0.0_f64;
    for _ in 0..ticks {
        rig.tick();
        peak_n = peak_n.max(signal(rig, MASTER, types::DES_FORCE).abs());
        rig.advance();
    }
    peak_n
}

/// A small force that changes sign in every tick and grows by `growth`, faded in and out over `ticks`: it
/// excites the loop at half the sample rate, where the printed order grows fastest.
fn shake(ticks: u64, growth: f64) -> Option<ExternalForce> {
    let length = ticks as f64;
    push(move |t| {
        let tick = (t / TICK_S).round();
        let fade = 0.5 - 0.5 * libm::cos(2.0 * PI * tick / length);
        if tick < length { 1e-27 * fade * libm::pow(growth, tick) * libm::cos(PI * tick) } else { 0.0 }
    })
}

/// The paper's listing computes the controller before the wave transformer. Each port then amplifies
/// reflections at half the sample rate by `(2 + k)/(2 - k)` with `k = h K/b`; a round trip multiplies both:
/// 2.255.
///
/// Growth per tick equals the spectral radius to 5 decimals. Other modes grow almost as fast, so it is
/// measured over 80 round trips: the loop is linear, and `f32` keeps its relative precision from 1e-32 to
/// 1e8.
#[test]
fn the_printed_order_grows_as_its_spectral_radius_says() {
    for (ticks, expected) in
        [(1, 1.40097), (2, 1.20220), (5, 1.08118), (10, 1.04063), (20, 1.02032), (50, 1.00813)]
    {
        for in_contact in [false, true] {
            let settings = format!("wave.form=printed {}", delays(ticks, ticks));
            let round_trip = 2 * u64::from(ticks);
            let mut rig = held(&settings, in_contact, shake(20 * round_trip, expected));
            peak_n(&mut rig, 30 * round_trip);
            let early_n = peak_n(&mut rig, 1);
            let grown = 80 * round_trip;
            peak_n(&mut rig, grown - 1);
            let late_n = peak_n(&mut rig, 1);
            let growth = libm::pow(late_n / early_n, 1.0 / grown as f64);
            println!(
                "{ticks:2} ticks each way, contact {in_contact}: {growth:.6} per tick, {early_n:.0e} to {late_n:.0e} N"
            );
            assert!((growth - expected).abs() < 1e-5, "{growth} instead of {expected} per tick");
        }
    }
}

/// A force for 0.1 s, `N`.
pub(crate) fn nudge() -> Option<ExternalForce> {
    push(|t| if t < 0.1 { 2.0 } else { 0.0 })
}

/// Both corrections of the printed order are stable for any delay: hand and slave absorb the energy of a
/// push, up to a round trip of a second. Only rounding remains: `K` times the resolution of an `f32`
/// position.
#[test]
fn split_and_implicit_come_to_rest_at_any_delay() {
    const ROUNDING_N: f64 = 2e-5;
    for form in ["split", "implicit"] {
        for ticks in [1, 2, 5, 10, 20, 50, 100, 200, 500] {
            for in_contact in [false, true] {
                let settings = format!("wave.form={form} {}", delays(ticks, ticks));
                let mut rig = held(&settings, in_contact, nudge());
                let peaks_n = [(); 6].map(|()| peak_n(&mut rig, 500 + 8 * u64::from(ticks)));
                let place = format!("{form}, {ticks} ticks each way, contact {in_contact}: {peaks_n:.7?} N");
                assert!(peaks_n.is_sorted_by(|early, late| late < early || *late < ROUNDING_N), "{place}");
                assert!(peaks_n[5] < 1e-3 * peaks_n[0], "{place}");
            }
        }
    }
}

/// The same controllers and devices without waves: each follows the other's delayed position and becomes
/// unstable after a few ticks of delay.
///
/// Growth per tick equals the spectral radius of that loop with exactly discretised devices, on both sides of
/// the limit.
#[test]
fn without_waves_the_same_gains_fly_apart_after_a_few_ticks() {
    let scheme = "master.scheme=builtin:position_position slave.scheme=builtin:position_position";
    for (in_contact, ticks, expected) in
        [(false, 3, 0.999161), (false, 4, 1.004032), (true, 1, 0.994779), (true, 2, 1.002652)]
    {
        let link = format!("link.forward_delay_ticks={ticks} link.backward_delay_ticks={ticks}");
        // Small enough to stay below the maximum force while growing.
        let feeble = push(|t| if t < 0.1 { 2e-9 } else { 0.0 });
        let mut rig = held(&format!("{scheme} {link}"), in_contact, feeble);
        peak_n(&mut rig, 500);
        let early_n = peak_n(&mut rig, 200);
        peak_n(&mut rig, 7800);
        let late_n = peak_n(&mut rig, 200);
        let growth = libm::pow(late_n / early_n, 1.0 / 8000.0);
        println!("{ticks} ticks each way, contact {in_contact}: {growth:.6} per tick");
        assert!((growth - expected).abs() < 1e-5, "{growth} instead of {expected} per tick");
    }
}

/// The whole experiment, including hand and wall, without waves.
#[test]
fn an_experiment_that_waves_carry_leaves_its_range_without_them() {
    let link = "link.forward_delay_ticks=11 link.backward_delay_ticks=11";
    let no_modules = "master.time_delay_ticks=0 slave.time_delay_ticks=0";
    for (scheme, delays, is_stable) in [("bilateral", no_modules, true), ("position_position", "", false)] {
        let scheme = format!("master.scheme=builtin:{scheme} slave.scheme=builtin:{scheme}");
        let experiment = Experiment::new(&bilateral(&format!("{scheme} {link} {delays}"))).unwrap();
        let Run { outcome, .. } = experiment.run(&AtomicBool::new(false), |_| ());
        assert_eq!(outcome.stable, is_stable, "{scheme}: {:?}", outcome.faults);
    }
}
