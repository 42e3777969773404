//! Identification of an unknown motor.

use core::f64::consts::TAU;

use dimsart_core::DriveFault;
use drive::{Identification, IdentificationError, IdentificationStep, MotorEstimate, Rotor, Sample};
use hil_sim::plant::ThreePhaseParameters;

use crate::bench::{Bench, PERIOD_S, configuration, motor};

const CURRENT_A: f32 = 5.0;
/// Dry friction of rotor and joint, `N m`; the current produces 0.6.
const FRICTION_NM: f64 = 0.03;

/// A free joint with dry and viscous friction.
fn free() -> ThreePhaseParameters {
    ThreePhaseParameters {
        rotor_inertia_kg_m2: 1e-4,
        viscous_nms_per_rad: 2e-3,
        coulomb_nm: FRICTION_NM,
        ..motor()
    }
}

/// Runs the identification; returns the result and the maximum phase current, `A`.
fn identify(
    bench: &mut Bench,
    change: impl Fn(Sample, u32) -> Sample,
) -> (Result<MotorEstimate, IdentificationError>, f64) {
    identify_with(bench, CURRENT_A, change)
}

fn identify_with(
    bench: &mut Bench,
    current_a: f32,
    change: impl Fn(Sample, u32) -> Sample,
) -> (Result<MotorEstimate, IdentificationError>, f64) {
    let mut identification = Identification::new(&bench.configuration, current_a).unwrap();
    let (mut duties, mut max_a) = (None, 0.0_f64);
    for period in 0..400_000 {
        let sample = change(bench.sample(), period);
        let next = match identification.step(&sample) {
            IdentificationStep::Running(next) => next,
            IdentificationStep::Finished(end) => {
                assert_eq!(
                    identification.step(&sample),
                    IdentificationStep::Finished(end),
                    "must stay finished"
                );
                return (end, max_a);
            }
        };
        bench.motor.advance(duties, PERIOD_S);
        let most = bench.configuration.inverter.max_duty - 0.5 + 1e-6;
        assert!(next.iter().all(|duty| (duty - 0.5).abs() <= most), "{next:?}");
        duties = Some(next.map(f64::from));
        max_a = bench.motor.phase_a().iter().fold(max_a, |max_a, phase_a| phase_a.abs().max(max_a));
    }
    panic!("identification does not finish")
}

fn is_near(found: f32, expected: f64, share: f64) -> bool {
    (f64::from(found) / expected - 1.0).abs() < share
}

#[test]
fn a_motor_is_found_out_with_a_current_that_is_bounded() {
    for (pole_pairs, is_reversed, direct_h, quadrature_h, resistance_ohm) in [
        (10, false, 3e-4, 3e-4, 0.3),
        (1, false, 1e-4, 1.5e-4, 0.15),
        (4, true, 1e-3, 2e-3, 1.2),
        (21, true, 3e-4, 4e-4, 0.3),
    ] {
        // Same torque constant for any number of poles.
        let flux_linkage_vs = 0.08 / f64::from(pole_pairs);
        let motor = ThreePhaseParameters {
            pole_pairs,
            direct_inductance_h: direct_h,
            quadrature_inductance_h: quadrature_h,
            resistance_ohm,
            flux_linkage_vs,
            ..free()
        };
        let mut told = configuration(&motor);
        told.motor.is_encoder_reversed = is_reversed;
        told.limits.speed_rad_per_s = 200.0;
        let mut bench = Bench::new(&motor, told);
        bench.motor = bench.motor.with_cogging(0.01, 12 * pole_pairs);
        bench.motor.set_rotor(0.7, 0.0);
        let (found, max_a) = identify(&mut bench, |sample, _| sample);
        let found = found.unwrap();
        assert!(max_a < 1.25 * f64::from(CURRENT_A), "{max_a} A");
        assert_eq!((u32::from(found.pole_pairs), found.is_encoder_reversed), (pole_pairs, is_reversed));
        assert!(is_near(found.resistance_ohm, resistance_ohm, 0.03), "{found:?}");
        assert!(is_near(found.direct_inductance_h, direct_h, 0.05), "{found:?}");
        assert!(is_near(found.quadrature_inductance_h, quadrature_h, 0.05), "{found:?}");
        let offset = f64::from(found.encoder_offset_rad - told.motor.encoder_offset_rad);
        let electrical_rad = (f64::from(pole_pairs) * offset / TAU).fract() * TAU;
        let electrical_rad = electrical_rad.sin().atan2(electrical_rad.cos());
        assert!(
            electrical_rad.abs() < 0.05,
            "{pole_pairs} pole pairs: {electrical_rad} rad of an electrical turn"
        );
    }
}

