//! How much of the bus drives take.

use drive::DriveReading;
use hil_sim::plant::{DriveBus, JointParameters, MoteusParameters};

/// So many drives under torque for 200 ticks of `period_s`.
fn run(drives: u8, period_s: f64, bits: &str) -> DriveBus {
    let ids: Vec<u8> = (1..=drives).collect();
    let parameters: MoteusParameters = toml::from_str(&format!("ids = {ids:?}\n{bits}")).unwrap();
    let joints = ids.iter().map(|_| JointParameters::of_inertia(0.01).build().unwrap()).collect();
    let mut bus = parameters.build(joints, 1);
    for tick in 0..200 {
        (0..usize::from(drives)).for_each(|axis| bus.set_enabled(axis, true));
        bus.advance(f64::from(tick) * period_s, period_s, |axis| 0.1 * axis as f64, &|_, _| 0.0);
    }
    bus
}

fn load(bus: &DriveBus, period_s: f64) -> f64 {
    bus.bus().busy_ns() as f64 * 1e-9 / (200.0 * period_s)
}

fn troubles(bus: &DriveBus, drives: usize) -> usize {
    let is_in_trouble = |reading: &DriveReading| reading.fault.is_some() || reading.position_rad.is_nan();
    (0..drives).filter(|axis| bus.reading(*axis).is_some_and(is_in_trouble)).count()
}

/// 0.22 ms for each: what is asked and answered in 32 and 24 bytes.
#[test]
fn a_millisecond_has_room_for_four_drives_and_two_for_eight() {
    for (drives, period_s) in [(1, 1e-3), (4, 1e-3), (8, 2e-3)] {
        let bus = run(drives, period_s, "");
        let each_s = load(&bus, period_s) * period_s / f64::from(drives);
        assert!((2.0e-4..2.3e-4).contains(&each_s), "{drives}: {each_s}");
        assert_eq!(troubles(&bus, drives.into()), 0, "{drives}");
    }
}

#[test]
fn a_drive_that_gets_no_room_is_named() {
    for (drives, bits) in [(6, ""), (3, "bits_per_s = 250_000"), (4, "data_bits_per_s = 1_000_000")] {
        assert!(troubles(&run(drives, 1e-3, bits), drives.into()) > 0, "{drives} {bits}");
    }
}
