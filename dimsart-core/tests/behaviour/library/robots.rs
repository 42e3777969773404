//! Arms: Cartesian and joint coordinates, published data of the PHANToM, collisions, unreachable positions.
#![expect(clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

use crate::common::{Alone, Bench, Types, assert_close};
use dimsart_core::{AxisKind, Unit, UnitRelation, types};

/// Returns the findings of a scheme on a device of three axes.
fn findings(rows: &str) -> Vec<String> {
    let mut bench = Bench::of(3, &[types::POSITION, types::DES_POSITION], &[]);
    bench.rows(rows);
    bench.findings()
}

const TIP: &str = "PHANTOM_TIP_MOD FORCE OFF\nMOD_ENG MOD_ON PHANTOM_TIP_MOD\n";

#[test]
fn a_law_takes_coordinates_of_joints_or_cartesian_ones_and_never_both() {
    let law = |position, desired, force| {
        let ports = [("POSITION", position), ("DES_POSITION", desired), ("DES_FORCE", force)];
        let bound = ports.map(|(port, signal)| format!("PDCTRL_MOD PORT_{port} {signal}\n")).concat();
        findings(&format!("{TIP}{bound}MOD_ENG MOD_ON PDCTRL_MOD"))
    };
    assert_eq!(law("POSITION", "DES_POSITION", "DES_FORCE"), [""; 0]);
    assert_eq!(law("TIP_POSITION", "TIP_POSITION", "DES_TIP_FORCE"), [""; 0]);
    assert_eq!(
        law("TIP_POSITION", "TIP_POSITION", "DES_FORCE"),
        [
            "port DES_FORCE of PDCTRL_MOD is bound to DES_FORCE, which is in joint coordinates, but other ports of the \
          module are Cartesian: bind the port to a compatible signal (PORT_DES_FORCE command); \
          `dimsart modules PDCTRL_MOD` shows the ports"
        ]
    );
    assert_eq!(
        law("POSITION", "TIP_POSITION", "DES_FORCE"),
        [
            "port DES_POSITION of PDCTRL_MOD is bound to TIP_POSITION, which is Cartesian, but other ports of the module \
          use joint coordinates: bind the port to a compatible signal (PORT_DES_POSITION command); \
          `dimsart modules PDCTRL_MOD` shows the ports"
        ]
    );
}

#[test]
fn a_wave_transformer_and_its_law_work_at_the_tip_with_every_coordinate_there() {
    let rows = format!(
        "{TIP}WTRANSF_MOD PORT_POSITION TIP_POSITION
         WTRANSF_MOD PORT_DES_POSITION DES_TIP_POSITION
         WTRANSF_MOD PORT_DES_FORCE DES_TIP_FORCE
         WTRANSF_MOD PORT_LINE_FORCE TIP_FORCE
         WTRANSF_MOD PORT_LINE_VELOCITY TIP_VELOCITY
         WTRANSF_MOD PORT_WAVES_IN CH1_WAVES
         WTRANSF_MOD PORT_WAVES_OUT CH2_WAVES
         MOD_ENG MOD_ON WTRANSF_MOD
         PDCTRL_MOD PORT_POSITION TIP_POSITION
         PDCTRL_MOD PORT_DES_POSITION DES_TIP_POSITION
         PDCTRL_MOD PORT_DES_FORCE DES_TIP_FORCE
         MOD_ENG MOD_ON PDCTRL_MOD"
    );
    let of_coordinates = |rows: &str| -> Vec<String> {
        findings(rows).into_iter().filter(|finding| finding.contains("of the module are")).collect()
    };
    assert_eq!(of_coordinates(&rows), [""; 0]);
    let mixed = of_coordinates(&rows.replace("PORT_LINE_FORCE TIP_FORCE", "PORT_LINE_FORCE LINE_FORCE"));
    assert!(
        mixed.len() == 1 && mixed[0].contains("is bound to LINE_FORCE, which is in joint coordinates"),
        "{mixed:?}"
    );
}

