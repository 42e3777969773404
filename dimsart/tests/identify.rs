//! `dimsart identify` on the shipped arm, compared with its true parameters, and on files with other units or faults.

#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use std::f64::consts::TAU;
use std::fmt::Write;
use std::process::{Command, Output};

use serde::Deserialize;

#[derive(Deserialize)]
struct Answer {
    estimates: Vec<Estimate>,
    truth: Option<Vec<(String, f64)>>,
}

#[derive(Deserialize)]
struct Estimate {
    quantity: String,
    /// And the half width of its interval.
    value: Option<(f64, f64)>,
}

/// The second of six joints, its shoulder: it carries all further links.
#[test]
fn a_joint_of_the_shipped_arm_is_found_within_two_percent_while_the_others_are_held() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dimsart"));
    command.args(["identify", "identify_arm", "--set", "duration_s=25.9", "--axis", "1"]);
    let output = command.args(["--no-picture", "--json"]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let Answer { estimates, truth } = serde_json::from_slice(&output.stdout).unwrap();
    let truth = truth.unwrap();
    let known = truth.iter().filter(|(_, truth)| truth.abs() > 1e-6);
    for (quantity, truth) in known.clone() {
        let estimate = estimates.iter().find(|estimate| estimate.quantity == *quantity).unwrap();
        let (value, _) = estimate.value.unwrap();
        assert!((value / truth - 1.0).abs() < 0.02, "{quantity}: {value} instead of {truth}");
    }
    assert_eq!(known.count(), 5);
}

/// Twenty seconds of rows, as text.
fn rows(mut value: impl FnMut(u32, f64) -> [String; 3]) -> String {
    (0..20_000).fold(String::new(), |mut text, tick| {
        let time_s = 1e-3 * f64::from(tick);
        let _ = writeln!(text, "{}", value(tick, time_s).join(","));
        text
    })
}

/// Position and force of a joint of 0.2 kg m² with friction during a sweep.
fn joint(time_s: f64) -> [f64; 2] {
    let rate = TAU * (0.1 + 0.14 * time_s);
    let (sine, cosine) = (TAU * (0.1 * time_s + 0.07 * time_s * time_s)).sin_cos();
    let (speed, rises) = (0.8 * rate * cosine, 0.8 * (TAU * 0.14 * cosine - rate * rate * sine));
    [0.8 * sine, 0.2 * rises + 3.1 * speed + 2.44 * speed.signum()]
}

fn identify(text: &str) -> Output {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("log.csv");
    std::fs::write(&file, text).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_dimsart"));
    command.arg("identify").arg(file).args(["--no-picture", "--json"]).output().unwrap()
}

#[test]
fn the_units_of_a_header_are_those_of_its_column() {
    let plain = rows(|_, time_s| {
        let [position, force] = joint(time_s);
        [time_s, position, force].map(|value| value.to_string())
    });
    let scaled = rows(|tick, time_s| {
        let [position, force] = joint(time_s);
        [tick.to_string(), position.to_degrees().to_string(), (1e3 * force).to_string()]
    });
    for text in [
        format!("time_s (s),arm.POSITION[0] (rad),arm.FORCE[0] (N·m)\n{plain}"),
        format!("time_ms,arm.POSITION[0] (deg),arm.FORCE[0] (mN·m)\n{scaled}"),
    ] {
        let output = identify(&text);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let Answer { estimates, .. } = serde_json::from_slice(&output.stdout).unwrap();
        for (quantity, truth) in [("inertia", 0.2), ("viscous", 3.1), ("coulomb", 2.44)] {
            let estimate = estimates.iter().find(|estimate| estimate.quantity == quantity).unwrap();
            let (value, _) = estimate.value.unwrap();
            assert!((value / truth - 1.0).abs() < 1e-3, "{quantity}: {value} instead of {truth}");
        }
    }
}

#[test]
fn a_file_that_cannot_be_used_is_refused_with_the_row_and_what_to_do() {
    let head = "time (s),arm.POSITION[0] (rad),arm.FORCE[0] (N·m)";
    let with = |at: u32, time_s: &dyn Fn(f64) -> f64, position: &str| {
        rows(|tick, now_s| {
            let [found, force] = joint(now_s);
            let position = if tick == at { position.to_owned() } else { found.to_string() };
            [time_s(now_s).to_string(), position, force.to_string()]
        })
    };
    let even = |time_s: f64| time_s;
    for (text, parts) in [
        (format!("{head}\n{}", with(0, &even, "nan")), ["'nan' is not a finite number", "row 2, "]),
        (format!("{head}\n{}", with(77, &even, "")), ["'' is not a finite number", "row 79, "]),
        // A row is missing.
        (
            format!("{head}\n{}", with(0, &|time_s| if time_s < 5.0 { time_s } else { time_s + 1e-3 }, "0")),
            ["row 5002 is 2.0000 ms after", "resample"],
        ),
        (format!("time (h),{}\n", &head[9..]) + &with(0, &even, "0"), ["unknown unit 'h'", "use s, ms"]),
        (format!("tick,{}\n", &head[9..]) + &with(0, &even, "0"), ["no time column", "time (s)"]),
    ] {
        let output = identify(&text);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(parts.iter().all(|part| said.contains(part)), "{parts:?}: {said}");
        assert_eq!(output.status.code(), Some(2), "{said}");
    }
}

#[test]
fn a_sine_is_refused_and_names_what_it_cannot_separate() {
    let sine = rows(|_, time_s| {
        let (sine, cosine) = (TAU * time_s).sin_cos();
        let force = 0.3 * (3.1 * TAU * cosine - 0.2 * TAU * TAU * sine);
        [time_s, 0.3 * sine, force].map(|value| value.to_string())
    });
    let output = identify(&format!("time (s),arm.POSITION[0] (rad),arm.FORCE[0] (N·m)\n{sine}"));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("cannot separate the effects of inertia") && said.contains("sweep"), "{said}");
    assert_eq!(output.status.code(), Some(1), "{said}");
}
