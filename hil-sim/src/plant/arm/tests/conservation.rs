//! No arm makes energy, and none turns mass into force where there is none.

use super::*;
use crate::plant::coupled::AxisValues;
use dimsart_core::limits::MAX_DOF;
use proptest::prelude::*;

/// Supplied less dissipated is the change of what is stored.
#[track_caller]
fn is_balanced(arm: &Arm, stored_at_start_j: f64, peak_j: f64, tolerance: f64) {
    let energy = arm.energy();
    let made_j = energy.stored_j - stored_at_start_j - energy.supplied_j + energy.dissipated_j;
    println!("made {made_j:e} of {peak_j:e} J");
    assert!(made_j.abs() <= tolerance * peak_j, "{made_j:e} J made of {peak_j:e} J");
}

fn swing(mut parameters: ArmParameters, tolerance: f64) {
    for link in &mut parameters.link {
        link.effort_limit = 15.0;
    }
    let mut arm = parameters.build().unwrap();
    let start_j = arm.energy().stored_j;
    let mut peak_j = 0.0_f64;
    for tick in 0..1000_u16 {
        let time_s = f64::from(tick) * PERIOD_S;
        let wave = f32::from(tick) * 0.02;
        let command = [wave.sin() * 30.0, wave.cos() * 20.0, 5.0, -3.0 * wave.sin(), 1.0, 0.5 * wave.cos()];
        arm.advance(time_s, PERIOD_S, &command, &|axis, time_s| {
            if axis == 1 { 4.0 * libm::sin(9.0 * time_s) } else { 0.3 }
        });
        let energy = arm.energy();
        peak_j = peak_j.max(energy.supplied_j.abs()).max((energy.stored_j - start_j).abs());
        assert!(arm.axis(0).actuator_force.abs() <= 15.0);
    }
    is_balanced(&arm, start_j, peak_j, tolerance);
}

#[test]
fn energy_is_kept_without_losses_and_with_them() {
    swing(six(), 1e-9);
    let mut damped = six();
    for link in &mut damped.link {
        link.viscous = 0.4;
    }
    swing(damped, 1e-9);
}

#[test]
fn energy_is_kept_through_dry_friction_and_stops() {
    let mut rough = six();
    for link in &mut rough.link {
        link.coulomb = 0.5;
        link.stops = Some(StopsParameters { min: -0.4, max: 0.5, stiffness: 2000.0, damping: 3.0 });
    }
    swing(rough, 1e-6);
}

/// `(dM/dt - 2 C) q'` made of the bias alone: what Coriolis terms do to the kinetic energy is what the changing mass
/// matrix does, `q'ᵀ C q' = ½ q'ᵀ (dM/dt) q'`.
fn coriolis_does_no_work(
    arm: &Arm,
    position: &AxisValues,
    velocity: &AxisValues,
) -> Result<(), TestCaseError> {
    let step = 1e-4;
    let moved = |share: f64| -> [f64; MAX_DOF] {
        core::array::from_fn(|axis| position[axis] + share * step * velocity[axis])
    };
    let kinetic_j = |position: &AxisValues| {
        let mass = arm.mass_matrix(position);
        let pairs = (0..MAX_DOF).flat_map(|row| (0..MAX_DOF).map(move |column| (row, column)));
        pairs.map(|(row, column)| 0.5 * mass[(row, column)] * velocity[row] * velocity[column]).sum::<f64>()
    };
    let slope_w = (8.0 * (kinetic_j(&moved(1.0)) - kinetic_j(&moved(-1.0)))
        - (kinetic_j(&moved(2.0)) - kinetic_j(&moved(-2.0))))
        / (12.0 * step);
    let (bias, gravity) = (arm.bias(position, velocity), arm.gravity_torques(position));
    let power_w: f64 = (0..MAX_DOF).map(|axis| (bias[axis] - gravity[axis]) * velocity[axis]).sum();
    prop_assert!((power_w - slope_w).abs() < 1e-8 * (1.0 + power_w.abs()), "{power_w} W, {slope_w} W");
    Ok(())
}

proptest! {
    #[test]
    fn the_mass_matrix_is_positive_and_coriolis_forces_do_no_work(
        position in prop::array::uniform6(-3.0..3.0),
        velocity in prop::array::uniform6(-2.0..2.0),
        sliding in 0..6_usize,
    ) {
        let mut parameters = six();
        parameters.link[sliding].kind = LinkKind::Prismatic;
        let arm = parameters.build().unwrap();
        let full = |values: [f64; 6]| -> AxisValues {
            core::array::from_fn(|axis| values.get(axis).copied().unwrap_or_default())
        };
        let (position, velocity) = (full(position), full(velocity));
        let mass = arm.mass_matrix(&position);
        let square: f64 = (0..6).map(|row| {
            (0..6).map(|column| mass[(row, column)] * velocity[row] * velocity[column]).sum::<f64>()
        }).sum();
        let speed: f64 = velocity.iter().map(|velocity| velocity * velocity).sum();
        // Each motor has 0.05.
        prop_assert!(square >= 0.05 * speed);
        coriolis_does_no_work(&arm, &position, &velocity)?;
    }
}
