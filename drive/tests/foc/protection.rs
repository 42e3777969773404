//! Protection: faults that turn the bridge off, and their detection times.

use core::f32::consts::PI;

use dimsart_core::DriveFault;
use drive::{Angle, Configuration, Drive, Encoder, Rotor, Sample};
use hil_sim::plant::{BridgeMotor, ThreePhaseParameters};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;

use crate::bench::{Bench, configuration, motor};

/// A turning drive, with its present sample.
fn turning(change: impl FnOnce(&mut Configuration)) -> (Bench, Sample) {
    let motor = motor();
    let mut told = configuration(&motor);
    change(&mut told);
    let mut bench = Bench::new(&motor, told);
    bench.motor.set_rotor(0.5, 50.0);
    for _ in 0..500 {
        bench.step(Some(0.3));
        assert_eq!(bench.drive.fault(), None);
    }
    let sample = bench.sample();
    (bench, sample)
}

/// A winding that saturates to a fifth of its inductance makes the current controller unstable.
#[test]
fn a_current_loop_that_oscillates_is_a_named_fault() {
    for (share, is_unstable) in [(0.1, true), (0.2, true), (0.7, false), (1.3, false)] {
        let mut motor = motor();
        let told = configuration(&motor);
        motor.direct_inductance_h *= share;
        motor.quadrature_inductance_h *= share;
        let mut bench = Bench::new(&motor, told);
        bench.run(None, 400);
        let torque_nm = 0.3;
        let periods = (0..8_000).find(|_| {
            bench.step(Some(torque_nm));
            bench.drive.fault().is_some()
        });
        println!("{share} of the inductance: {periods:?} periods, {:?}", bench.drive.fault());
        let named = [DriveFault::CurrentLoop, DriveFault::Overcurrent].map(Some);
        assert_eq!(named.contains(&bench.drive.fault()), is_unstable, "{share}: {:?}", bench.drive.fault());
        assert!(!is_unstable || periods < Some(400), "{share}: {periods:?} periods");
    }
    // Steps of the reference by twice the current limit in each tick are not an oscillation.
    let motor = motor();
    let mut bench = Bench::new(&motor, configuration(&motor));
    bench.run(None, 400);
    for tick in 0..400 {
        bench.run(Some(if tick % 2 == 0 { 2.4 } else { -2.4 }), 20);
    }
    assert_eq!(bench.drive.fault(), None);
}

#[test]
fn every_fault_turns_the_bridge_off_in_the_period_in_which_it_shows_and_stays() {
    type Change = fn(&mut Sample);
    let cases: [(DriveFault, Change); 13] = [
        // A saturated converter with normal currents in the other phases, and with an equal opposite current in one.
        (DriveFault::CurrentSensors, |sample| sample.phase_a[0] = f32::INFINITY),
        (DriveFault::CurrentSensors, |sample| sample.phase_a[1] = f32::NEG_INFINITY),
        (DriveFault::Overcurrent, |sample| {
            sample.phase_a[..2].copy_from_slice(&[f32::INFINITY, f32::NEG_INFINITY])
        }),
        // Open wire of the sensor.
        (DriveFault::Overtemperature, |sample| sample.temperature_c = -55.0),
        (DriveFault::Overcurrent, |sample| sample.phase_a[0] = 31.0),
        (DriveFault::Overcurrent, |sample| sample.phase_a = [-15.5, -15.5, -30.5]),
        (DriveFault::Overcurrent, |sample| sample.phase_a[2] = f32::NAN),
        (DriveFault::CurrentSensors, |sample| sample.phase_a[1] += 8.0),
        (DriveFault::Overvoltage, |sample| sample.bus_v = 30.5),
        (DriveFault::Undervoltage, |sample| sample.bus_v = 9.5),
        (DriveFault::Undervoltage, |sample| sample.bus_v = f32::NAN),
        (DriveFault::Overtemperature, |sample| sample.temperature_c = 100.0),
        (DriveFault::Overtemperature, |sample| sample.temperature_c = f32::NAN),
    ];
    for (fault, change) in cases {
        let (mut bench, mut sample) = turning(|_| {});
        let right = sample;
        change(&mut sample);
        assert_eq!(bench.drive.step(&sample, Some(0.3)), None, "{fault:?}");
        assert_eq!(bench.drive.fault(), Some(fault));
        let measured = bench.drive.measured();
        assert!(
            measured.current_a.q.is_finite() && measured.torque_nm.is_finite(),
            "{fault:?}: {measured:?}"
        );
        // The cause is gone; the drive stays off until the fault is cleared.
        assert_eq!(bench.drive.step(&right, Some(0.3)), None, "{fault:?}");
        bench.drive.clear();
        let sample = bench.sample();
        assert!(bench.drive.step(&sample, Some(0.3)).is_some(), "{fault:?}");
        assert_eq!(bench.drive.fault(), None);
    }
}

