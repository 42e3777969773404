//! Torque accuracy, at all speeds within the voltage limit.

use hil_sim::plant::ThreePhaseParameters;

use crate::bench::{Bench, PERIOD_S, configuration, motor};

/// Maximum torque error by encoder, converters and dead time, all simulated.
const MAX_ERROR: f64 = 0.02;

/// Returns the motoring speed at which this current needs this share of the maximum voltage, `rad/s`.
fn speed_at(motor: &ThreePhaseParameters, current_a: f64, share: f64) -> f64 {
    let radius_v = share * 0.86 * motor.supply_v / 3.0_f64.sqrt();
    let taken_v = |speed: f64| {
        let electrical = f64::from(motor.pole_pairs) * speed;
        let d_v = electrical * motor.quadrature_inductance_h * current_a;
        (motor.resistance_ohm * current_a + electrical * motor.flux_linkage_vs).hypot(d_v)
    };
    let (mut low, mut high) = (0.0, 1_000.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *(if taken_v(middle) < radius_v { &mut low } else { &mut high }) = middle;
    }
    low
}

#[test]
fn the_torque_is_right_to_two_percent_at_every_speed_that_the_voltage_allows() {
    let motor = motor();
    for (resistance, inductance) in [(1.0, 1.0), (0.7, 0.7), (0.7, 1.3), (1.3, 0.7), (1.3, 1.3)] {
        let mut told = configuration(&motor);
        told.motor.resistance_ohm *= resistance;
        told.motor.direct_inductance_h *= inductance;
        told.motor.quadrature_inductance_h *= inductance;
        for current_a in [2.0_f64, 10.0, 20.0] {
            let fastest = speed_at(&motor, current_a, 0.95);
            let wanted_nm = told.motor.torque_constant_nm_per_a() * current_a as f32;
            for speed in [-0.8 * fastest, -20.0, 0.0, 3.0, 0.5 * fastest, fastest] {
                let mut bench = Bench::new(&motor, told);
                bench.motor.set_rotor(1.0, speed);
                let found_nm = bench.mean_torque_nm(wanted_nm, 2_000);
                let error = found_nm / f64::from(wanted_nm) - 1.0;
                assert!(
                    error.abs() < MAX_ERROR,
                    "R {resistance}, L {inductance}, {current_a} A, {speed} rad/s: {error}"
                );
                assert_eq!(bench.drive.fault(), None);
            }
        }
    }
}

#[test]
fn a_motor_whose_inductances_differ_makes_the_torque_with_its_current_across_the_magnets_alone() {
    let motor = ThreePhaseParameters { direct_inductance_h: 2e-4, quadrature_inductance_h: 4e-4, ..motor() };
    let mut bench = Bench::new(&motor, configuration(&motor));
    bench.motor.set_rotor(0.3, 60.0);
    let wanted_nm = bench.configuration.motor.torque_constant_nm_per_a() * 10.0;
    let found_nm = bench.mean_torque_nm(wanted_nm, 2_000);
    assert!((found_nm / f64::from(wanted_nm) - 1.0).abs() < MAX_ERROR, "{found_nm} {wanted_nm}");
    assert!(bench.motor.state().direct_a.abs() < 0.3, "{:?}", bench.motor.state());
}

#[test]
fn a_torque_that_comes_and_goes_at_high_speed_leaves_the_flux_alone() {
    let motor = motor();
    let mut bench = Bench::new(&motor, configuration(&motor)).exact();
    bench.motor.set_rotor(0.0, 0.7 * speed_at(&motor, 10.0, 1.0));
    let constant = bench.configuration.motor.torque_constant_nm_per_a();
    bench.run(Some(0.0), 400);
    let mut max_a = 0.0_f64;
    for current_a in [10.0, -10.0, 0.0] {
        for _ in 0..200 {
            bench.step(Some(constant * current_a));
            max_a = max_a.max(bench.motor.state().direct_a.abs());
        }
    }
    // 2 A without decoupling, 1.1 A without extrapolation of the angle.
    assert!(max_a < 0.8, "{max_a} A on the d axis");
}

