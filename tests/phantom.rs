//! The PHANToM against an outside integrator: its five bodies, put in space one by one, in scipy's DOP853 at a tolerance
//! of 1e-11, where the simulator has the published equations of motion.
//!
//! `cargo xtask test` makes the reference runs (`tests/oracle/phantom.py`) and says in `DIMSART_ORACLE` where they are.
//! Each signal stays within 1e-9 of its peak on every tick. The reference finds its slopes by differences: that is what
//! is left.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

use std::io::Write;
use std::path::Path;

use hil_sim::plant::{Phantom, PhantomParameters, Tip};
use serde::Deserialize;

/// Share of a signal's peak that it may be off by.
const TOLERANCE: f64 = 1e-9;

/// The reference runs, as `phantom.json` lists them.
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
    phantom: String,
    /// Of a hand that holds the tip where it starts.
    hand_stiffness_n_per_m: f64,
    hand_damping_ns_per_m: f64,
}

/// Positions, velocities and tip after a tick.
fn seen(phantom: &Phantom) -> [f64; 9] {
    let [one, two, three] = [0, 1, 2].map(|axis| phantom.axis(axis));
    let [x, y, z] = phantom.tip(0.0).position_m;
    let positions = [one.position, two.position, three.position];
    let velocities = [one.velocity, two.velocity, three.velocity];
    [positions, velocities, [x, y, z]].concat().try_into().unwrap()
}

/// Runs the case and gives for each signal the largest difference and the peak.
fn run(case: &Case, tick_s: f64, rows: &[Vec<f64>]) -> Vec<(f64, f64)> {
    let mut phantom = toml::from_str::<PhantomParameters>(&case.phantom).unwrap().build().unwrap();
    let anchor = phantom.tip(0.0).position_m;
    let hand = |tip: &Tip| {
        [0, 1, 2].map(|direction| {
            case.hand_stiffness_n_per_m * (anchor[direction] - tip.position_m[direction])
                - case.hand_damping_ns_per_m * tip.velocity_m_per_s[direction]
        })
    };
    let mut results = vec![(0.0_f64, 0.0_f64); 9];
    for (tick, row) in (0_u32..).zip(rows) {
        #[expect(clippy::cast_possible_truncation, reason = "the reference holds single-precision commands")]
        let command = [row[0] as f32, row[1] as f32, row[2] as f32];
        phantom.advance(f64::from(tick) * tick_s, tick_s, &command, &hand);
        for ((seen, expected), (difference, peak)) in seen(&phantom).iter().zip(&row[3..]).zip(&mut results) {
            let off = (seen - expected).abs();
            *difference = if off.is_nan() { off } else { difference.max(off) };
            *peak = peak.max(expected.abs());
        }
    }
    results
}

#[test]
fn the_phantom_agrees_with_scipy() {
    let Some(folder) = std::env::var_os("DIMSART_ORACLE") else {
        // Past the capture of a passing test's output: that nothing was compared is to be seen.
        let line = "not compared with scipy: DIMSART_ORACLE is not set; run `cargo xtask test`";
        writeln!(std::io::stderr(), "{line}").unwrap();
        return;
    };
    let folder = Path::new(&folder);
    let list = folder.join("phantom.json");
    let text = std::fs::read_to_string(&list).unwrap_or_else(|error| {
        panic!("{}: {error}; make the reference runs with `cargo xtask test`", list.display())
    });
    let reference: Reference = serde_json::from_str(&text).unwrap();
    assert!(!reference.cases.is_empty());
    let mut disagreements = Vec::new();
    for case in &reference.cases {
        println!("{} (largest difference, as a share of the peak)", case.name);
        let mut reader = csv::Reader::from_path(folder.join(&case.file)).unwrap();
        let headers = reader.headers().unwrap().clone();
        let rows: Vec<Vec<f64>> = reader.deserialize().map(Result::unwrap).collect();
        let results = run(case, reference.tick_s, &rows);
        assert_eq!(headers.len(), 3 + results.len());
        for (name, (difference, peak)) in headers.iter().skip(3).zip(results) {
            let share = difference / peak;
            println!("  {name:12} {difference:.1e} of {peak:.1e}: {share:.1e}");
            if share.is_nan() || share > TOLERANCE {
                disagreements.push(format!("{} {name}: {share:.1e} of the peak", case.name));
            }
        }
    }
    assert!(disagreements.is_empty(), "{disagreements:#?}");
}
