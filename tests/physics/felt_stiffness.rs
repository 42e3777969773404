//! What the hand feels of a wall, through line and controllers.

use dimsart_core::types;
use hil_sim::plant::{WallParameters, WallSide};

use crate::loops::{MASTER, SLAVE, axis, delays, push, rig, signal};

/// Felt stiffness by round trip and wall, `N/m`: springs in series (Niemeyer and Slotine),
///
/// `1/K = 1/K_m + n h/(2 b) + 1/K_s + 1/K_e`, `K_m = 3000`, `K_s = 5000`, `b = 10`, `h = 1 ms`.
///
/// | Round trip, ticks | rigid wall | 10 kN/m | 1 kN/m |
const GOLDEN: [(u32, [f64; 3]); 7] = [
    (2, [1578.94737, 1363.63636, 612.244898]),
    (11, [923.076923, 845.070423, 480.0]),
    (20, [652.173913, 612.244898, 394.736842]),
    (22, [612.244898, 576.923077, 379.746835]),
    (100, [180.722892, 177.514793, 153.061224]),
    (200, [94.9367089, 94.0438871, 86.7052023]),
    (1000, [19.7889182, 19.7498354, 19.4049159]),
];
const WALLS_N_PER_M: [f64; 3] = [f64::INFINITY, 1e4, 1e3];

/// Surface of the wall, `m`: the contact is made from free space.
const SURFACE_M: f64 = 0.01;
const HAND_FORCE_N: f64 = 2.0;
/// Ticks over which the settled contact is averaged.
const WATCHED: u64 = 200;

/// Pushes the slave into the wall and gives force over depth at the master once all is settled, `N/m`.
///
/// A hand and a slave damped like the line swallow most of an echo; 24 round trips and 2 s leave less than 1e-6.
fn felt_n_per_m(form: &str, round_trip_ticks: u32, wall_n_per_m: f64) -> f64 {
    let backward_ticks = round_trip_ticks.div_ceil(2);
    let settings = format!("wave.form={form} {}", delays(round_trip_ticks - backward_ticks, backward_ticks));
    let wall = WallParameters {
        position_m: SURFACE_M,
        stiffness_n_per_m: wall_n_per_m,
        damping_ns_per_m: 10.0,
        solid: WallSide::Above,
    };
    let master = axis(0.1, 10.0, vec![push(|_| HAND_FORCE_N)]);
    let slave = axis(0.2, 10.0, vec![Box::new(wall.build().unwrap())]);
    let mut rig = rig(&settings, master, slave);
    let settled = 2000 + 24 * u64::from(round_trip_ticks);
    let (mut force_n, mut depth_m) = (0.0, 0.0);
    while rig.ticks() < settled + WATCHED {
        rig.tick();
        if rig.ticks() >= settled {
            let truth = |side: usize| rig.stations()[side].plant.truth(0).unwrap();
            assert!(truth(SLAVE).is_in_contact);
            force_n += signal(&rig, MASTER, types::LINE_FORCE);
            depth_m += truth(MASTER).position_m - SURFACE_M;
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
                let felt = felt_n_per_m(form, round_trip_ticks, wall_n_per_m);
                let error = felt / expected - 1.0;
                println!(
                    "{form:8} {round_trip_ticks:4} ticks, wall {wall_n_per_m:7} N/m: {felt:9.4} N/m, {error:+.1e}"
                );
                assert!(error.abs() < 1e-4, "{felt} N/m instead of {expected} N/m");
            }
        }
    }
}
