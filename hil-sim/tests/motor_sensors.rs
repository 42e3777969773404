//! Readings of a motor's sensors against the closed forms of a joint that holds a load.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use std::path::PathBuf;

use hil_sim::experiment;
use hil_sim::rig_file::RigFile;

const RATIO: f64 = 10.0;
const TORQUE_CONSTANT_NM_PER_A: f64 = 0.05;
const RESISTANCE_OHM: f64 = 0.8;
const LOAD_NM: f64 = 2.0;
const AMBIENT_C: f64 = 25.0;

fn rig(more: &str) -> String {
    format!(
        r#"
        duration_s = 2.0
        [[device]]
        name = "joint"
        measures = ["POSITION", "DES_POSITION", "MOTOR_CURRENT", "MOTOR_VOLTAGE", "WINDING_TEMPERATURE"]
        [[device.axis]]
        plant.load.inertia = 0.05
        plant.gear.ratio = {RATIO}
        {more}
        [[controller]]
        device = "joint"
        scheme = "builtin:joint"
        [experiment]
        margins = false
        [[experiment.move]]
        device = "joint"
        on = "DES_POSITION"
        step = {{ at_s = 0.0, amplitude = 0.0 }}
        [[experiment.move]]
        device = "joint"
        on = "load"
        step = {{ at_s = 0.2, amplitude = -{LOAD_NM} }}
        [record]
        signals = ["joint.MOTOR_CURRENT", "joint.MOTOR_VOLTAGE", "joint.WINDING_TEMPERATURE"]
        "#
    )
}

fn motor() -> String {
    format!(
        "plant.motor = {{ kind = \"brushed\", resistance_ohm = {RESISTANCE_OHM}, torque_constant_nm_per_a = \
         {TORQUE_CONSTANT_NM_PER_A}, coulomb_nm = 0.0, viscous_nms_per_rad = 0.0, thermal = {{ \
         resistance_k_per_w = 4.0, \
         capacity_j_per_k = 50.0, ambient_c = {AMBIENT_C}, coefficient_per_k = 0.0 }} }}\n"
    )
}

/// The last row of the recorded signals.
fn last(text: &str) -> Vec<f64> {
    let run = experiment::run(&RigFile::read(text, "test", PathBuf::new(), &[]).unwrap()).unwrap();
    assert!(run.outcome.stable, "{:?}", run.outcome.faults);
    run.recording.rows().last().unwrap().to_vec()
}

#[test]
fn a_joint_that_holds_a_load_shows_the_current_the_voltage_and_the_heat_of_it() {
    let [current_a, voltage_v, winding_c] = last(&rig(&motor())).try_into().unwrap();
    let held_a = LOAD_NM / (RATIO * TORQUE_CONSTANT_NM_PER_A);
    assert!((current_a - held_a).abs() < 1e-3 * held_a, "{current_a} A instead of {held_a} A");
    assert!((voltage_v - RESISTANCE_OHM * held_a).abs() < 1e-2 * RESISTANCE_OHM * held_a, "{voltage_v} V");
    // Nearly all of the heat is still in the winding: R i² over 1.8 s into 50 J/K.
    let risen_k = RESISTANCE_OHM * held_a * held_a * 1.8 / 50.0;
    assert!(
        (winding_c - AMBIENT_C - risen_k).abs() < 0.1 * risen_k,
        "{winding_c} °C instead of {risen_k} K more"
    );
}

#[test]
fn a_current_sensor_has_its_gain_and_offset() {
    let sensor = "sensor.MOTOR_CURRENT = { gain = 1.1, offset = -0.3 }\n";
    let [shown_a, ..] = last(&rig(&(motor() + sensor)))[..] else { unreachable!("three signals") };
    let held_a = LOAD_NM / (RATIO * TORQUE_CONSTANT_NM_PER_A);
    assert!((shown_a - (1.1 * held_a - 0.3)).abs() < 2e-3 * held_a, "{shown_a} A");
}

#[test]
fn a_joint_without_a_motor_has_no_current_to_measure() {
    let error = RigFile::read(&rig(""), "test", PathBuf::new(), &[]).unwrap_err().to_string();
    assert!(error.contains("without a motor: set plant.motor.kind"), "{error}");
}
