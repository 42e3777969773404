//! `dimsart identify` on the shipped arm, against what its joints have.

use std::process::Command;

use serde::Deserialize;

#[derive(Deserialize)]
struct Answer {
    estimates: Vec<Estimate>,
    truth: Vec<(String, f64)>,
}

#[derive(Deserialize)]
struct Estimate {
    quantity: String,
    /// And the half width of its interval.
    value: Option<(f64, f64)>,
}

/// The second of six, its shoulder: it carries all beyond it.
#[test]
fn a_joint_of_the_shipped_arm_is_found_within_two_percent_while_the_others_are_held() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dimsart"));
    command.args(["identify", "identify_arm", "--set", "duration_s=25.9", "--axis", "1"]);
    let output = command.args(["--no-picture", "--json"]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let Answer { estimates, truth } = serde_json::from_slice(&output.stdout).unwrap();
    let known = truth.iter().filter(|(_, truth)| truth.abs() > 1e-6);
    for (quantity, truth) in known.clone() {
        let estimate = estimates.iter().find(|estimate| estimate.quantity == *quantity).unwrap();
        let (value, _) = estimate.value.unwrap();
        assert!((value / truth - 1.0).abs() < 0.02, "{quantity}: {value} instead of {truth}");
    }
    assert_eq!(known.count(), 5);
}