#[test]
fn two_bad_readings_of_the_encoder_are_bridged_and_the_third_turns_the_bridge_off() {
    let cases: [(DriveFault, Wrong); 3] = [
        (DriveFault::EncoderLost, |_| Rotor::Lost),
        (DriveFault::EncoderMagnet, |_| Rotor::BadMagnet),
        (DriveFault::EncoderJumped, |angle| Rotor::Angle(angle.add_rad(-PI / 2.0))),
    ];
    for (fault, wrong) in cases {
        let (mut bench, _) = turning(|_| {});
        for reading in 1..=3 {
            let torque_nm = step_with_encoder(&mut bench, wrong);
            assert!((torque_nm - 0.3).abs() < 0.03, "{fault:?}: {torque_nm} N m at reading {reading}");
            assert_eq!(bench.drive.fault(), (reading == 3).then_some(fault), "reading {reading}");
        }
        // One invalid reading in three is tolerated permanently.
        let (mut bench, _) = turning(|_| {});
        for reading in 0..300 {
            step_with_encoder(&mut bench, if reading % 3 == 2 { wrong } else { Rotor::Angle });
            assert_eq!(bench.drive.fault(), None, "{fault:?}, reading {reading}");
        }
    }
}

/// Encoder readings of an angle.
type Wrong = fn(Angle) -> Rotor;

fn step_with_encoder(bench: &mut Bench, says: Wrong) -> f64 {
    let sample = bench.sample();
    let Rotor::Angle(angle) = sample.rotor else { panic!("{sample:?}") };
    bench.step_with(&Sample { rotor: says(angle), ..sample }, Some(0.3))
}

#[test]
fn the_currents_of_a_short_circuit_are_off_within_two_periods() {
    let (mut bench, _) = turning(|_| {});
    // A thirtieth of the inductance, as by a short between windings: the loop gain is far too high.
    let state = bench.motor.state();
    let shorted = ThreePhaseParameters {
        direct_inductance_h: 1e-5,
        quadrature_inductance_h: 1e-5,
        resistance_ohm: 0.03,
        ..motor()
    };
    bench.motor = BridgeMotor::new(&shorted).unwrap();
    bench.motor.set_rotor(state.angle_rad, state.speed_rad_per_s);
    let is_beyond = |bench: &Bench| bench.motor.phase_a().iter().any(|phase_a| phase_a.abs() > 30.0);
    let began = (0..1_000)
        .find(|_| {
            bench.step(Some(0.3));
            is_beyond(&bench)
        })
        .is_some();
    assert!(began, "no overcurrent");
    bench.step(Some(0.3));
    assert_eq!(bench.drive.fault(), Some(DriveFault::Overcurrent));
    bench.run(Some(0.3), 20);
    assert!(bench.motor.phase_a().iter().all(|phase_a| phase_a.abs() < 1.0), "{:?}", bench.motor.phase_a());
}

#[test]
fn heat_takes_the_torque_away_before_it_turns_the_bridge_off() {
    let (mut bench, _) = turning(|_| {});
    let constant = bench.configuration.motor.torque_constant_nm_per_a();
    for (temperature_c, expected_a) in [(79.0, 20.0), (90.0, 10.0), (99.0, 1.0)] {
        for _ in 0..400 {
            let sample = Sample { temperature_c, ..bench.sample() };
            bench.step_with(&sample, Some(100.0 * constant));
        }
        let found_a = bench.motor.torque_nm() / f64::from(constant);
        assert!((found_a - expected_a).abs() < 0.1 + 0.02 * expected_a, "{temperature_c}: {found_a} A");
        assert_eq!(bench.drive.fault(), None);
    }
}

