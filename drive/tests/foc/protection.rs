//! What turns the bridge off, and when.

use core::f32::consts::PI;

use drive::{Angle, Configuration, Drive, Fault, Rotor, Sample};
use proptest::prelude::*;

use crate::bench::{Bench, configuration, motor};

/// A drive that turns, with what its converters show now.
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

#[test]
fn every_fault_turns_the_bridge_off_in_the_period_in_which_it_shows_and_stays() {
    type Change = fn(&mut Sample);
    let cases: [(Fault, Change); 9] = [
        (Fault::Overcurrent, |sample| sample.phase_a[0] = 31.0),
        (Fault::Overcurrent, |sample| sample.phase_a = [-15.5, -15.5, -30.5]),
        (Fault::Overcurrent, |sample| sample.phase_a[2] = f32::NAN),
        (Fault::CurrentSensors, |sample| sample.phase_a[1] += 8.0),
        (Fault::Overvoltage, |sample| sample.bus_v = 30.5),
        (Fault::Undervoltage, |sample| sample.bus_v = 9.5),
        (Fault::Undervoltage, |sample| sample.bus_v = f32::NAN),
        (Fault::Overtemperature, |sample| sample.temperature_c = 100.0),
        (Fault::Overtemperature, |sample| sample.temperature_c = f32::NAN),
    ];
    for (fault, change) in cases {
        let (mut bench, mut sample) = turning(|_| {});
        let right = sample;
        change(&mut sample);
        assert_eq!(bench.drive.step(&sample, Some(0.3)), None, "{fault:?}");
        assert_eq!(bench.drive.fault(), Some(fault));
        // It is right again, and stays off until somebody says so.
        assert_eq!(bench.drive.step(&right, Some(0.3)), None, "{fault:?}");
        bench.drive.clear();
        assert!(bench.drive.step(&right, Some(0.3)).is_some(), "{fault:?}");
        assert_eq!(bench.drive.fault(), None);
        assert!(!fault.to_string().is_empty() && !fault.remedy().is_empty());
    }
}

#[test]
fn two_bad_readings_of_the_encoder_are_bridged_and_the_third_turns_the_bridge_off() {
    let cases: [(Fault, Wrong); 3] = [
        (Fault::EncoderLost, |_| Rotor::Lost),
        (Fault::EncoderMagnet, |_| Rotor::BadMagnet),
        (Fault::EncoderJumped, |angle| Rotor::At(angle.plus_rad(-PI / 2.0))),
    ];
    for (fault, wrong) in cases {
        let (mut bench, _) = turning(|_| {});
        for reading in 1..=3 {
            let torque_nm = step_with_encoder(&mut bench, wrong);
            assert!((torque_nm - 0.3).abs() < 0.03, "{fault:?}: {torque_nm} N m at reading {reading}");
            assert_eq!(bench.drive.fault(), (reading == 3).then_some(fault), "reading {reading}");
        }
        // One that is right between them begins the count anew.
        let (mut bench, _) = turning(|_| {});
        for reading in 0..12 {
            step_with_encoder(&mut bench, if reading % 3 == 2 { Rotor::At } else { wrong });
            assert_eq!(bench.drive.fault(), None, "{fault:?}, reading {reading}");
        }
    }
}

/// What an encoder says of an angle.
type Wrong = fn(Angle) -> Rotor;

fn step_with_encoder(bench: &mut Bench, says: Wrong) -> f64 {
    let sample = bench.sample();
    let Rotor::At(angle) = sample.rotor else { panic!("{sample:?}") };
    bench.step_with(&Sample { rotor: says(angle), ..sample }, Some(0.3))
}

