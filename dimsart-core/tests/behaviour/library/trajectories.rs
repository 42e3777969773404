//! Trajectories: within their limits, to the end, even if the target changes.
#![expect(clippy::indexing_slicing, reason = "in helpers of tests as in tests")]
#![expect(clippy::cast_precision_loss, clippy::float_cmp, reason = "numbers of a test; arrival is exact")]

use dimsart_core::types;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

use crate::common::{Alone, H};

const MOVES: [&str; 3] = ["TRAPEZOID_MOD", "SCURVE_MOD", "MINJERK_MOD"];

fn alone(dof: usize, rows: &str) -> Alone {
    Alone::new(dof, &[types::POSITION], "DES_POSITION", rows)
}

fn between(random: &mut Pcg32, most: f32) -> f32 {
    ((random.next_u32() >> 8) as f32 / 8_388_608.0 - 1.0) * most
}

/// Position, velocity and acceleration of the first axis after a tick.
fn tick(module: &mut Alone) -> [f32; 3] {
    let dof = module.bench.dimsart.engine().device().dof();
    module.axes(&vec![0.25; dof]);
    ["DES_POSITION", "DES_VELOCITY", "DES_ACCELERATION"].map(|name| module.bench.signal(name)[0])
}

#[test]
fn a_trapezoid_holds_its_limits_and_arrives_wherever_the_target_goes_on_the_way() {
    let (velocity, acceleration) = (0.8, 5.0);
    let rows =
        "TRAPEZOID_MOD VELOCITY_LIMIT 0.8\nTRAPEZOID_MOD ACCELERATION_LIMIT 5\nMOD_ENG MOD_ON TRAPEZOID_MOD";
    for seed in 0..20 {
        let mut random = Pcg32::seed_from_u64(seed);
        let mut module = alone(1, rows);
        let (mut last, mut last_velocity) = (0.25_f32, 0.0_f32);
        let mut target = 0.0;
        for k in 0..4000 {
            if k < 1500 && random.next_u32() % 50 == 0 {
                target = between(&mut random, 1.0);
                module.bench.rows(&format!("TRAPEZOID_MOD TARGET {target}"));
            }
            let [x, v, a] = tick(&mut module);
            assert!(
                v.abs() <= velocity * 1.000_01 && a.abs() <= acceleration * 1.001,
                "{seed}, {k}: {v}, {a}"
            );
            // Mean of the velocities at both ends of the tick, if the acceleration is constant.
            assert!((x - last - 0.5 * H * (v + last_velocity)).abs() < acceleration * H * H, "{seed}, {k}");
            (last, last_velocity) = (x, v);
        }
        assert_eq!((last, last_velocity), (target, 0.0), "{seed}");
    }
}

#[test]
fn from_rest_no_move_overshoots_and_each_one_ends_exactly_at_its_target() {
    for name in MOVES {
        let mut random = Pcg32::seed_from_u64(7);
        let mut module = alone(1, &format!("MOD_ENG MOD_ON {name}\n{name} TARGET 0.25"));
        for _ in 0..20 {
            let from = tick(&mut module)[0];
            let size = [1e-5, 1e-2, 1.0][(random.next_u32() % 3) as usize];
            let target = from + between(&mut random, size);
            module.bench.rows(&format!("{name} TARGET {target}"));
            let mut last = from;
            for _ in 0..4000 {
                let x = tick(&mut module)[0];
                let ahead = (target - from).signum();
                // Rounding of a polynomial, and of a position of some metres.
                assert!(
                    ahead * (x - last) >= -3e-6 && ahead * (x - target) <= 3e-6,
                    "{name}: {last}, {x}, {target}"
                );
                last = x;
            }
            assert_eq!(last, target, "{name} from {from}");
        }
    }
}

#[test]
fn an_s_curve_that_gets_a_new_target_on_the_way_brakes_within_its_limits_and_goes_there() {
    let rows = "SCURVE_MOD VELOCITY_LIMIT 1\nSCURVE_MOD ACCELERATION_LIMIT 5\nSCURVE_MOD JERK_LIMIT 50
        MOD_ENG MOD_ON SCURVE_MOD";
    for change in (20..1500).step_by(70) {
        let mut module = alone(1, rows);
        module.bench.rows("SCURVE_MOD TARGET 1.5");
        let [_, _, mut last] = tick(&mut module);
        for k in 1..5000 {
            if k == change {
                module.bench.rows("SCURVE_MOD TARGET -0.5");
            }
            let [_, v, a] = tick(&mut module);
            assert!(v.abs() < 1.000_01 && a.abs() < 5.0005, "{change}, {k}: {v}, {a}");
            assert!((a - last).abs() < 50.0 * H * 1.01, "{change}, {k}: jerk {}", (a - last) / H);
            last = a;
        }
        assert_eq!(tick(&mut module), [-0.5, 0.0, 0.0], "{change}");
    }
}