#[test]
fn a_rotor_that_stands_still_under_all_of_its_current_is_given_up_after_its_time() {
    // At 0.7 the squared current is 0.49: 0.24 above the continuous limit instead of 0.75.
    for (share, expected_s) in [(1.0_f32, Some(0.1)), (0.7, Some(0.3125)), (0.49, None)] {
        let motor = motor();
        let mut told = configuration(&motor);
        told.limits.stall_s = 0.1;
        let mut bench = Bench::new(&motor, told);
        let torque_nm = share * told.limits.current_a * told.motor.torque_constant_nm_per_a();
        let found = (0..12_000_u16).find(|_| {
            bench.step(Some(torque_nm));
            bench.drive.fault().is_some()
        });
        let found_s = found.map(|period| f64::from(period) * crate::bench::PERIOD_S);
        match (found_s, expected_s) {
            (None, None) => {}
            (Some(found_s), Some(expected_s)) => {
                assert!((found_s - expected_s).abs() < 0.03 * expected_s + 0.003, "{share}: {found_s}");
                assert_eq!(bench.drive.fault(), Some(DriveFault::Stalled));
            }
            other => panic!("{share}: {other:?}"),
        }
    }
}

#[test]
fn a_locked_rotor_that_trembles_is_given_up_after_its_time_and_one_that_turns_slowly_is_not() {
    // Amplitude and frequency of a tremor, and the speed of a turning rotor.
    for (tremor_rad, tremor_hz, speed, expected_s) in [
        (0.02, 40.0, 0.0, Some(0.5)),
        (0.02, 5.0, 0.0, Some(0.5)),
        (0.1, 10.0, 0.0, Some(0.5)),
        (0.0, 0.0, 2.0, None),
        (0.0, 0.0, -20.0, None),
    ] {
        let motor = motor();
        let mut told = configuration(&motor);
        told.limits.stall_s = 0.5;
        let mut bench = Bench::new(&motor, told);
        let torque_nm = told.limits.current_a * told.motor.torque_constant_nm_per_a();
        let found_s =
            (0..40_000_u16).map(|period| f64::from(period) * crate::bench::PERIOD_S).find(|time_s| {
                let (sin, cos) = (core::f64::consts::TAU * tremor_hz * time_s).sin_cos();
                let trembling = core::f64::consts::TAU * tremor_hz * tremor_rad * cos;
                bench.motor.set_rotor(1.0 + tremor_rad * sin + speed * time_s, trembling + speed);
                bench.step(Some(torque_nm));
                bench.drive.fault().is_some()
            });
        let case = format!("{tremor_rad} rad at {tremor_hz} Hz, {speed} rad/s: {found_s:?}");
        match expected_s {
            Some(expected_s) => {
                assert_eq!(bench.drive.fault(), Some(DriveFault::Stalled), "{case}");
                assert!(found_s.is_some_and(|found_s| (found_s - expected_s).abs() < 0.05), "{case}");
            }
            None => assert_eq!(bench.drive.fault(), None, "{case}"),
        }
    }
}

#[test]
fn a_bridge_that_is_off_lets_the_current_go_and_begins_from_nothing() {
    let (mut bench, _) = turning(|_| {});
    for _ in 0..100 {
        bench.step(None);
    }
    assert!(bench.motor.phase_a().iter().all(|phase_a| phase_a.abs() < 0.1), "{:?}", bench.motor.phase_a());
    // While the bridge was off, the back-EMF was present: it must be compensated at once.
    let mut max_nm = 0.0_f64;
    for _ in 0..400 {
        max_nm = max_nm.max(bench.step(Some(0.3)).abs());
    }
    assert!(max_nm < 0.3 * 1.3, "{max_nm}");
    // The integrals of a large current are cleared.
    bench.run(Some(2.0), 1_000);
    bench.run(None, 40);
    let max_nm = (0..40).map(|_| bench.step(Some(0.0)).abs()).fold(0.0, f64::max);
    assert!(max_nm < 0.05, "{max_nm}");
    assert_eq!(bench.drive.step(&bench.sample(), Some(f32::NAN)), None);
    assert_eq!(bench.drive.fault(), None, "a NaN torque is not a drive fault");
}