#[test]
fn what_was_found_drives_the_motor() {
    let motor = free();
    let mut bench = Bench::new(&motor, configuration(&motor));
    bench.configuration.motor.is_encoder_reversed = true;
    let (found, _) = identify(&mut bench, |sample, _| sample);
    let found = found.unwrap();
    let mut told = bench.configuration;
    told.motor.resistance_ohm = found.resistance_ohm;
    told.motor.direct_inductance_h = found.direct_inductance_h;
    told.motor.quadrature_inductance_h = found.quadrature_inductance_h;
    told.motor.pole_pairs = found.pole_pairs;
    told.motor.encoder_offset_rad = found.encoder_offset_rad;
    told.motor.is_encoder_reversed = found.is_encoder_reversed;
    bench.drive = drive::Drive::new(&told).unwrap();
    bench.motor = hil_sim::plant::BridgeMotor::new(&crate::bench::motor()).unwrap();
    bench.motor.set_rotor(0.2, 40.0);
    let found_nm = bench.mean_torque_nm(0.5, 2_000);
    assert!((found_nm / 0.5 - 1.0).abs() < 0.02, "{found_nm} N m of 0.5");
}

/// Low resistance: `L/R` is up to 10 ms, most of the voltage is dead-time error, and the back-EMF brakes the rotor more
/// than its inertia.
#[test]
fn a_motor_of_low_resistance_asks_for_the_current_that_identifies_it() {
    for (inductance_h, rotor_rad, first_a) in
        [(2e-5, 0.0, 2.0), (2e-4, 0.0, 10.0), (2e-5, 0.2, 2.0), (2e-4, 0.3, 5.0), (2e-5, 0.314, 13.0)]
    {
        let motor = ThreePhaseParameters {
            resistance_ohm: 0.02,
            direct_inductance_h: inductance_h,
            quadrature_inductance_h: inductance_h,
            ..free()
        };
        let identify = |current_a| {
            let mut bench = Bench::new(&motor, configuration(&motor));
            bench.motor.set_rotor(rotor_rad, 0.0);
            let (found, max_a) = identify_with(&mut bench, current_a, |sample, _| sample);
            assert!(max_a < 1.3 * f64::from(current_a), "{max_a} A of {current_a}");
            found
        };
        let (mut current_a, mut requests) = (first_a, 1);
        let found = loop {
            match identify(current_a) {
                Err(IdentificationError::TooLittleCurrent { needed_a }) => {
                    assert!(needed_a > 1.4 * current_a, "{needed_a} A after {current_a}");
                    (current_a, requests) = (needed_a, requests + 1);
                }
                found => break found.unwrap(),
            }
        };
        assert!(requests <= 5, "{requests} requests from {first_a} A on");
        assert!(is_near(found.resistance_ohm, 0.02, 0.02), "{found:?}");
        assert!(is_near(found.direct_inductance_h, inductance_h, 0.05), "{found:?}");
        assert!(is_near(found.quadrature_inductance_h, inductance_h, 0.05), "{found:?}");
        assert_eq!(u32::from(found.pole_pairs), motor.pole_pairs);
    }
}

