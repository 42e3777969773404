//! The PHANToM compared with another integrator: its five bodies, placed one by one, in scipy's DOP853 at a
//! tolerance of 1e-11; the simulator uses the published equations of motion.
//!
//! The reference runs are from `phantom.py`. Each signal stays within 1e-9 of its peak on every tick; the
//! rest is due to the reference's numerical derivatives.

use hil_sim::plant::{Phantom, PhantomParameters, Tip};
use serde::Deserialize;

use crate::evidence::{self, Compared, Evidence};

/// Maximum deviation relative to a signal's peak.
const TOLERANCE: f64 = 1e-9;

/// The reference runs listed in `phantom.json`.
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
    phantom: String,
    /// Stiffness of a hand that holds the tip at the start.
    hand_stiffness_n_per_m: f64,
    hand_damping_n_s_per_m: f64,
}

/// Returns positions, velocities and tip after a tick.
fn seen(phantom: &Phantom) -> [f64; 9] {
    let [one, two, three] = [0, 1, 2].map(|axis| phantom.axis(axis));
    let [x, y, z] = phantom.tip(0.0).position_m;
    let positions = [one.position, two.position, three.position];
    let velocities = [one.velocity, two.velocity, three.velocity];
    [positions, velocities, [x, y, z]].concat().try_into().unwrap()
}

/// Runs the case; returns each signal over the ticks.
fn run(case: &Case, tick_s: f64, rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut phantom = toml::from_str::<PhantomParameters>(&case.phantom).unwrap().build().unwrap();
    let anchor = phantom.tip(0.0).position_m;
    let hand = |tip: &Tip| {
        [0, 1, 2].map(|direction| {
            case.hand_stiffness_n_per_m * (anchor[direction] - tip.position_m[direction])
                - case.hand_damping_n_s_per_m * tip.velocity_m_per_s[direction]
        })
    };
    let ticks = (0_u32..).zip(rows).map(|(tick, row)| {
        #[expect(clippy::cast_possible_truncation, reason = "the reference holds single-precision commands")]
        let command = [row[0] as f32, row[1] as f32, row[2] as f32];
        phantom.advance(f64::from(tick) * tick_s, tick_s, &command, &hand);
        seen(&phantom).to_vec()
    });
    ticks.collect()
}

#[test]
fn the_phantom_agrees_with_scipy() {
    let Some(folder) = test_requirements::reference_runs("scipy") else { return };
    let reference: Reference = evidence::read(&folder.join("phantom.json"));
    let mut evidence = Evidence::new("phantom");
    for case in &reference.cases {
        let table = evidence::table(&folder.join(&case.file));
        let found = run(case, reference.tick_s, &table.1);
        assert_eq!(table.0.len(), 3 + found[0].len());
        let case = Compared::with_scipy("PHANToM", &case.name, TOLERANCE, reference.tick_s);
        evidence.judge_columns(&case, &table, &found);
    }
    evidence.end();
}