#[test]
fn a_fault_that_is_cleared_at_speed_gives_the_torque_back_and_no_other_one() {
    // The observer tracked the rotor meanwhile; after an encoder failure it is reinitialised first.
    for encoder_fails in [false, true] {
        let (mut bench, _) = turning(|_| {});
        bench.motor.set_rotor(2.5, 120.0);
        bench.drive = Drive::new(&bench.configuration).unwrap();
        bench.run(Some(0.3), 1_000);
        for _ in 0..200 {
            let sample = bench.sample();
            let rotor = if encoder_fails { Rotor::Lost } else { sample.rotor };
            bench.step_with(&Sample { bus_v: 0.0, rotor, ..sample }, Some(0.3));
        }
        if encoder_fails {
            // The motion meanwhile is unknown.
            bench.motor.set_rotor(1.0, 120.0);
        }
        bench.drive.clear();
        let torques: Vec<f64> = (0..400).map(|_| bench.step(Some(0.3))).collect();
        let least = torques.iter().copied().fold(f64::MAX, f64::min);
        let most = torques.iter().copied().fold(f64::MIN, f64::max);
        assert!(least > -0.05 && most < 0.36, "{least} to {most} N m, encoder fails: {encoder_fails}");
        assert!((bench.motor.torque_nm() - 0.3).abs() < 0.01, "{}", bench.motor.torque_nm());
        assert_eq!(bench.drive.fault(), None);
    }
}

#[test]
fn clearing_nothing_changes_nothing() {
    let (mut bench, _) = turning(|_| {});
    for _ in 0..200 {
        bench.drive.clear();
        let torque_nm = bench.step(Some(0.3));
        assert!((torque_nm - 0.3).abs() < 0.03, "{torque_nm}");
    }
}

#[test]
fn a_drive_that_starts_with_a_wrong_reading_or_at_speed_is_off_until_it_knows_the_rotor() {
    let motor = motor();
    for speed in [-110.0, 0.0, 110.0] {
        let mut bench = Bench::new(&motor, configuration(&motor));
        bench.motor.set_rotor(0.3, speed);
        let right = bench.sample();
        let Rotor::Angle(angle) = right.rotor else { panic!("{right:?}") };
        // Wrong by half an electrical turn.
        let rotor = Rotor::Angle(angle.add_rad(PI / 10.0));
        bench.step_with(&Sample { rotor, ..right }, Some(0.6));
        let torques: Vec<f64> = (0..400).map(|_| bench.step(Some(0.6))).collect();
        assert!(torques.iter().all(|torque_nm| *torque_nm > -0.05 && *torque_nm < 0.7), "{torques:?}");
        assert!((bench.motor.torque_nm() - 0.6).abs() < 0.02, "{speed}: {}", bench.motor.torque_nm());
        assert_eq!(bench.drive.fault(), None);
    }
}

#[test]
fn a_slow_joint_starts_whatever_step_its_encoder_is_at() {
    // One encoder count per period exceeds the maximum speed of this joint.
    let motor = motor();
    let mut told = configuration(&motor);
    told.limits.speed_rad_per_s = 5.0;
    for start in 0..100_u8 {
        let mut bench = Bench::new(&motor, told);
        bench.motor.set_rotor(f64::from(start) * 1e-5, 3.0);
        bench.run(Some(0.2), 100);
        assert_eq!(bench.drive.fault(), None, "{start}");
        assert!(bench.motor.torque_nm() > 0.15, "{start}: {}", bench.motor.torque_nm());
    }
}

#[test]
fn a_rotor_that_is_driven_faster_than_can_be_held_against_turns_the_bridge_off_before_it_brakes() {
    let motor = motor();
    let mut bench = Bench::new(&motor, configuration(&motor));
    bench.motor.set_rotor(0.0, 100.0);
    let mut min_nm = 0.0_f64;
    for period in 0..8_000_u16 {
        let angle_rad = bench.motor.state().angle_rad;
        bench.motor.set_rotor(angle_rad, 100.0 + 0.01 * f64::from(period));
        min_nm = min_nm.min(bench.step(Some(0.0)));
    }
    assert_eq!(bench.drive.fault(), Some(DriveFault::Overspeed));
    assert!(min_nm > -0.1, "{min_nm} N m");
}