#[test]
fn the_currents_of_a_short_circuit_are_off_within_two_periods() {
    let (mut bench, _) = turning(|_| {});
    // A thirtieth of the inductance, as between two windings: the loop's gain is far too high.
    let state = bench.motor.state();
    let shorted = hil_sim::plant::ThreePhaseParameters {
        direct_inductance_h: 1e-5,
        quadrature_inductance_h: 1e-5,
        resistance_ohm: 0.03,
        ..motor()
    };
    bench.motor = hil_sim::plant::BridgeMotor::new(&shorted).unwrap();
    bench.motor.set_rotor(state.angle_rad, state.speed_rad_per_s);
    let is_beyond = |bench: &Bench| bench.motor.phase_a().iter().any(|phase_a| phase_a.abs() > 30.0);
    let began = (0..1_000)
        .find(|_| {
            bench.step(Some(0.3));
            is_beyond(&bench)
        })
        .is_some();
    assert!(began, "no current beyond its limit");
    bench.step(Some(0.3));
    assert_eq!(bench.drive.fault(), Some(Fault::Overcurrent));
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
    for (share, expected_s) in [(1.0_f32, Some(0.1)), (0.5, Some(0.4)), (0.1, None)] {
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
                assert!((found_s - expected_s).abs() < 0.01 * expected_s, "{share}: {found_s}");
                assert_eq!(bench.drive.fault(), Some(Fault::Stalled));
            }
            other => panic!("{share}: {other:?}"),
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
    // While it was off the rotor's magnets had their voltage to themselves: it is met at once.
    let mut most_nm = 0.0_f64;
    for _ in 0..400 {
        most_nm = most_nm.max(bench.step(Some(0.3)).abs());
    }
    assert!(most_nm < 0.3 * 1.3, "{most_nm}");
    // What held a large current is forgotten.
    bench.run(Some(2.0), 1_000);
    bench.run(None, 40);
    let most_nm = (0..40).map(|_| bench.step(Some(0.0)).abs()).fold(0.0, f64::max);
    assert!(most_nm < 0.05, "{most_nm}");
    assert_eq!(bench.drive.step(&bench.sample(), Some(f32::NAN)), None);
    assert_eq!(bench.drive.fault(), None, "a torque that is no number is no fault of the drive");
}

#[test]
fn a_rotor_that_was_turned_while_a_fault_stood_is_found_again_at_once() {
    let (mut bench, sample) = turning(|_| {});
    assert_eq!(
        bench.step_with(&Sample { bus_v: 0.0, ..sample }, Some(0.3)).signum().to_bits(),
        1.0_f64.to_bits()
    );
    bench.motor.set_rotor(2.5, 0.0);
    bench.drive.clear();
    bench.run(Some(0.3), 200);
    assert_eq!(bench.drive.fault(), None);
    assert!((bench.motor.torque_nm() - 0.3).abs() < 0.01, "{}", bench.motor.torque_nm());
}

#[test]
fn what_no_drive_can_have_is_refused_by_name() {
    let right = configuration(&motor());
    type Change = fn(&mut Configuration);
    let cases: [(&str, Change); 8] = [
        ("motor.resistance_ohm", |told| told.motor.resistance_ohm = 0.0),
        ("motor.pole_pairs", |told| told.motor.pole_pairs = 0),
        ("limits.trip_current_a", |told| told.limits.trip_current_a = 20.0),
        ("limits.most_bus_v", |told| told.limits.most_bus_v = f32::NAN),
        ("limits.trip_c", |told| told.limits.trip_c = 80.0),
        ("bandwidth_rad_per_s", |told| told.bandwidth_rad_per_s = 7_000.0),
        ("dead_time_share", |told| told.dead_time_share = 0.3),
        ("most_duty", |told| told.most_duty = 0.5),
    ];
    for (name, change) in cases {
        let mut told = right;
        change(&mut told);
        let error = Drive::new(&told).unwrap_err();
        assert_eq!(error.name, name);
        assert!(error.to_string().starts_with(name), "{error}");
    }
}

fn any_number() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => -50.0_f32..50.0,
        1 => any::<f32>(),
        1 => Just(f32::NAN),
    ]
}

proptest! {
    #[test]
    fn whatever_converters_show_and_whoever_commands_duties_stay_within_their_range(
        samples in prop::collection::vec(
            (prop::array::uniform3(any_number()), any_number(), any_number(), any::<u32>(), 0..4_u8, any_number()),
            1..50,
        ),
    ) {
        let told = configuration(&motor());
        let mut drive = Drive::new(&told).unwrap();
        for (phase_a, bus_v, temperature_c, angle, kind, torque_nm) in samples {
            let rotor = match kind {
                0 => Rotor::Lost,
                1 => Rotor::BadMagnet,
                _ => Rotor::At(Angle(angle)),
            };
            let sample = Sample { phase_a, bus_v, temperature_c, rotor };
            let torque_nm = (kind != 3).then_some(torque_nm);
            if let Some(duties) = drive.step(&sample, torque_nm) {
                let most = told.most_duty - 0.5 + 1e-6;
                prop_assert!(duties.iter().all(|duty| (duty - 0.5).abs() <= most), "{duties:?}");
                prop_assert!(drive.fault().is_none());
            }
            if kind == 2 {
                drive.clear();
            }
        }
    }
}