#[test]
fn synchronised_axes_arrive_in_the_same_tick() {
    for name in ["TRAPEZOID_MOD", "SCURVE_MOD"] {
        let rows = format!(
            "{name} SYNCHRONISED ON\n{name} TARGET[0] 1.25\n{name} TARGET[1] 0.3\n{name} TARGET[2] -0.1"
        );
        let mut module = alone(3, &format!("{rows}\nMOD_ENG MOD_ON {name}"));
        let arrived = |module: &Alone| -> Vec<bool> {
            let x = module.bench.signal("DES_POSITION");
            x.iter()
                .zip([1.25, 0.3, -0.1])
                .map(|(x, target): (&f32, f32)| (x - target).abs() < 1e-6)
                .collect()
        };
        let mut ticks = [0_u32; 3];
        for k in 0..5000 {
            tick(&mut module);
            let there = arrived(&module);
            ticks.iter_mut().zip(there).filter(|(_, there)| !there).for_each(|(tick, _)| *tick = k);
        }
        assert!(ticks[0] > 900 && ticks[0] < 4000, "{name}: {ticks:?}");
        // Within 1e-6 at the end of a parabola, some ticks earlier.
        assert!(ticks.iter().all(|tick| ticks[0].abs_diff(*tick) < 60), "{name}: {ticks:?}");
    }
}

#[test]
fn a_signal_can_say_where_to_go() {
    for name in MOVES {
        let rows =
            format!("{name} TARGET_FROM SIGNAL\n{name} PORT_TARGET DES_POSITION.3\nMOD_ENG MOD_ON {name}");
        let rows = format!(
            "SIGGEN_MOD PORT_SIGNAL_OUT DES_POSITION.3\nSIGGEN_MOD AMPLITUDE 0.5\nMOD_ENG MOD_ON SIGGEN_MOD\n{rows}"
        );
        let mut module = alone(1, &rows);
        assert!((tick(&mut module)[0] - 0.25).abs() < 1e-6, "{name} starts at the joint's position");
        let last = (0..3000).map(|_| tick(&mut module)).last().unwrap();
        assert_eq!(last, [0.5, 0.0, 0.0], "{name}");
    }
}

#[test]
fn via_points_begin_where_the_joint_stands_and_stay_at_the_last_one() {
    let rows = "VIA_MOD COUNT 3\nVIA_MOD TIMES 0.2\nVIA_MOD POINTS[0][0] 1\nVIA_MOD POINTS[0][1] -1\nVIA_MOD POINTS[0][2] 0.5
        MOD_ENG MOD_ON VIA_MOD";
    let mut module = alone(1, rows);
    assert_eq!(tick(&mut module)[..2], [0.25, 0.0]);
    let path: Vec<f32> = (1..2000).map(|_| tick(&mut module)[0]).collect();
    assert!((path[199] - 1.0).abs() < 1e-3 && (path[399] + 1.0).abs() < 1e-3);
    assert!(path.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 0.03));
    assert_eq!(path.last(), Some(&0.5));
}

#[test]
fn a_chirp_stays_where_it_ends() {
    let rows = "CHIRP_MOD AMPLITUDE 1\nCHIRP_MOD DURATION 0.5\nCHIRP_MOD TO 3\nMOD_ENG MOD_ON CHIRP_MOD";
    let mut module = Alone::new(1, &[types::POSITION], "SIGNAL_OUT", rows);
    let outputs: Vec<f32> = (0..1000).map(|_| module.step(&[0.0])).collect();
    assert!(outputs[..400].windows(2).any(|pair| pair[0] != pair[1]));
    assert!(outputs[501..].windows(2).all(|pair| pair[0] == pair[1]));
}

#[test]
fn what_takes_over_on_the_way_goes_on_from_the_last_desired_position() {
    for (name, keeps_velocity) in [("TRAPEZOID_MOD", true), ("SCURVE_MOD", false), ("VIA_MOD", false)] {
        let mut module = alone(1, "MINJERK_MOD TARGET 1.25\nMOD_ENG MOD_ON MINJERK_MOD");
        let [last, velocity, _] = (0..400).map(|_| tick(&mut module)).last().unwrap();
        assert!(velocity > 1.0, "{velocity}");
        module.bench.rows(&format!(
            "MOD_ENG BEGIN\nMOD_ENG MOD_OFF MINJERK_MOD\nMOD_ENG MOD_ON {name}\nMOD_ENG COMMIT"
        ));
        let [x, v, _] = tick(&mut module);
        assert!((x - last).abs() < 1e-6, "{name}: {last}, {x}");
        assert!((v - if keeps_velocity { velocity } else { 0.0 }).abs() < 1e-6, "{name}: {v}");
    }
}

#[test]
fn minimum_jerk_that_takes_over_keeps_position_and_velocity() {
    let mut module =
        alone(1, "TRAPEZOID_MOD TARGET 3\nTRAPEZOID_MOD ACCELERATION_LIMIT 5\nMOD_ENG MOD_ON TRAPEZOID_MOD");
    let [last, velocity, _] = (0..400).map(|_| tick(&mut module)).last().unwrap();
    module
        .bench
        .rows("MOD_ENG BEGIN\nMOD_ENG MOD_OFF TRAPEZOID_MOD\nMOD_ENG MOD_ON MINJERK_MOD\nMOD_ENG COMMIT");
    let [x, v, _] = tick(&mut module);
    assert!((x - last).abs() < 4e-6 && (v - velocity).abs() < 1e-5, "{last}, {x}, {velocity}, {v}");
}