#[test]
fn cogging_turns_the_rotor_back_and_forth_and_leaves_the_torque_of_the_current_right() {
    let motor = ThreePhaseParameters { rotor_inertia_kg_m2: 3e-4, ..motor() };
    let mut bench = Bench::new(&motor, configuration(&motor));
    bench.motor = bench.motor.with_cogging(0.05, 84);
    // A torque below the cogging torque, then one above it.
    for wanted_nm in [0.03_f32, 0.3] {
        let found_nm = bench.mean_torque_nm(wanted_nm, 600);
        assert!((found_nm / f64::from(wanted_nm) - 1.0).abs() < MAX_ERROR, "{wanted_nm}: {found_nm}");
        let speed = bench.motor.state().speed_rad_per_s;
        assert_eq!(speed > 20.0, wanted_nm > 0.05, "{wanted_nm} N m: {speed} rad/s");
    }
}

#[test]
fn dead_time_that_is_made_up_for_leaves_a_fifth_of_its_ripple() {
    let motor = motor();
    let ripple = |share: f32| {
        let mut told = configuration(&motor);
        told.inverter.dead_time_share = share;
        let mut bench = Bench::new(&motor, told).exact();
        bench.motor.set_rotor(0.0, 40.0);
        let wanted_nm = bench.configuration.motor.torque_constant_nm_per_a() * 3.0;
        bench.run(Some(wanted_nm), 2_000);
        let torques = (0..2_000).map(|_| bench.step(Some(wanted_nm)));
        let (least, most) =
            torques.fold((f64::MAX, f64::MIN), |(least, most), nm| (nm.min(least), nm.max(most)));
        most - least
    };
    let (with, without) = (ripple(motor.dead_time_share as f32), ripple(0.0));
    assert!(with < 0.2 * without, "{with} N m with, {without} N m without");
}

#[test]
fn beyond_the_voltage_the_flux_is_held_and_the_torque_is_there_again_as_soon_as_the_voltage_is() {
    let motor = motor();
    let mut bench = Bench::new(&motor, configuration(&motor)).exact();
    let wanted_nm = bench.configuration.motor.torque_constant_nm_per_a() * 10.0;
    bench.motor.set_rotor(0.0, 1.3 * speed_at(&motor, 10.0, 1.0));
    for _ in 0..4_000 {
        bench.step(Some(wanted_nm));
        let voltage_v = bench.drive.measured().voltage_v;
        assert!(voltage_v.d.hypot(voltage_v.q) <= 0.86 * 24.0 / 3.0_f32.sqrt() + 1e-4, "{voltage_v:?}");
    }
    assert!(bench.motor.torque_nm() < 0.5 * f64::from(wanted_nm), "{}", bench.motor.torque_nm());
    // The load brakes it within 50 ms; the integrals have not wound up.
    let (fast, slow) = (bench.motor.state().speed_rad_per_s, 0.5 * speed_at(&motor, 10.0, 1.0));
    let mut max_nm = 0.0_f64;
    for period in 0..2_000 {
        let share = f64::from(period.min(1_000)) / 1_000.0;
        let angle_rad = bench.motor.state().angle_rad;
        bench.motor.set_rotor(angle_rad, fast + share * (slow - fast));
        max_nm = max_nm.max(bench.step(Some(wanted_nm)));
    }
    assert!(max_nm < 1.1 * f64::from(wanted_nm), "{max_nm} {wanted_nm}");
    assert_eq!(bench.drive.fault(), None);
    assert!((bench.motor.torque_nm() / f64::from(wanted_nm) - 1.0).abs() < MAX_ERROR);
}

#[test]
fn the_drive_knows_its_torque_and_speed() {
    let motor = motor();
    let mut bench = Bench::new(&motor, configuration(&motor));
    bench.motor.set_rotor(0.0, 90.0);
    for _ in 0..2_000 {
        bench.step(Some(0.5));
    }
    let measured = bench.drive.measured();
    assert!((f64::from(measured.torque_nm) / bench.motor.torque_nm() - 1.0).abs() < 0.03, "{measured:?}");
    assert!((measured.speed_rad_per_s - 90.0).abs() < 1.0, "{measured:?}");
    let lost_rad = 90.0 * PERIOD_S as f32;
    let exact = drive::Angle::from_rad(
        ((bench.motor.state().angle_rad + 0.4 + 1e-9).rem_euclid(core::f64::consts::TAU)
            - core::f64::consts::PI) as f32,
    );
    let ahead = drive::Angle(exact.0.wrapping_add(1 << 31)).wrapping_sub(measured.angle).to_rad();
    assert!((ahead - lost_rad).abs() < 1e-3, "{ahead}, {lost_rad} in a period");
}