/// Below 0.2 A the dead-time error is proportional to the current, like a resistance; the other two phases carry half
/// of it.
#[test]
fn a_current_that_dead_time_distorts_is_too_little() {
    let told = configuration(&motor());
    let needed_a = 4.5 * told.inverter.dead_time_current_a;
    let expected = Err(IdentificationError::TooLittleCurrent { needed_a });
    let (found, max_a) = identify_with(&mut Bench::new(&motor(), told), 0.89, |sample, _| sample);
    assert_eq!((found, max_a.to_bits()), (expected, 0));
    let resistance_ohm = 1.2;
    let motor = ThreePhaseParameters { resistance_ohm, coulomb_nm: 0.0, ..free() };
    let (found, _) = identify_with(&mut Bench::new(&motor, told), 0.91, |sample, _| sample);
    assert!(is_near(found.unwrap().resistance_ohm, resistance_ohm, 0.02), "{found:?}");
}

#[test]
fn a_joint_that_cannot_turn_is_an_error_and_no_result() {
    let motor = motor();
    let mut bench = Bench::new(&motor, configuration(&motor));
    let (found, _) = identify(&mut bench, |sample, _| sample);
    assert_eq!(found, Err(IdentificationError::DidNotMove));
    // A load above the torque of the current on most of the travel: the rotor slips back.
    let motor = ThreePhaseParameters { coulomb_nm: 0.9, ..free() };
    let mut bench = Bench::new(&motor, configuration(&motor));
    let (found, _) = identify(&mut bench, |sample, _| sample);
    assert!(
        matches!(found, Err(IdentificationError::DidNotMove | IdentificationError::Slipped { .. })),
        "{found:?}"
    );
}

#[test]
fn what_is_wrong_with_wires_and_sensors_is_said() {
    type Change = fn(Sample, u32) -> Sample;
    let cases: [(IdentificationError, Change); 8] = [
        (IdentificationError::SupplyTooLow, |sample, _| Sample { phase_a: [0.0; 3], ..sample }),
        // V open, sensors of U and V swapped, all sensors inverted.
        (IdentificationError::PhaseMismatch, |sample, _| {
            let [u, ..] = sample.phase_a;
            Sample { phase_a: [u, 0.0, -u], ..sample }
        }),
        (IdentificationError::PhaseMismatch, |sample, _| {
            let [u, v, w] = sample.phase_a;
            Sample { phase_a: [v, u, w], ..sample }
        }),
        (IdentificationError::PhaseMismatch, |sample, _| Sample {
            phase_a: sample.phase_a.map(|phase_a| -phase_a),
            ..sample
        }),
        (IdentificationError::Fault(DriveFault::EncoderLost), |sample, period| match period {
            30_000.. => Sample { rotor: Rotor::Lost, ..sample },
            _ => sample,
        }),
        (IdentificationError::Fault(DriveFault::Undervoltage), |sample, _| Sample { bus_v: 3.0, ..sample }),
        (IdentificationError::Fault(DriveFault::Overtemperature), |sample, _| Sample {
            temperature_c: 120.0,
            ..sample
        }),
        // The supply sags below the holding voltage.
        (IdentificationError::SupplyTooLow, |sample, period| match period {
            60_000.. => Sample { bus_v: 10.5, ..sample },
            _ => sample,
        }),
    ];
    for (expected, change) in cases {
        let motor = ThreePhaseParameters { resistance_ohm: 1.2, ..free() };
        let mut bench = Bench::new(&motor, configuration(&motor));
        let (found, max_a) = identify(&mut bench, change);
        assert_eq!(found, Err(expected));
        assert!(
            max_a < 1.25 * f64::from(CURRENT_A) || expected == IdentificationError::SupplyTooLow,
            "{max_a} A"
        );
    }
    let told = configuration(&motor());
    for current_a in [0.0, -1.0, f32::NAN, 20.1] {
        assert_eq!(Identification::new(&told, current_a).unwrap_err().name, "current_a");
    }
}
