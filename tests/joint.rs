//! The actuated joint against an outside integrator: the same equations in scipy's DOP853 at a tolerance of 1e-10.
//!
//! `cargo xtask test` makes the reference runs (`tests/oracle/joint.py`) and says in `DIMSART_ORACLE` where they are.
//! Each signal stays within 1e-5 of its peak on every tick. Where the voltage reaches its limit, or teeth or a stop touch,
//! a rate changes at once within a step of either integrator: that leaves up to 5e-6, smooth motion 1e-9.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

use std::io::Write;
use std::path::Path;

use hil_sim::plant::{JointParameters, JointState};
use serde::Deserialize;

/// Share of a signal's peak that it may be off by.
const TOLERANCE: f64 = 1e-5;

/// The reference runs, as `joint.json` lists them.
#[derive(Deserialize)]
struct Reference {
    tick_s: f64,
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    name: String,
    file: String,
    /// Its parameters, in TOML.
    joint: String,
    /// Amplitude of the outside force's cosine.
    load: f64,
    load_hz: f64,
}

/// A column of the reference, and where the simulator has it.
type Compared = (&'static str, fn(&JointState) -> f64);

const COMPARED: [Compared; 7] = [
    ("position", |state| state.position),
    ("velocity", |state| state.velocity),
    ("motor_position", |state| state.motor_position),
    ("motor_velocity", |state| state.motor_velocity),
    ("force", |state| state.force),
    ("current_a", |state| state.current_a),
    ("winding_c", |state| state.winding_c),
];

/// Runs the case and gives for each of [`COMPARED`] the largest difference and the peak.
fn run(case: &Case, tick_s: f64, rows: &[Vec<f64>]) -> Vec<(f64, f64)> {
    let mut joint = toml::from_str::<JointParameters>(&case.joint).unwrap().build().unwrap();
    let load = |t: f64| case.load * libm::cos(core::f64::consts::TAU * case.load_hz * t);
    let mut results = vec![(0.0_f64, 0.0_f64); COMPARED.len()];
    for (tick, row) in (0_u32..).zip(rows) {
        joint.advance(f64::from(tick) * tick_s, tick_s, row[0], &load);
        let state = joint.state();
        for (((_, seen), expected), (difference, peak)) in COMPARED.iter().zip(&row[1..]).zip(&mut results) {
            let off = (seen(&state) - expected).abs();
            *difference = if off.is_nan() { off } else { difference.max(off) };
            *peak = peak.max(expected.abs());
        }
    }
    results
}

#[test]
fn the_joint_agrees_with_scipy() {
    let Some(folder) = std::env::var_os("DIMSART_ORACLE") else {
        // Past the capture of a passing test's output: that nothing was compared is to be seen.
        let line = "not compared with scipy: DIMSART_ORACLE is not set; run `cargo xtask test`";
        writeln!(std::io::stderr(), "{line}").unwrap();
        return;
    };
    let folder = Path::new(&folder);
    let list = folder.join("joint.json");
    let text = std::fs::read_to_string(&list).unwrap_or_else(|error| {
        panic!("{}: {error}; make the reference runs with `cargo xtask test`", list.display())
    });
    let reference: Reference = serde_json::from_str(&text).unwrap();
    assert!(!reference.cases.is_empty());
    let mut disagreements = Vec::new();
    for case in &reference.cases {
        println!("{} (largest difference, as a share of the peak)", case.name);
        let mut reader = csv::Reader::from_path(folder.join(&case.file)).unwrap();
        assert!(reader.headers().unwrap().iter().skip(1).eq(COMPARED.map(|(name, _)| name)));
        let rows: Vec<Vec<f64>> = reader.deserialize().map(Result::unwrap).collect();
        for ((name, _), (difference, peak)) in COMPARED.iter().zip(run(case, reference.tick_s, &rows)) {
            let share = difference / peak;
            println!("  {name:15} {difference:.1e} of {peak:.1e}: {share:.1e}");
            if share.is_nan() || share > TOLERANCE {
                disagreements.push(format!("{} {name}: {share:.1e} of the peak", case.name));
            }
        }
    }
    assert!(disagreements.is_empty(), "{disagreements:#?}");
}
