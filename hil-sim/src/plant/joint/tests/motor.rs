//! The brushed motor against its closed forms.

use super::*;

const RESISTANCE_OHM: f64 = 2.32;
const INDUCTANCE_H: f64 = 2.38e-4;
const CONSTANT_NM_PER_A: f64 = 0.0234;
const SUPPLY_V: f64 = 24.0;
const FAR_TOO_MUCH_NM: f64 = 1e3;

fn driven(load_kg_m2: f64, motor: BrushedParameters) -> Joint {
    let motor = JointMotorParameters::Brushed(motor);
    JointParameters { motor, ..JointParameters::of_inertia(load_kg_m2) }.build().unwrap()
}

/// On the voltage limit: `w = w0 (1 + (s2 e^(s1 t) - s1 e^(s2 t))/(s1 - s2))`, `s` from `s² + s R/L + kt²/(L J) = 0`,
/// `w0 = U/ke`. The slow pole is near the mechanical time constant `R J/kt²`.
#[test]
fn a_motor_spins_up_to_its_no_load_speed_with_its_two_time_constants() {
    let inertia = 4e-6 + 1.08e-6;
    let half = 0.5 * RESISTANCE_OHM / INDUCTANCE_H;
    let root = (half * half - CONSTANT_NM_PER_A * CONSTANT_NM_PER_A / (INDUCTANCE_H * inertia)).sqrt();
    let (s1, s2) = (root - half, -half - root);
    let no_load = SUPPLY_V / CONSTANT_NM_PER_A;
    let time_constant_s = RESISTANCE_OHM * inertia / (CONSTANT_NM_PER_A * CONSTANT_NM_PER_A);
    assert!((-1.0 / s1 / time_constant_s - 1.0).abs() < 0.01, "{} {time_constant_s}", -1.0 / s1);

    let mut joint = driven(4e-6, BrushedParameters::default());
    let mut speed = Worst::default();
    hold(&mut joint, 500, FAR_TOO_MUCH_NM, |t, state| {
        let share = (s2 * libm::exp(s1 * t) - s1 * libm::exp(s2 * t)) / (s1 - s2);
        speed.see(state.velocity / no_load, 1.0 + share);
        close(state.voltage_v, SUPPLY_V, 0.0);
    });
    speed.below("spin-up, share of no-load speed", 1e-6);
    close(joint.state().velocity / no_load, 1.0, 1e-9);
}

/// `w0 = U/ke - R τ/(kt ke)`.
#[test]
fn friction_of_the_rotor_takes_off_its_no_load_speed_and_holds_it_below() {
    let coulomb_nm = 0.02;
    let motor = BrushedParameters { coulomb_nm, ..BrushedParameters::default() };
    let no_load =
        SUPPLY_V / CONSTANT_NM_PER_A - RESISTANCE_OHM * coulomb_nm / (CONSTANT_NM_PER_A * CONSTANT_NM_PER_A);
    let mut joint = driven(4e-6, motor);
    hold(&mut joint, 100, 0.0199, |_, state| close(state.velocity, 0.0, 0.0));
    hold(&mut joint, 600, FAR_TOO_MUCH_NM, |_, _| {});
    close(joint.state().velocity / no_load, 1.0, 1e-9);
}

/// `i = i_ref (1 - e^(-wc t))` while the voltage lasts, whatever the speed; `i_ref` up to the limit.
#[test]
fn the_current_loop_is_a_first_order_lag_of_its_bandwidth_up_to_the_current_limit() {
    let bandwidth = 3000.0;
    let motor = BrushedParameters {
        current_bandwidth_rad_per_s: bandwidth,
        current_limit_a: 2.0,
        ..BrushedParameters::default()
    };
    for (wanted_a, given_a) in [(1.5, 1.5), (5.0, 2.0), (-7.0, -2.0)] {
        let mut joint = driven(4e-5, motor.clone());
        let mut current = Worst::default();
        for step in 0..200_u32 {
            let t = f64::from(step) * 5e-5;
            joint.advance(t, 5e-5, wanted_a * CONSTANT_NM_PER_A, &|_| 0.0);
            let expected = given_a * (1.0 - libm::exp(-bandwidth * (t + 5e-5)));
            current.see(joint.state().current_a, expected);
        }
        current.below("current loop, A", 1e-7);
    }
}

/// `T' = (R (1 + α (T - 25)) i² - (T - T_a)/R_th)/C` is linear in `T`.
#[test]
fn a_winding_warms_up_exponentially_and_its_resistance_with_it() {
    let thermal = ThermalParameters {
        resistance_k_per_w: 10.0,
        capacity_j_per_k: 0.2,
        ambient_c: 20.0,
        coefficient_per_k: 0.0039,
    };
    let motor = BrushedParameters { thermal: Some(thermal), ..BrushedParameters::default() };
    let mut joint = driven(1e3, motor);
    let current_a = 3.0;
    // The closed form begins when the current is there.
    hold(&mut joint, 10, current_a * CONSTANT_NM_PER_A, |_, _| {});
    let start_c = joint.state().winding_c;
    let heating_w = RESISTANCE_OHM * current_a * current_a;
    let rate_per_s = (1.0 / 10.0 - heating_w * 0.0039) / 0.2;
    let end_c = (heating_w * (1.0 - 0.0039 * 25.0) + 20.0 / 10.0) / 0.2 / rate_per_s;
    let mut temperature = Worst::default();
    hold(&mut joint, 3000, current_a * CONSTANT_NM_PER_A, |t, state| {
        temperature.see(state.winding_c, end_c + (start_c - end_c) * libm::exp(-rate_per_s * t));
        let resistance_ohm = RESISTANCE_OHM * (1.0 + 0.0039 * (state.winding_c - 25.0));
        let back_emf_v = CONSTANT_NM_PER_A * state.motor_velocity;
        close(state.voltage_v, resistance_ohm * current_a + back_emf_v, 1e-9);
    });
    assert!(joint.state().winding_c > 100.0, "{:?}", joint.state());
    temperature.below("winding, K", 1e-8);
}
