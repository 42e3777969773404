//! Perceived stiffness of a wall through line and controllers.
#![expect(clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

use std::sync::atomic::AtomicBool;

use dimsart_core::types;
use hil_sim::experiment::{Experiment, Run};

use crate::loops::{MASTER, Met, SLAVE, axis, bilateral, delays, push, rig, signal};

/// Perceived stiffness by round trip and wall, `N/m`: springs in series (Niemeyer and Slotine),
///
/// `1/K = 1/K_m + n h/(2 b) + 1/K_s + 1/K_e`, `K_m = 3000`, `K_s = 5000`, `b = 10`, `h = 1 ms`.
///
/// | Round trip, ticks | rigid wall | 10 kN/m | 1 kN/m |
const GOLDEN: [(u32, [f64; 3]); 7] = [
    (2, [1578.9474, 1363.6364, 612.2449]),
    (11, [923.0769, 845.0704, 480.0000]),
    (20, [652.1739, 612.2449, 394.7368]),
    (22, [612.2449, 576.9231, 379.7468]),
    (100, [180.7229, 177.5148, 153.0612]),
    (200, [94.9367, 94.0439, 86.7052]),
    (1000, [19.7889, 19.7498, 19.4049]),
];
const WALLS_N_PER_M: [f64; 3] = [f64::INFINITY, 1e4, 1e3];

/// Surface of the wall, `m`: contact starts from free space.
const SURFACE_M: f64 = 0.01;
const HAND_FORCE_N: f64 = 2.0;
/// Ticks over which the settled contact is averaged.
const WATCHED: u64 = 200;

/// Pushes the slave into the wall and returns force over depth at the master after settling, `N/m`.
///
/// A hand and a slave with the line's damping absorb most of an echo; 24 round trips and 2 s leave less than
/// 1e-6.
fn perceived_n_per_m(form: &str, round_trip_ticks: u32, wall_n_per_m: f64) -> f64 {
    let backward_ticks = round_trip_ticks.div_ceil(2);
    let settings = format!("wave.form={form} {}", delays(round_trip_ticks - backward_ticks, backward_ticks));
    let master = axis(0.1, 10.0, Met::Nothing, push(|_| HAND_FORCE_N));
    let slave = axis(0.2, 10.0, Met::Wall(SURFACE_M, wall_n_per_m, 10.0), None);
    let mut rig = rig(&settings, master, slave);
    let settled = 2000 + 24 * u64::from(round_trip_ticks);
    let (mut force_n, mut depth_m) = (0.0, 0.0);
    while rig.ticks() < settled + WATCHED {
        rig.tick();
        if rig.ticks() >= settled {
            let plant = |side: usize| &rig.stations()[side].plant;
            assert!(plant(SLAVE).is_touching(0));
            force_n += signal(&rig, MASTER, types::LINE_FORCE);
            depth_m += plant(MASTER).position(0) - SURFACE_M;
        }
        rig.advance();
    }
    force_n / depth_m
}

#[test]
fn the_hand_feels_both_controllers_the_line_and_the_wall_in_series() {
    for form in ["split", "implicit"] {
        for (round_trip_ticks, expected) in GOLDEN {
            for (wall_n_per_m, expected) in WALLS_N_PER_M.into_iter().zip(expected) {
                let perceived = perceived_n_per_m(form, round_trip_ticks, wall_n_per_m);
                let error = perceived / expected - 1.0;
                println!(
                    "{form:8} {round_trip_ticks:4} ticks, wall {wall_n_per_m:7} N/m: {perceived:9.4} N/m, {error:+.1e}"
                );
                assert!(error.abs() < 1e-4, "{perceived} N/m instead of {expected} N/m");
            }
        }
    }
}

/// A soft wall settles slowly: only its stiffness stops the damped motion.
#[test]
fn a_run_waits_until_a_soft_wall_has_settled() {
    for wall_n_per_m in [10, 100] {
        let settings = format!("dof=1 wall.stiffness_n_per_m={wall_n_per_m} {}", delays(1, 1));
        let experiment = Experiment::new(&bilateral(&settings)).unwrap();
        let outcome = experiment.run(&AtomicBool::new(false), |_| ()).outcome;
        let [perceived, predicted] = [
            outcome.axes[0].contact.unwrap().k_perceived_n_per_m,
            outcome.axes[0].contact.unwrap().k_predicted_n_per_m,
        ];
        let error = perceived.unwrap() / predicted.unwrap() - 1.0;
        assert!(error.abs() < 1e-4, "wall of {wall_n_per_m} N/m: {perceived:?} instead of {predicted:?} N/m");
    }
}

/// A whole run as in `dimsart run`: the report contains the measured round trip, and the golden value next to
/// its own prediction, for both axes in contact.
#[test]
fn a_run_reports_round_trip_and_perceived_stiffness() {
    for (form, delays, round_trip_ticks, expected) in [
        ("split", String::new(), 22, GOLDEN[3].1[1]),
        ("implicit", String::new(), 22, GOLDEN[3].1[1]),
        ("split", delays(10, 1), 11, GOLDEN[1].1[1]),
    ] {
        let file = bilateral(&format!("dof=3 wave.form={form} {delays}"));
        let Run { outcome, .. } = Experiment::new(&file).unwrap().run(&AtomicBool::new(false), |_| ());
        assert!(outcome.stable, "{:?}", outcome.faults);
        assert_eq!(outcome.round_trip_ticks, Some(round_trip_ticks));
        assert!(outcome.energy_min_j.is_some_and(|energy_j| energy_j >= 0.0), "{:?} J", outcome.energy_min_j);
        for axis in outcome.axes.get(..2).unwrap() {
            for found in
                [axis.contact.unwrap().k_perceived_n_per_m, axis.contact.unwrap().k_predicted_n_per_m]
            {
                let found = found.unwrap();
                assert!((found / expected - 1.0).abs() < 1e-4, "{found} N/m instead of {expected} N/m");
            }
        }
        assert_eq!(
            outcome.axes[2].contact.unwrap().k_perceived_n_per_m,
            None,
            "the third axis stays away from the wall"
        );
    }
}
