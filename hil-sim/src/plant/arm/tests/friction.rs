//! Dry friction holds, lets go, and couples; stops stop.

use super::*;

fn rough() -> ArmParameters {
    let mut parameters = planar();
    parameters.gravity_m_per_s2 = [0.0; 3];
    for link in &mut parameters.link {
        link.coulomb = 1.0;
    }
    parameters
}

#[test]
fn what_friction_holds_does_not_creep() {
    let mut arm = rough().build().unwrap();
    hold(&mut arm, 2000, &[0.999, -0.999], |_, arm| {
        for axis in [0, 1] {
            close(arm.axis(axis).position, 0.0, 0.0);
            close(arm.axis(axis).velocity, 0.0, 0.0);
        }
    });
}

#[test]
fn more_than_friction_holds_is_what_accelerates() {
    let mut arm = rough().build().unwrap();
    // Straight out, the second is dragged along as long as that takes no more than its friction.
    hold(&mut arm, 10, &[1.5, 0.0], |_, arm| close(arm.axis(1).position, 0.0, 0.0));
    let whole_kg_m2 = 2.0 * 0.25 + 1.2 * 0.64;
    close(arm.axis(0).velocity, 0.5 / whole_kg_m2 * 0.01, 1e-6);
    // With more, it slips: 1.2 · 0.3 · 0.8 of the acceleration is more than 1 N m.
    let mut arm = rough().build().unwrap();
    hold(&mut arm, 10, &[10.0, 0.0], |_, _| {});
    assert!(arm.axis(1).velocity < 0.0);
    let mass = arm.mass_matrix(&[0.0, 0.0]);
    let (m11, m12, m22) = (mass[(0, 0)], mass[(0, 1)], mass[(1, 1)]);
    // 9 N m are left for the first, and 1 N m of friction pushes the second forward.
    let acceleration = (9.0 * m22 - 1.0 * m12) / (m11 * m22 - m12 * m12);
    close(arm.axis(0).velocity, acceleration * 0.01, 2e-3 * acceleration * 0.01);
}

#[test]
fn a_sliding_arm_comes_to_rest_and_stays() {
    let mut arm = rough().build().unwrap();
    arm.set_state(&[0.0, 0.4], &[0.5, -2.0]);
    hold(&mut arm, 3000, &[], |_, _| {});
    let rest = arm.axis(0).position;
    close(arm.axis(0).velocity, 0.0, 0.0);
    close(arm.axis(1).velocity, 0.0, 0.0);
    hold(&mut arm, 100, &[], |_, arm| close(arm.axis(0).position, rest, 0.0));
    let energy = arm.energy();
    close(energy.supplied_j, 0.0, 0.0);
    close(energy.stored_j, 0.0, 0.0);
}

#[test]
fn a_stop_holds_what_leans_on_it() {
    let mut parameters = pendulum();
    parameters.link[0].stops =
        Some(StopsParameters { min: -0.2, stiffness: 5e3, damping: 100.0, ..StopsParameters::default() });
    let mut arm = parameters.build().unwrap();
    hold(&mut arm, 3000, &[], |_, _| {});
    let position = arm.axis(0).position;
    close(5e3 * (-0.2 - position), 2.0 * 9.81 * 0.5 * position.cos(), 1e-6);
    assert!(parameters.linear().link[0].stops.is_none());
}

#[test]
fn a_command_that_is_no_number_does_not_hang() {
    for command in [f32::NAN, f32::INFINITY] {
        let mut arm = rough().build().unwrap();
        hold(&mut arm, 3, &[command], |_, _| {});
        assert!(!arm.axis(0).actuator_force.is_finite());
    }
}
