//! Arms against closed forms, and against what no arm can do.

use super::*;
use crate::plant::StopsParameters;

mod closed_forms;
mod conservation;
mod friction;
mod parameters;

const PERIOD_S: f64 = 1e-3;

/// Six joints that turn, all links with full inertias; nothing dissipates.
fn six() -> ArmParameters {
    let half_turn = core::f64::consts::FRAC_PI_2;
    let table = [
        (0.0, 0.0, 0.4, 4.0, [0.02, -0.03, -0.1]),
        (0.05, -half_turn, 0.1, 3.0, [0.2, 0.01, 0.03]),
        (0.4, 0.2, -0.05, 2.5, [0.15, -0.02, 0.01]),
        (0.1, half_turn, 0.35, 1.5, [0.01, 0.02, -0.06]),
        (0.0, -half_turn, 0.02, 1.0, [-0.01, 0.03, 0.02]),
        (0.03, 1.2, 0.08, 0.6, [0.02, 0.01, 0.04]),
    ];
    let link = table.map(|(a_m, alpha_rad, d_m, mass_kg, centre_of_mass_m)| LinkParameters {
        a_m,
        alpha_rad,
        d_m,
        theta_rad: 0.3 * d_m,
        inertia_kg_m2: [0.02, 0.03, 0.025, 0.002, -0.003, 0.001].map(|moment| moment * mass_kg),
        motor_inertia: 0.05,
        ..LinkParameters::new(LinkKind::Revolute, mass_kg, centre_of_mass_m)
    });
    ArmParameters { gravity_m_per_s2: earth(), tip_m: [0.02, 0.0, 0.1], link: link.to_vec() }
}

/// Two point masses in a vertical plane: lengths 0.5 m and 0.3 m, masses 2 kg and 1.2 kg at their ends.
fn planar() -> ArmParameters {
    let first = LinkParameters {
        alpha_rad: core::f64::consts::FRAC_PI_2,
        ..LinkParameters::new(LinkKind::Revolute, 2.0, [0.5, 0.0, 0.0])
    };
    let second = LinkParameters { a_m: 0.5, ..LinkParameters::new(LinkKind::Revolute, 1.2, [0.3, 0.0, 0.0]) };
    ArmParameters { gravity_m_per_s2: earth(), tip_m: [0.3, 0.0, 0.0], link: vec![first, second] }
}

/// One pendulum: 2 kg, 0.5 m from its joint, position 0 straight out.
fn pendulum() -> ArmParameters {
    let mut one = planar();
    one.link.truncate(1);
    one
}

/// Holds `command` for `ticks` with no outside force, calling `each` with the time after every one of them.
fn hold(arm: &mut Arm, ticks: u32, command: &[f32], mut each: impl FnMut(f64, &Arm)) {
    for tick in 0..ticks {
        arm.advance(f64::from(tick) * PERIOD_S, PERIOD_S, command, &|_, _| 0.0);
        each(f64::from(tick + 1) * PERIOD_S, arm);
    }
}

#[track_caller]
fn close(actual: f64, expected: f64, tolerance: f64) {
    assert!((actual - expected).abs() <= tolerance, "{actual:e} instead of {expected:e}");
}
