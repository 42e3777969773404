//! The PHANToM against what is published of it, and against what no device can do.

use super::*;
use proptest::prelude::*;

const PERIOD_S: f64 = 1e-3;

#[track_caller]
fn close(actual: f64, expected: f64, tolerance: f64) {
    assert!((actual - expected).abs() <= tolerance, "{actual:e} instead of {expected:e}");
}

fn still(_: &Tip) -> [f64; 3] {
    [0.0; 3]
}

/// Holds `command` for `ticks` with nobody at the tip.
fn hold(phantom: &mut Phantom, ticks: u32, command: &[f32]) {
    for tick in 0..ticks {
        phantom.advance(f64::from(tick) * PERIOD_S, PERIOD_S, command, &still);
    }
}

/// The columns of the matrix of Coriolis terms, from the bias, which is quadratic in the velocities.
fn coriolis(body: &Coupled<Linkage>, position: &[f64; 3], velocity: &[f64; 3]) -> [[f64; 3]; 3] {
    let gravity = body.gravity_torques(position);
    let quadratic = |velocity: &[f64; 3]| {
        let bias = body.bias(position, velocity);
        [0, 1, 2].map(|axis| bias[axis] - gravity[axis])
    };
    [0, 1, 2].map(|column| {
        let mut unit = [0.0; 3];
        unit[column] = 1.0;
        let both = [0, 1, 2].map(|axis| velocity[axis] + unit[axis]);
        let (both, one, other) = (quadratic(&both), quadratic(velocity), quadratic(&unit));
        [0, 1, 2].map(|axis| 0.5 * (both[axis] - one[axis] - other[axis]))
    })
}

proptest! {
    #[test]
    fn the_mass_matrix_is_positive_definite(position in prop::array::uniform3(-4.0..4.0)) {
        let phantom = PhantomParameters::default().ideal().build().unwrap();
        let mass = phantom.dynamics().mass_matrix(&position);
        prop_assert!(mass[(0, 0)] > 1e-3);
        prop_assert!(mass[(1, 1)] * mass[(2, 2)] - mass[(1, 2)] * mass[(2, 1)] > 1e-6);
        prop_assert!((mass[(1, 2)] - mass[(2, 1)]).abs() <= 0.0);
        for (row, column) in [(0, 1), (0, 2), (1, 0), (2, 0)] {
            prop_assert!(mass[(row, column)].abs() <= 0.0);
        }
    }

    #[test]
    fn coriolis_forces_do_no_work(
        position in prop::array::uniform3(-4.0..4.0),
        velocity in prop::array::uniform3(-5.0..5.0),
    ) {
        let phantom = PhantomParameters::default().ideal().build().unwrap();
        let body = phantom.dynamics();
        let columns = coriolis(body, &position, &velocity);
        let step_s = 1e-4;
        let at = |share: f64| body.mass_matrix(&[0, 1, 2].map(|axis| position[axis] + share * step_s * velocity[axis]));
        let (before, after, long_before, long_after) = (at(-1.0), at(1.0), at(-2.0), at(2.0));
        let skew = |row: usize, column: usize| {
            let rate = (8.0 * (after[(row, column)] - before[(row, column)])
                - (long_after[(row, column)] - long_before[(row, column)])) / (12.0 * step_s);
            rate - 2.0 * columns[column][row]
        };
        for row in 0..3 {
            for column in 0..=row {
                let off = skew(row, column) + skew(column, row);
                prop_assert!(off.abs() < 1e-11, "{row} {column}: {off:e}");
            }
        }
    }
}

#[test]
fn the_tip_feels_as_heavy_as_published() {
    let phantom = PhantomParameters::default().ideal().build().unwrap();
    let body = phantom.dynamics();
    let (mass, jacobian) = (body.mass_matrix(&[0.0; 3]), body.tip_jacobian(&[0.0; 3]));
    // All at right angles: each direction has its own axis.
    for (direction, axis, lever_m, apparent_kg) in
        [(0, 2, 0.170, 0.0322), (1, 0, 0.215, 0.0773), (2, 1, 0.215, 0.0525)]
    {
        close(jacobian[direction][axis], lever_m, 1e-15);
        close(mass[(axis, axis)] / (lever_m * lever_m), apparent_kg, 0.5e-4);
    }
    // And as that it is pushed.
    let mut parameters = PhantomParameters::default().ideal();
    parameters.linkage.gravity_m_per_s2 = 0.0;
    for (direction, apparent_kg) in [(0, 0.0322), (1, 0.0773), (2, 0.0525)] {
        let mut phantom = parameters.build().unwrap();
        let mut push_n = [0.0; 3];
        push_n[direction] = 0.1;
        phantom.advance(0.0, PERIOD_S, &[], &|_| push_n);
        let expected = 0.1 * PERIOD_S / apparent_kg;
        // As well as the masses are rounded.
        close(phantom.tip(PERIOD_S).velocity_m_per_s[direction], expected, 2e-3 * expected);
    }
}