#[test]
fn an_encoder_that_is_lost_two_times_in_three_is_given_up() {
    let (mut bench, _) = turning(|_| {});
    let off = (0..100).find(|reading| {
        step_with_encoder(&mut bench, if reading % 3 == 0 { Rotor::Angle } else { |_| Rotor::Lost });
        bench.drive.fault().is_some()
    });
    assert!(off.is_some_and(|off| off < 20), "{off:?}");
    assert_eq!(bench.drive.fault(), Some(DriveFault::EncoderLost));
}

#[test]
fn what_no_drive_can_have_is_refused_by_name() {
    let right = configuration(&motor());
    type Change = fn(&mut Configuration);
    let cases: [(&str, Change); 13] = [
        ("motor.resistance_ohm", |told| told.motor.resistance_ohm = 0.0),
        ("motor.pole_pairs", |told| told.motor.pole_pairs = 0),
        ("limits.trip_current_a", |told| told.limits.trip_current_a = 20.0),
        ("limits.max_bus_v", |told| told.limits.max_bus_v = f32::NAN),
        ("limits.trip_c", |told| told.limits.trip_c = 80.0),
        ("aligning_current_a", |told| told.aligning_current_a = 21.0),
        ("encoder.counts_per_turn", |told| told.encoder = Encoder::Incremental { counts_per_turn: 1 }),
        ("joint.gear_ratio", |told| told.joint.gear_ratio = 0.0),
        ("joint.gear_ratio", |told| told.joint.gear_ratio = f32::NAN),
        ("joint.zero_rad", |told| told.joint.zero_rad = f32::INFINITY),
        ("bandwidth_rad_per_s", |told| told.bandwidth_rad_per_s = 7_000.0),
        ("inverter.dead_time_share", |told| told.inverter.dead_time_share = 0.3),
        ("inverter.max_duty", |told| told.inverter.max_duty = 0.5),
    ];
    for (name, change) in cases {
        let mut told = right;
        change(&mut told);
        let error = Drive::new(&told).unwrap_err();
        assert_eq!(error.name, name);
        assert!(error.to_string().starts_with(name), "{error}");
    }
}

/// Samples that are mostly valid and sometimes arbitrary.
fn nearly(right: std::ops::Range<f32>) -> impl Strategy<Value = f32> {
    prop_oneof![60 => right, 1 => any::<f32>(), 1 => Just(f32::NAN), 1 => -100.0_f32..100.0]
}

#[test]
fn whatever_converters_show_and_whoever_commands_duties_stay_within_their_range() {
    let sample = (nearly(-10.0..10.0), nearly(-10.0..10.0), nearly(20.0..26.0), nearly(20.0..70.0));
    let step = (sample, 0..40_u8, any::<u32>(), prop::option::weighted(0.95, nearly(-3.0..3.0)));
    let steps = prop::collection::vec(step, 200..400);
    let on = std::cell::Cell::new(0_u32);
    let mut runner =
        TestRunner::new(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() });
    let ran = runner.run(&steps, |steps| {
        let told = configuration(&motor());
        let mut drive = Drive::new(&told).unwrap();
        let mut angle = Angle(7);
        for ((u, v, bus_v, temperature_c), kind, jump, torque_nm) in steps {
            angle = Angle(angle.0.wrapping_add(1 << 22));
            let rotor = match kind {
                0 => Rotor::Lost,
                1 => Rotor::BadMagnet,
                2 => Rotor::Angle(Angle(jump)),
                _ => Rotor::Angle(angle),
            };
            let sample = Sample { phase_a: [u, v, -u - v], bus_v, temperature_c, rotor };
            if let Some(duties) = drive.step(&sample, torque_nm) {
                let most = told.inverter.max_duty - 0.5 + 1e-6;
                prop_assert!(duties.iter().all(|duty| (duty - 0.5).abs() <= most), "{duties:?}");
                prop_assert!(drive.fault().is_none() && torque_nm.is_some_and(f32::is_finite));
                on.set(on.get() + 1);
            }
            if kind == 3 {
                drive.clear();
            }
        }
        Ok(())
    });
    ran.unwrap();
    assert!(on.get() > 3_000, "the bridge was on in {} steps", on.get());
}