#[test]
fn what_is_of_the_tip_takes_nothing_of_joints_and_a_sum_of_both_is_refused() {
    let inverse = findings(
        "PHANTOM_INVERSE_MOD PORT_DES_TIP_POSITION POSITION\nPHANTOM_INVERSE_MOD PORT_DES_POSITION DES_POSITION.2\nMOD_ENG MOD_ON PHANTOM_INVERSE_MOD",
    );
    assert!(inverse.len() == 1 && inverse[0].contains("wrong unit"), "{inverse:?}");
    assert!(!UnitRelation::Same.accepts(Unit::Position, Unit::Metre));
    assert!(UnitRelation::Derivative.accepts(Unit::MetrePerSecond, Unit::Metre));
    for (unit, symbol) in [(Unit::Metre, "m"), (Unit::MetrePerSecond, "m/s"), (Unit::Newton, "N")] {
        assert_eq!(unit.symbol(AxisKind::Rotary), symbol);
    }
}

const MOTION: Types =
    &[types::POSITION, types::VELOCITY, types::DES_POSITION, types::DES_VELOCITY, types::DES_ACCELERATION];

/// Torques of a PHANToM at these positions, velocities and accelerations.
fn phantom_torques(
    law: &mut Alone,
    position: [f32; 3],
    velocity: [f32; 3],
    acceleration: [f32; 3],
) -> [f64; 3] {
    let measured = [position, velocity, position, velocity, acceleration].concat();
    let torques = law.axes(&measured);
    [0, 1, 2].map(|axis| f64::from(torques[axis]))
}

/// Its mass matrix, by columns.
fn phantom_mass(law: &mut Alone, position: [f32; 3]) -> [[f64; 3]; 3] {
    let weight = phantom_torques(law, position, [0.0; 3], [0.0; 3]);
    [0, 1, 2].map(|column| {
        let unit = [0, 1, 2].map(|axis| if axis == column { 1.0 } else { 0.0 });
        let torques = phantom_torques(law, position, [0.0; 3], unit);
        [0, 1, 2].map(|axis| torques[axis] - weight[axis])
    })
}

fn determinant(m: &[[f64; 3]; 3]) -> f64 {
    let minor = |one: usize, other: usize| m[1][one] * m[2][other] - m[1][other] * m[2][one];
    m[0][0] * minor(1, 2) - m[0][1] * minor(0, 2) + m[0][2] * minor(0, 1)
}

fn phantom_law() -> Alone {
    let rows = "PHANTOM_TORQUE_MOD BANDWIDTH 0\nMOD_ENG MOD_ON PHANTOM_TORQUE_MOD";
    Alone::new(3, MOTION, "DES_FORCE", rows)
}

#[test]
fn the_tip_of_a_phantom_is_as_heavy_as_published() {
    let mass = phantom_mass(&mut phantom_law(), [0.0; 3]);
    let mut tip = Alone::new(
        3,
        &[types::POSITION, types::DES_TIP_FORCE],
        "DES_FORCE",
        "MOD_ENG MOD_ON PHANTOM_TIP_MOD",
    );
    // 1 / (j M^-1 j) with the row j of the Jacobian, by Cramer's rule.
    for (direction, expected_kg) in [0.0322, 0.0773, 0.0525].into_iter().enumerate() {
        let mut measured = [0.0; 6];
        measured[3 + direction] = 1.0;
        let row: Vec<f64> = tip.axes(&measured).into_iter().map(f64::from).collect();
        let mobility: f64 = (0..3)
            .map(|axis| {
                let mut replaced = mass;
                replaced[axis] = [row[0], row[1], row[2]];
                row[axis] * determinant(&replaced) / determinant(&mass)
            })
            .sum();
        assert!(
            (1.0 / mobility - expected_kg).abs() < 0.5e-4,
            "direction {direction}: {} kg",
            1.0 / mobility
        );
    }
}

