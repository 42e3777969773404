//! The arm compared with another simulator: the same links in `MuJoCo`.
//!
//! The reference runs are from `arm.py`. Each position and velocity stays within 1e-11 of its peak on every
//! tick of 1.5 s; the rest is the step error of both integrators, which grows in free motion. Without
//! integration, mass matrix, bias, tip and Jacobian agree within 1e-13 of their largest entry.

use hil_sim::plant::{Arm, ArmParameters};
use serde::Deserialize;

use crate::evidence::{self, Compared, Evidence};

/// Maximum deviation relative to a signal's peak.
const TOLERANCE: f64 = 1e-11;

/// Maximum deviation of the equations of motion relative to the largest entry.
const INSTANT_TOLERANCE: f64 = 1e-13;

/// The reference runs listed in `arm.json`.
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

/// Runs the case; returns each axis' position, then each axis' velocity, over the ticks.
fn run(arm: &mut Arm, tick_s: f64, rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let axes = arm.axes();
    let ticks = (0_u32..).zip(rows).map(|(tick, row)| {
        #[expect(clippy::cast_possible_truncation, reason = "the reference holds single-precision commands")]
        let command: Vec<f32> = row[..axes].iter().map(|command| *command as f32).collect();
        arm.advance(f64::from(tick) * tick_s, tick_s, &command, &|_, _| 0.0);
        let positions = (0..axes).map(|axis| arm.axis(axis).position);
        positions.chain((0..axes).map(|axis| arm.axis(axis).velocity)).collect()
    });
    ticks.collect()
}

/// Returns the expected and actual equations of motion at every sample.
fn look(arm: &Arm, samples: &[Sample]) -> [(&'static str, Vec<f64>, Vec<f64>); 5] {
    let of = |expected: fn(&Sample) -> Vec<f64>, found: &dyn Fn(&Sample) -> Vec<f64>| {
        (samples.iter().flat_map(expected).collect(), samples.iter().flat_map(found).collect())
    };
    let mass = |sample: &Sample| {
        let (matrix, axes) = (arm.mass_matrix(&sample.position), sample.mass.len());
        (0..axes * axes).map(|place| matrix[(place / axes, place % axes)]).collect()
    };
    [
        ("mass", of(|sample| sample.mass.concat(), &mass)),
        (
            "bias",
            of(|sample| sample.bias.clone(), &|at| {
                arm.bias(&at.position, &at.velocity)[..at.bias.len()].to_vec()
            }),
        ),
        (
            "gravity",
            of(|sample| sample.gravity.clone(), &|at| {
                arm.gravity_torques(&at.position)[..at.gravity.len()].to_vec()
            }),
        ),
        ("tip", of(|sample| sample.tip.clone(), &|at| arm.forward_kinematics(&at.position).to_vec())),
        (
            "jacobian",
            of(|sample| sample.jacobian.concat(), &|at| {
                let rows = arm.tip_jacobian(&at.position).into_iter().zip(&at.jacobian);
                rows.flat_map(|(found, expected)| found.into_iter().take(expected.len())).collect()
            }),
        ),
    ]
    .map(|(name, (expected, found))| (name, expected, found))
}

#[test]
fn the_arm_agrees_with_mujoco() {
    let Some(folder) = test_requirements::reference_runs("MuJoCo") else { return };
    let reference: Reference = evidence::read(&folder.join("arm.json"));
    let mut evidence = Evidence::new("arm");
    for case in &reference.cases {
        let name = |name: &str| format!("{}, {name}", case.name);
        let compared =
            |tolerance| Compared { subject: "arm", oracle: "MuJoCo", tolerance, ..Compared::default() };
        let mut arm = toml::from_str::<ArmParameters>(&case.arm).unwrap().build().unwrap();
        for (quantity, expected, found) in look(&arm, &case.samples) {
            let (expected, found) = (expected.as_slice(), found.as_slice());
            evidence.judge(&Compared {
                name: name(quantity),
                expected,
                found,
                ..compared(INSTANT_TOLERANCE)
            });
        }
        let table = evidence::table(&folder.join(&case.file));
        let found = run(&mut arm, reference.tick_s, &table.1);
        assert_eq!(table.0.len(), arm.axes() + found[0].len());
        let run =
            Compared { name: case.name.clone(), period_s: Some(reference.tick_s), ..compared(TOLERANCE) };
        evidence.judge_columns(&run, &table, &found);
    }
    evidence.end();
}
