//! The arm against an outside simulator: the same links in ``MuJoCo``.
//!
//! `cargo xtask test` makes the reference runs (`tests/oracle/arm.py`) and says in `DIMSART_ORACLE` where they are.
//! Each position and velocity stays within 1e-11 of its peak on every tick of 1.5 s: what is left are the steps of both
//! integrators, which an arm that swings freely spreads. At one instant there is nothing to integrate: mass matrix, bias,
//! tip and Jacobian agree within 1e-13 of their largest entry.
#![expect(clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

use std::io::Write;
use std::path::Path;

use hil_sim::plant::{Arm, ArmParameters};
use serde::Deserialize;

/// Share of a signal's peak that a run may be off by.
const TOLERANCE: f64 = 1e-11;

/// Share of the largest entry that the equations of motion may be off by.
const INSTANT_TOLERANCE: f64 = 1e-13;

/// The reference runs, as `arm.json` lists them.
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
    arm: String,
    samples: Vec<Sample>,
}

/// The equations of motion at one position and velocity.
#[derive(Deserialize)]
struct Sample {
    position: Vec<f64>,
    velocity: Vec<f64>,
    mass: Vec<Vec<f64>>,
    bias: Vec<f64>,
    gravity: Vec<f64>,
    tip: Vec<f64>,
    jacobian: Vec<Vec<f64>>,
}

/// The largest difference and the largest value of one quantity.
#[derive(Default, Clone, Copy)]
struct Compared {
    difference: f64,
    peak: f64,
}

impl Compared {
    fn see(&mut self, seen: f64, expected: f64) {
        let off = (seen - expected).abs();
        self.difference = if off.is_nan() { off } else { self.difference.max(off) };
        self.peak = self.peak.max(expected.abs());
    }

    fn see_all(&mut self, seen: &[f64], expected: &[f64]) {
        for (seen, expected) in seen.iter().zip(expected) {
            self.see(*seen, *expected);
        }
    }

    /// Prints it; says what is wrong if it is.
    fn judge(&self, name: &str, tolerance: f64) -> Option<String> {
        let share = self.difference / self.peak;
        println!("  {name:12} {:.1e} of {:.1e}: {share:.1e}", self.difference, self.peak);
        (share.is_nan() || share > tolerance).then(|| format!("{name}: {share:.1e} of the peak"))
    }
}

/// Runs the case; each axis' position, then each axis' velocity.
fn run(arm: &mut Arm, tick_s: f64, rows: &[Vec<f64>]) -> Vec<Compared> {
    let axes = arm.axes();
    let mut compared = vec![Compared::default(); 2 * axes];
    for (tick, row) in (0_u32..).zip(rows) {
        #[expect(clippy::cast_possible_truncation, reason = "the reference holds single-precision commands")]
        let command: Vec<f32> = row[..axes].iter().map(|command| *command as f32).collect();
        arm.advance(f64::from(tick) * tick_s, tick_s, &command, &|_, _| 0.0);
        for axis in 0..axes {
            let state = arm.axis(axis);
            compared[axis].see(state.position, row[axes + axis]);
            compared[axes + axis].see(state.velocity, row[2 * axes + axis]);
        }
    }
    compared
}

/// The equations of motion at every sample.
fn look(arm: &Arm, samples: &[Sample]) -> [(&'static str, Compared); 5] {
    let mut compared = ["mass", "bias", "gravity", "tip", "jacobian"].map(|name| (name, Compared::default()));
    for sample in samples {
        let [mass, bias, gravity, tip, jacobian] = &mut compared;
        let matrix = arm.mass_matrix(&sample.position);
        for (row, values) in sample.mass.iter().enumerate() {
            for (column, expected) in values.iter().enumerate() {
                mass.1.see(matrix.at(row, column), *expected);
            }
        }
        bias.1.see_all(&arm.bias(&sample.position, &sample.velocity), &sample.bias);
        gravity.1.see_all(&arm.gravity_torques(&sample.position), &sample.gravity);
        tip.1.see_all(&arm.forward_kinematics(&sample.position), &sample.tip);
        for (seen, expected) in arm.tip_jacobian(&sample.position).iter().zip(&sample.jacobian) {
            jacobian.1.see_all(seen, expected);
        }
    }
    compared
}

#[test]
fn the_arm_agrees_with_mujoco() {
    let Some(folder) = std::env::var_os("DIMSART_ORACLE") else {
        // Past the capture of a passing test's output: that nothing was compared is to be seen.
        let line = "not compared with MuJoCo: DIMSART_ORACLE is not set; run `cargo xtask test`";
        writeln!(std::io::stderr(), "{line}").unwrap();
        return;
    };
    let folder = Path::new(&folder);
    let list = folder.join("arm.json");
    let text = std::fs::read_to_string(&list).unwrap_or_else(|error| {
        panic!("{}: {error}; make the reference runs with `cargo xtask test`", list.display())
    });
    let reference: Reference = serde_json::from_str(&text).unwrap();
    assert!(!reference.cases.is_empty());
    let mut disagreements = Vec::new();
    for case in &reference.cases {
        println!("{} (largest difference, as a share of the peak)", case.name);
        let mut arm = toml::from_str::<ArmParameters>(&case.arm).unwrap().build().unwrap();
        assert!(!case.samples.is_empty());
        let instants = look(&arm, &case.samples);
        disagreements.extend(instants.iter().filter_map(|(name, one)| one.judge(name, INSTANT_TOLERANCE)));
        let mut reader = csv::Reader::from_path(folder.join(&case.file)).unwrap();
        let headers = reader.headers().unwrap().clone();
        let rows: Vec<Vec<f64>> = reader.deserialize().map(Result::unwrap).collect();
        let results = run(&mut arm, reference.tick_s, &rows);
        assert_eq!(headers.len(), arm.axes() + results.len());
        for (name, one) in headers.iter().skip(arm.axes()).zip(&results) {
            disagreements.extend(one.judge(name, TOLERANCE));
        }
    }
    assert!(disagreements.is_empty(), "{disagreements:#?}");
}
