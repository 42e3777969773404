//! The actuated joint compared with another integrator: the same equations in scipy's DOP853 at a tolerance
//! of 1e-10.
//!
//! The reference runs are from `joint.py`. Each signal stays within 1e-5 of its peak on every tick. Voltage
//! saturation and contact of teeth or a stop are discontinuities within a step of either integrator, with
//! errors up to 5e-6; smooth motion agrees to 1e-9.

use hil_sim::plant::{JointParameters, JointState};
use serde::Deserialize;

use crate::evidence::{self, Compared, Evidence};

/// Maximum deviation relative to a signal's peak.
const TOLERANCE: f64 = 1e-5;

/// The reference runs listed in `joint.json`.
#[derive(Deserialize)]
struct Reference {
    tick_s: f64,
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    name: String,
    file: String,
    /// Parameters in TOML.
    joint: String,
    /// Amplitude of the external force's cosine.
    load: f64,
    load_hz: f64,
}

/// A column of the reference and the corresponding signal.
type Column = (&'static str, fn(&JointState) -> f64);

const COMPARED: [Column; 7] = [
    ("position", |state| state.position),
    ("velocity", |state| state.velocity),
    ("motor_position", |state| state.motor_position),
    ("motor_velocity", |state| state.motor_velocity),
    ("force", |state| state.force),
    ("current_a", |state| state.current_a),
    ("winding_c", |state| state.winding_c),
];

/// Runs the case; returns each of [`COMPARED`] over the ticks.
fn run(case: &Case, tick_s: f64, rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut joint = toml::from_str::<JointParameters>(&case.joint).unwrap().build().unwrap();
    let load = |t: f64| case.load * libm::cos(core::f64::consts::TAU * case.load_hz * t);
    let ticks = (0_u32..).zip(rows).map(|(tick, row)| {
        joint.advance(f64::from(tick) * tick_s, tick_s, row[0], &load);
        COMPARED.map(|(_, seen)| seen(&joint.state())).to_vec()
    });
    ticks.collect()
}

#[test]
fn the_joint_agrees_with_scipy() {
    let Some(folder) = test_requirements::reference_runs("scipy") else { return };
    let reference: Reference = evidence::read(&folder.join("joint.json"));
    let mut evidence = Evidence::new("joint");
    for case in &reference.cases {
        let table = evidence::table(&folder.join(&case.file));
        let found = run(case, reference.tick_s, &table.1);
        assert!(table.0.iter().skip(1).eq(COMPARED.map(|(name, _)| name).iter()));
        let case = Compared::with_scipy("joint", &case.name, TOLERANCE, reference.tick_s);
        evidence.judge_columns(&case, &table, &found);
    }
    evidence.end();
}
