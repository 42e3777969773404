//! `dimsart motor`: configuration as text, current loop and identification.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn dimsart(folder: &Path, words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_dimsart")).args(words).current_dir(folder).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// A folder with a changed copy of the printed example.
fn folder(from: &str, to: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let example = text(&dimsart(folder.path(), &["motor", "example"]).stdout);
    assert!(example.contains(from), "{example}");
    fs::write(folder.path().join("motor.toml"), example.replace(from, to)).unwrap();
    folder
}

#[test]
fn the_example_follows_a_step_and_its_picture_is_drawn() {
    let folder = folder("", "");
    let output = dimsart(folder.path(), &["motor", "check", "motor.toml"]);
    let said = text(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{said}");
    // 3/2 · 10 · 0.008, and that times 20 A.
    assert!(said.contains("0.1200 N m/A") && said.contains("2.400 N m at 20 A"), "{said}");
    // The step starts after the alignment: all five responses have settled within 0.5 ms of it.
    let settled = said.lines().filter_map(|line| line.split('┆').nth(3)?.trim().parse::<f64>().ok());
    let settled: Vec<f64> = settled.collect();
    assert!(settled.len() == 5 && settled.iter().all(|settled_ms| *settled_ms < 0.5), "{said}");
    let picture = fs::read_to_string(folder.path().join("runs/motor/current_step.svg")).unwrap();
    assert!(picture.contains("R × 1.3, L × 0.7"), "{picture}");
}

#[test]
fn a_loop_that_is_too_fast_and_a_value_that_cannot_be_are_said() {
    let folder = folder("bandwidth_rad_per_s = 6283.0", "bandwidth_rad_per_s = 6650");
    let output = dimsart(folder.path(), &["motor", "check", "motor.toml"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stdout).contains("reduce bandwidth_rad_per_s"), "{output:?}");
    let folder = self::folder("trip_current_a = 30.0", "trip_current_a = 10.0");
    for action in ["check", "identify"] {
        let output = dimsart(folder.path(), &["motor", action, "motor.toml"]);
        let said = text(&output.stderr);
        assert!(said.contains("motor.toml: limits.trip_current_a is 10: must be above"), "{said}");
        assert_eq!(output.status.code(), Some(1));
    }
}

#[test]
fn what_is_found_of_a_motor_is_what_is_true_and_a_load_that_is_too_heavy_is_said() {
    let folder = folder("is_encoder_reversed = false", "is_encoder_reversed = true");
    let output = dimsart(folder.path(), &["motor", "identify", "motor.toml", "--friction-nm", "0.02"]);
    let said = text(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    for line in said.lines().filter(|line| line.contains("_h ") || line.contains("_ohm")) {
        let numbers: Vec<f64> = line.split(['│', '┆']).filter_map(|cell| cell.trim().parse().ok()).collect();
        let [found, truth] = numbers.as_slice() else { panic!("{line}") };
        assert!((found / truth - 1.0).abs() < 0.05, "{line}");
    }
    let is_right = |name: &str, value: &str| {
        let line = said.lines().find(|line| line.contains(name)).unwrap();
        line.matches(&format!(" {value} ")).count() == 2
    };
    assert!(is_right("pole_pairs", "10") && is_right("is_encoder_reversed", "true"), "{said}");
    let output = dimsart(folder.path(), &["motor", "identify", "motor.toml", "--friction-nm", "1.5"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("remove the load"), "{output:?}");
}