#[test]
fn the_mass_of_a_phantom_is_symmetric_and_positive_and_its_coriolis_forces_do_no_work() {
    let law = &mut phantom_law();
    for place in 0..40_u8 {
        let turn = f32::from(place);
        let position = [turn.sin(), (1.7 * turn).sin(), 2.0 * (2.3 * turn).cos()];
        let velocity = [3.0 * (0.7 * turn).cos(), 4.0 * (1.3 * turn).sin(), 5.0 * (1.9 * turn).cos()];
        let mass = phantom_mass(law, position);
        let largest = mass[0][0].max(mass[1][1]).max(mass[2][2]);
        for (row, column) in [(0, 1), (0, 2), (1, 2)] {
            assert!((mass[row][column] - mass[column][row]).abs() < 1e-5 * largest);
        }
        let minor = mass[1][1] * mass[2][2] - mass[1][2] * mass[2][1];
        assert!(mass[0][0] > 0.0 && mass[2][2] > 0.0 && minor > 0.0 && determinant(&mass) > 0.0);
        // v (dM/dt - 2 C) v = 0, with dM/dt by a difference along the motion.
        let step_s = 0.005;
        let beside = |sign: f32| [0, 1, 2].map(|axis| position[axis] + sign * step_s * velocity[axis]);
        let (after, before) = (phantom_mass(law, beside(1.0)), phantom_mass(law, beside(-1.0)));
        let moving = phantom_torques(law, position, velocity, [0.0; 3]);
        let weight = phantom_torques(law, position, [0.0; 3], [0.0; 3]);
        let v = velocity.map(f64::from);
        let (mut grown, mut worked, mut scale) = (0.0, 0.0, 0.0);
        for row in 0..3 {
            worked += v[row] * (moving[row] - weight[row]);
            for column in 0..3 {
                let slope = (after[row][column] - before[row][column]) / (2.0 * f64::from(step_s));
                grown += v[row] * slope * v[column];
                scale += (v[row] * slope * v[column]).abs();
            }
        }
        assert!((grown - 2.0 * worked).abs() < 5e-3 * scale.max(0.01), "{grown} W, {worked} W");
    }
}

#[test]
fn an_arm_that_is_held_against_its_weight_shows_no_collision_from_the_first_tick_on() {
    let rows = "PLANAR_COLLISION_MOD MASS 2\nPLANAR_COLLISION_MOD CENTRE 0.5\nPLANAR_COLLISION_MOD THRESHOLD 0.1\n\
                MOD_ENG MOD_ON PLANAR_COLLISION_MOD";
    let measured: Types = &[types::POSITION, types::VELOCITY, types::DES_FORCE];
    let mut observer = Alone::new(1, measured, "EXTERNAL_FORCE", rows);
    for _ in 0..1000 {
        assert!(observer.step(&[0.0, 0.0, 9.81]).abs() < 1e-4);
    }
    // A person carries part of the arm: it stays in place, and the motor does less.
    let mut found = 0.0;
    for _ in 0..1000 {
        found = observer.step(&[0.0, 0.0, 5.81]);
    }
    assert_close(found, 4.0, 1e-3);
    assert_eq!(observer.bench.signal("CONDITION"), [1.0]);
}

#[test]
fn a_place_beyond_reach_counts_as_the_nearest_one() {
    let rows = "PLANAR_INVERSE_MOD INNER_LENGTH 0.4\nPLANAR_INVERSE_MOD OUTER_LENGTH 0.3\n\
                MOD_ENG MOD_ON PLANAR_INVERSE_MOD";
    let mut inverse = Alone::new(2, &[types::DES_TIP_POSITION], "DES_POSITION", rows);
    let stretched = inverse.axes(&[3.0, 3.0]);
    assert_close(stretched[0], std::f32::consts::FRAC_PI_4, 1e-6);
    assert_close(stretched[1], 0.0, 1e-6);
    // 0.05 m in front of the base, where the minimum is 0.1 m.
    let folded = inverse.axes(&[0.05, 0.0]);
    assert_close(folded[0], 0.0, 1e-5);
    assert_close(folded[1].abs(), std::f32::consts::PI, 1e-5);
    assert!(inverse.axes(&[0.0, 0.0]).iter().all(|joint| joint.is_finite()));
}