/// A motor with rotor and friction only.
fn free() -> ThreePhaseParameters {
    ThreePhaseParameters { rotor_inertia_kg_m2: 5e-4, viscous_nms_per_rad: 1e-2, ..motor() }
}

/// Errors of the configured resistance, inductances and flux.
const ERRORS: [[f32; 3]; 5] =
    [[1.0, 1.0, 1.0], [0.7, 0.7, 1.3], [0.7, 1.3, 0.7], [1.3, 0.7, 1.3], [1.3, 1.3, 0.7]];

fn told_wrongly(motor: &ThreePhaseParameters, [resistance, inductance, flux]: [f32; 3]) -> Bench {
    let mut told = configuration(motor);
    told.motor.resistance_ohm *= resistance;
    told.motor.direct_inductance_h *= inductance;
    told.motor.quadrature_inductance_h *= inductance;
    told.motor.flux_linkage_vs *= flux;
    Bench::new(motor, told)
}

#[test]
fn an_encoder_that_stands_still_while_the_rotor_turns_is_told_in_a_fiftieth_of_a_second() {
    for (speed, torque_nm) in [(35.0, 0.02), (-35.0, 0.02), (60.0, 1.0), (100.0, 0.3), (100.0, -1.0)] {
        for errors in ERRORS {
            let mut bench = told_wrongly(&free(), errors);
            bench.motor.set_rotor(0.5, speed);
            bench.run(Some(torque_nm), 200);
            assert_eq!(bench.drive.fault(), None);
            let (rotor, mut max_a) = (bench.sample().rotor, 0.0_f64);
            let found = (0..20_000_u16).find(|_| {
                let sample = Sample { rotor, ..bench.sample() };
                bench.step_with(&sample, Some(torque_nm));
                max_a =
                    bench.motor.phase_a().into_iter().fold(max_a, |max_a, phase_a| max_a.max(phase_a.abs()));
                bench.drive.fault().is_some()
            });
            let found_s = found.map(|period| f64::from(period) * crate::bench::PERIOD_S);
            let case =
                format!("{speed} rad/s, {torque_nm} N m, {errors:?}: {found_s:?} s, at most {max_a:.1} A");
            assert_eq!(bench.drive.fault(), Some(DriveFault::EncoderLost), "{case}");
            assert!(found_s.is_some_and(|found_s| found_s < 0.02), "{case}");
        }
    }
}

#[test]
fn a_sound_encoder_is_not_taken_for_lost_at_a_wall_in_steps_in_turning_back_and_in_coasting() {
    let mut random = 1_u32;
    let mut either_way = || {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        if random >> 31 == 0 { 1.0 } else { -1.0 }
    };
    // At a wall, and free; with cogging; with a dead time 50 % longer than configured.
    for (motor, cogging_nm, dead_time_share) in
        [(motor(), 0.0, 0.02), (motor(), 0.0, 0.03), (free(), 0.0, 0.02), (free(), 0.1, 0.03)]
    {
        for (errors, periods) in
            ERRORS.into_iter().flat_map(|errors| [20, 60, 400].map(|periods| (errors, periods)))
        {
            let mut bench = told_wrongly(&motor, errors);
            let real = ThreePhaseParameters { dead_time_share, ..motor.clone() };
            bench.motor = BridgeMotor::new(&real).unwrap().with_cogging(cogging_nm, 42);
            let step_nm = 18.0 * bench.configuration.motor.torque_constant_nm_per_a();
            for step in 0..20_000 / periods {
                // Coasting for half of the time.
                let torque_nm = if step % 40 < 20 { either_way() * step_nm } else { 0.0 };
                bench.run(Some(torque_nm), periods);
                let speed = bench.motor.state().speed_rad_per_s;
                assert_eq!(
                    bench.drive.fault(),
                    None,
                    "{errors:?}, {dead_time_share}, {periods}, {speed} rad/s"
                );
            }
        }
    }
}