#[test]
fn the_tip_is_where_the_angles_say() {
    let phantom = PhantomParameters::default().build().unwrap();
    let body = phantom.dynamics();
    for (seen, expected) in phantom.tip(0.0).position_m.into_iter().zip([0.215, 0.0, -0.170]) {
        close(seen, expected, 0.0);
    }
    let [x, y, z] = body.forward_kinematics(&[0.5, 0.4, 0.7]);
    let reach = 0.215 * 0.4_f64.cos() + 0.170 * 0.7_f64.sin();
    close(x, reach * 0.5_f64.cos(), 1e-15);
    close(y, reach * 0.5_f64.sin(), 1e-15);
    close(z, 0.215 * 0.4_f64.sin() - 0.170 * 0.7_f64.cos(), 1e-15);
    let position = [0.5, 0.4, 0.7];
    let jacobian = body.tip_jacobian(&position);
    for axis in 0..3 {
        let mut ends = [position; 2];
        ends[0][axis] -= 1e-5;
        ends[1][axis] += 1e-5;
        let [before, after] = ends.map(|end| body.forward_kinematics(&end));
        for direction in 0..3 {
            close(jacobian[direction][axis], (after[direction] - before[direction]) / 2e-5, 1e-10);
        }
    }
}

#[test]
fn a_force_at_the_tip_is_the_torques_of_its_levers() {
    let start_position_rad = [0.3, 0.2, 0.4];
    let parameters = PhantomParameters { start_position_rad, ..PhantomParameters::default() };
    let mut by_force = parameters.build().unwrap();
    let mut by_torque = PhantomParameters { port: PhantomPort::Joint, ..parameters.clone() }.build().unwrap();
    let jacobian = by_force.dynamics().tip_jacobian(&start_position_rad);
    let force_n = [1.5_f32, -0.5, 2.0];
    hold(&mut by_force, 1, &force_n);
    #[expect(clippy::cast_possible_truncation, reason = "a command is single precision")]
    let torques_nm = [0, 1, 2]
        .map(|axis| (0..3).map(|row| jacobian[row][axis] * f64::from(force_n[row])).sum::<f64>() as f32);
    hold(&mut by_torque, 1, &torques_nm);
    for (axis, torque_nm) in torques_nm.into_iter().enumerate() {
        close(by_force.axis(axis).actuator_force, f64::from(torque_nm), 1e-7);
        close(by_force.axis(axis).velocity, by_torque.axis(axis).velocity, 1e-6);
    }
    // Held against a hand that pushes back as hard, nothing but gravity moves it.
    let mut parameters = PhantomParameters { start_position_rad, ..PhantomParameters::default().ideal() };
    parameters.linkage.gravity_m_per_s2 = 0.0;
    let mut held = parameters.build().unwrap();
    for tick in 0..100 {
        held.advance(f64::from(tick) * PERIOD_S, PERIOD_S, &force_n, &|_| {
            force_n.map(|force_n| -f64::from(force_n))
        });
    }
    close(held.axis(1).position, start_position_rad[1], 1e-12);
}

#[test]
fn motors_pull_no_more_than_they_can() {
    let mut phantom =
        PhantomParameters { port: PhantomPort::Joint, ..PhantomParameters::default() }.build().unwrap();
    hold(&mut phantom, 1, &[9.0, -9.0, 9.0]);
    close(phantom.axis(0).actuator_force, 13.3 * 0.129, 1e-12);
    close(phantom.axis(1).actuator_force, -11.2 * 0.129, 1e-12);
}

#[test]
fn a_light_touch_is_lost_in_friction() {
    let mut parameters = PhantomParameters::default();
    parameters.linkage.gravity_m_per_s2 = 0.0;
    let mut phantom = parameters.build().unwrap();
    // 0.01 N m at levers of 0.17 m and 0.215 m.
    for (force_n, moves) in [(0.045, false), (0.07, true)] {
        for tick in 0..100 {
            phantom.advance(f64::from(tick) * PERIOD_S, PERIOD_S, &[], &|_| [force_n; 3]);
        }
        for axis in 0..3 {
            assert_eq!(phantom.axis(axis).position.abs() > 0.0, moves, "{axis} at {force_n} N");
        }
    }
}

