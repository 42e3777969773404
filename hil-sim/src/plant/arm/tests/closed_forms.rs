//! Small arms against textbook closed forms.

use super::*;
use core::f64::consts::{FRAC_PI_2, PI};

/// The complete elliptic integral of the first kind, by the arithmetic-geometric mean.
fn quarter_period(modulus: f64) -> f64 {
    let (mut one, mut other) = (1.0, (1.0 - modulus * modulus).sqrt());
    for _ in 0..8 {
        (one, other) = (0.5 * (one + other), (one * other).sqrt());
    }
    PI / (2.0 * one)
}

#[test]
fn a_pendulum_has_the_period_of_the_elliptic_integral() {
    for swing_rad in [0.01, 0.5, 1.5, 3.0] {
        let mut parameters = pendulum();
        // It hangs at -pi/2.
        parameters.link[0].start_position = swing_rad - FRAC_PI_2;
        let mut arm = parameters.build().unwrap();
        let period_s = 4.0 * (0.5_f64 / 9.81).sqrt() * quarter_period((0.5 * swing_rad).sin());
        let ticks = 1000;
        for tick in 0..ticks {
            let tick_s = period_s / f64::from(ticks);
            arm.advance(f64::from(tick) * tick_s, tick_s, &[], &|_, _| 0.0);
        }
        // At the turning point position is flat in time; velocity is not.
        close(arm.axis(0).velocity, 0.0, 1e-9);
        close(arm.axis(0).position, swing_rad - FRAC_PI_2, 1e-9);
    }
}

#[test]
fn two_links_in_a_plane_follow_the_textbook() {
    // Craig, "Introduction to Robotics", example 6.7: point masses at the ends of two links.
    let arm = planar().build().unwrap();
    let (m1, m2, l1, l2, g) = (2.0, 1.2, 0.5, 0.3, 9.81);
    for (q1, q2, v1, v2) in [(0.3_f64, 0.8_f64, 0.0, 0.0), (-1.0, 2.0, 1.5, -0.7), (2.5, -0.4, -3.0, 4.0)] {
        let mass = arm.mass_matrix(&[q1, q2]);
        close(mass[(0, 0)], l2 * l2 * m2 + 2.0 * l1 * l2 * m2 * q2.cos() + l1 * l1 * (m1 + m2), 1e-14);
        close(mass[(0, 1)], l2 * l2 * m2 + l1 * l2 * m2 * q2.cos(), 1e-14);
        close(mass[(1, 0)], mass[(0, 1)], 0.0);
        close(mass[(1, 1)], l2 * l2 * m2, 1e-14);
        close(mass[(2, 2)], 0.0, 0.0);
        let gravity = arm.gravity_torques(&[q1, q2]);
        let outer = m2 * l2 * g * (q1 + q2).cos();
        close(gravity[0], outer + (m1 + m2) * l1 * g * q1.cos(), 1e-13);
        close(gravity[1], outer, 1e-13);
        let bias = arm.bias(&[q1, q2], &[v1, v2]);
        let pull = m2 * l1 * l2 * q2.sin();
        close(bias[0] - gravity[0], -pull * v2 * v2 - 2.0 * pull * v1 * v2, 1e-13);
        close(bias[1] - gravity[1], pull * v1 * v1, 1e-13);
        let [x, y, z] = arm.forward_kinematics(&[q1, q2]);
        close(x, l1 * q1.cos() + l2 * (q1 + q2).cos(), 1e-15);
        close(y, 0.0, 1e-15);
        close(z, l1 * q1.sin() + l2 * (q1 + q2).sin(), 1e-15);
    }
}

#[test]
fn a_sliding_joint_falls_and_its_motor_falls_with_it() {
    let mut slide = LinkParameters::new(LinkKind::Prismatic, 2.0, [0.1, 0.0, 0.0]);
    slide.motor_inertia = 0.5;
    let arm = ArmParameters { gravity_m_per_s2: earth(), tip_m: [0.0; 3], link: vec![slide] };
    let mut arm = arm.build().unwrap();
    hold(&mut arm, 1000, &[], |_, _| {});
    // The motor is geared to the joint: it has inertia, but no weight.
    close(arm.axis(0).position, -0.5 * 9.81 * 2.0 / 2.5, 1e-11);
    close(arm.forward_kinematics(&[0.7])[2], 0.7, 0.0);
}

#[test]
fn the_jacobian_is_the_slope_of_where_the_tip_is() {
    let mut parameters = six();
    parameters.link[2].kind = LinkKind::Prismatic;
    let arm = parameters.build().unwrap();
    let positions = [0.3, -0.7, 0.2, 1.1, 0.9, -2.0];
    let jacobian = arm.tip_jacobian(&positions);
    for axis in 0..6 {
        let mut ends = [positions; 2];
        ends[0][axis] -= 1e-5;
        ends[1][axis] += 1e-5;
        let [before, after] = ends.map(|end| arm.forward_kinematics(&end));
        for direction in 0..3 {
            close(jacobian[direction][axis], (after[direction] - before[direction]) / 2e-5, 1e-9);
        }
    }
}

#[test]
fn a_push_at_the_tip_is_held_by_the_transposed_jacobian() {
    let mut parameters = six();
    let positions = [0.3, -0.7, 0.5, 1.1, 0.9, -2.0];
    for (link, position) in parameters.link.iter_mut().zip(positions) {
        link.start_position = position;
    }
    let mut arm = parameters.build().unwrap();
    let push = [3.0, -5.0, 2.0];
    let jacobian = arm.tip_jacobian(&positions);
    let gravity = arm.gravity_torques(&positions);
    let command: Vec<f32> = (0..6)
        .map(|axis| {
            let held: f64 = (0..3).map(|direction| jacobian[direction][axis] * push[direction]).sum();
            #[expect(clippy::cast_possible_truncation, reason = "a command is single precision")]
            let command = (gravity[axis] - held) as f32;
            command
        })
        .collect();
    for tick in 0..100 {
        arm.advance_with_tip_force(f64::from(tick) * PERIOD_S, PERIOD_S, &command, &|tip| {
            assert!(tip.time_s < 0.1 + 1e-12);
            push
        });
    }
    for (axis, position) in positions.into_iter().enumerate() {
        close(arm.axis(axis).position, position, 1e-6);
    }
    let tip = arm.tip(0.1).position_m;
    let start = arm.forward_kinematics(&positions);
    close(tip[0], start[0], 1e-6);
}
