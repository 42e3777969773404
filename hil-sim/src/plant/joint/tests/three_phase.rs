//! The three-phase motor against its closed forms.

use super::*;

const FAR_TOO_MUCH_NM: f64 = 1e3;

fn driven(load_kg_m2: f64, motor: ThreePhaseParameters) -> Joint {
    let motor = JointMotorParameters::ThreePhase(motor);
    JointParameters { motor, ..JointParameters::of_inertia(load_kg_m2) }.build().unwrap()
}

/// `τ = 3/2 p ψ i_q`, and `i_q` a first-order lag of the loop's bandwidth.
#[test]
fn torque_follows_with_the_bandwidth_of_the_current_loop() {
    let motor = ThreePhaseParameters { quadrature_inductance_h: 5e-4, ..ThreePhaseParameters::default() };
    let constant_nm_per_a = 1.5 * 10.0 * 0.008;
    let mut joint = driven(1.0, motor);
    let (mut current, mut torque) = (Worst::default(), Worst::default());
    for step in 0..100_u32 {
        let t = f64::from(step) * 5e-5;
        joint.advance(t, 5e-5, 0.6, &|_| 0.0);
        let state = joint.state();
        let lag = 1.0 - libm::exp(-core::f64::consts::TAU * 1000.0 * (t + 5e-5));
        current.see(state.current_a, 0.6 / constant_nm_per_a * lag);
        // The load takes what accelerates it, the rotor the rest.
        torque.see(state.force * (1.0 + 3e-5), constant_nm_per_a * state.current_a);
    }
    current.below("three-phase current, A", 1e-5);
    torque.below("3/2 p ψ i_q, N m", 1e-12);
}

/// No-load speed `U/(sqrt(3) p ψ)`, and the voltage never leaves its circle on the way, nor while braking.
#[test]
fn voltage_stays_in_its_circle_and_sets_the_no_load_speed() {
    let mut joint = driven(2e-5, ThreePhaseParameters::default());
    let radius_v = 48.0 / 3.0_f64.sqrt();
    let mut largest_v = 0.0_f64;
    hold(&mut joint, 500, FAR_TOO_MUCH_NM, |_, state| largest_v = largest_v.max(state.voltage_v));
    let no_load = radius_v / (10.0 * 0.008);
    let state = joint.state();
    println!("no-load speed: off by {:.1e} of it", (state.velocity / no_load - 1.0).abs());
    close(state.velocity / no_load, 1.0, 1e-3);
    hold(&mut joint, 500, -FAR_TOO_MUCH_NM, |_, state| largest_v = largest_v.max(state.voltage_v));
    close(joint.state().velocity / no_load, -1.0, 1e-3);
    assert!((radius_v - largest_v).abs() < 1e-9, "{largest_v} V, circle {radius_v} V");
}

/// It costs `4/π U share` of voltage, and no torque once the integrators have learnt it; a step of current loses
/// torque until then.
#[test]
fn dead_time_costs_voltage_and_for_a_while_torque() {
    let constant_nm_per_a = 1.5 * 10.0 * 0.008;
    let run = |dead_time_share| {
        let motor = ThreePhaseParameters { dead_time_share, ..ThreePhaseParameters::default() };
        let mut joint = driven(1e3, motor);
        hold(&mut joint, 1, 5.0 * constant_nm_per_a, |_, _| {});
        let early = joint.state();
        hold(&mut joint, 100, 5.0 * constant_nm_per_a, |_, _| {});
        (early, joint.state())
    };
    let ((early, late), (ideal_early, ideal)) = (run(0.02), run(0.0));
    assert!(early.current_a < ideal_early.current_a - 0.1, "{early:?} {ideal_early:?}");
    close(late.current_a, 5.0, 1e-9);
    close(late.voltage_v - ideal.voltage_v, 4.0 / core::f64::consts::PI * 48.0 * 0.02, 1e-6);
}