#[test]
fn a_tip_let_go_falls_to_its_ends_and_rests_there() {
    let mut phantom = PhantomParameters::default().build().unwrap();
    phantom.set_state(&[0.2, 0.5, 0.6], &[3.0, 0.0, 0.0]);
    let start_j = phantom.energy().stored_j;
    hold(&mut phantom, 6000, &[]);
    let energy = phantom.energy();
    close(energy.supplied_j, 0.0, 0.0);
    close(start_j - energy.stored_j, energy.dissipated_j, 1e-6 * energy.dissipated_j);
    let body = phantom.dynamics();
    for axis in 0..3 {
        close(phantom.axis(axis).velocity, 0.0, 1e-3);
    }
    let [_, inner, outer, ..] = *body.positions();
    let elbow_rad = inner - outer;
    assert!(elbow_rad > -55_f64.to_radians() - 0.05 && elbow_rad < 65_f64.to_radians() + 0.05);
}

#[test]
fn energy_is_kept() {
    let damped = PhantomParameters::default().linear();
    for (parameters, tolerance) in
        [(PhantomParameters::default().ideal(), 1e-9), (damped, 1e-9), (PhantomParameters::default(), 1e-6)]
    {
        let mut phantom = parameters.build().unwrap();
        let start_j = phantom.energy().stored_j;
        let mut peak_j = 0.0_f64;
        for tick in 0..1000_u16 {
            let wave = f32::from(tick) * 0.02;
            let command = [0.8 * wave.sin(), wave.cos(), 0.5 + 0.6 * wave.sin()];
            phantom.advance(f64::from(tick) * PERIOD_S, PERIOD_S, &command, &|tip| {
                // A hand: a spring and a damper to where it wants to be.
                let wanted = [0.2, 0.02 * libm::sin(7.0 * tip.time_s), -0.15];
                [0, 1, 2]
                    .map(|axis| 30.0 * (wanted[axis] - tip.position_m[axis]) - tip.velocity_m_per_s[axis])
            });
            let energy = phantom.energy();
            peak_j = peak_j.max(energy.supplied_j.abs()).max((energy.stored_j - start_j).abs());
        }
        let energy = phantom.energy();
        let made_j = energy.stored_j - start_j - energy.supplied_j + energy.dissipated_j;
        println!("made {made_j:e} of {peak_j:e} J");
        assert!(made_j.abs() <= tolerance * peak_j, "{made_j:e} J made of {peak_j:e} J");
    }
}

#[test]
fn a_file_names_what_differs() {
    let text = "port = \"joint\"\ncoulomb_nm = 0.0\n[linkage]\ngravity_m_per_s2 = 0.0\n";
    let parameters: PhantomParameters = toml::from_str(text).unwrap();
    assert_eq!(parameters.port, PhantomPort::Joint);
    let again: PhantomParameters = toml::from_str(&toml::to_string(&parameters).unwrap()).unwrap();
    assert_eq!(again, parameters);
    assert!(toml::from_str::<PhantomParameters>("coulomb = 0.0").is_err());
}

#[test]
fn what_cannot_be_is_refused_by_its_path() {
    let refused = |change: &dyn Fn(&mut PhantomParameters), path: &str| {
        let mut parameters = PhantomParameters::default();
        change(&mut parameters);
        assert_eq!(parameters.check().unwrap_err().path, path);
    };
    refused(&|phantom| phantom.gear_ratio[1] = 0.0, "gear_ratio[1]");
    refused(&|phantom| phantom.max_rad[2] = -2.0, "max_rad[2]");
    refused(&|phantom| phantom.elbow_min_rad = f64::NAN, "elbow_min_rad");
    refused(&|phantom| phantom.stop_stiffness_nm_per_rad = 0.0, "stop_stiffness_nm_per_rad");
    refused(&|phantom| phantom.stop_damping_nms_per_rad = 1e4, "stop_damping_nms_per_rad");
    refused(&|phantom| phantom.linkage.inner_kg_m2[0] = 0.0, "linkage.inner_kg_m2[0]");
    refused(&|phantom| phantom.linkage.outer_kg = -1.0, "linkage.outer_kg");
    refused(&|phantom| phantom.motor_limit_nm = 0.0, "motor_limit_nm");
}
