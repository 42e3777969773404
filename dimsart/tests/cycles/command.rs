//! Tests of `dimsart cycles` from the user's view.

use std::fs;
use std::process::{Command, Output};

use crate::common::firmware;

fn dimsart(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_dimsart")).args(arguments).output().unwrap()
}

fn refused(arguments: &[&str]) -> String {
    refused_with(1, arguments)
}

fn refused_with(status: i32, arguments: &[&str]) -> String {
    let output = dimsart(arguments);
    assert_eq!(output.status.code(), Some(status), "{arguments:?}");
    String::from_utf8(output.stderr).unwrap()
}

#[test]
fn standard_output_is_json_with_every_figure_and_a_picture_is_drawn() {
    let Some(firmware) = firmware() else { return };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let elf = firmware.path.to_str().unwrap();
    let short = ["--set", "duration_s=0.2", "--random-ticks", "100", "--dof", "1"];
    let output = dimsart(&[&["cycles", elf, "--json", "--out", out], short.as_slice()].concat());
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{text}");
    let table = String::from_utf8(output.stderr).unwrap();
    assert!(table.contains("TRM-model cycles") && table.contains("bit-identical to the host"), "{table}");
    let figures: serde_json::Value = serde_json::from_str(&text).unwrap();
    let modules = figures["modules"].as_array().unwrap();
    assert_eq!(modules.len(), 5);
    let interrupt = figures["interrupt"].as_array().unwrap();
    assert_eq!(interrupt.len(), 3);
    for row in modules.iter().chain(interrupt).chain([&figures["tick"]]) {
        assert!(row["name"].is_string(), "{row}");
        for key in ["emulated_min", "emulated_mean", "emulated_max", "bound", "stack_bytes"] {
            assert!(row[key].is_number(), "{key}: {row}");
        }
    }
    assert_eq!(figures["budget_cycles"], u64::from(firmware.clock_hz / firmware.tick_hz));
    assert!(folder.path().join("cycles.svg").metadata().unwrap().len() > 1000);
}

#[test]
fn what_is_no_image_is_refused_in_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let text = folder.path().join("text.elf");
    fs::write(&text, "no image").unwrap();
    let own = env!("CARGO_BIN_EXE_dimsart");
    let missing = folder.path().join("missing.elf");
    for (path, reason) in [
        (text.to_str().unwrap(), "cannot read image"),
        (own, "cannot read image"),
        (missing.to_str().unwrap(), "no firmware image"),
    ] {
        let message = refused(&["cycles", path]);
        assert!(message.contains(reason) && message.contains(path), "{message}");
        assert_eq!(message.lines().count(), 1, "{message}");
    }
}

#[test]
fn another_board_and_a_scheme_that_does_not_match_are_named() {
    let Some(firmware) = firmware() else { return };
    let elf = firmware.path.to_str().unwrap();
    let message = refused(&["cycles", elf, "--board", "no-such-board"]);
    assert!(message.contains("no-such-board") && message.contains(&firmware.name), "{message}");
    let message = refused(&["cycles", elf, "--scheme", "builtin:table1", "--side", "slave"]);
    assert!(message.contains("does not run on the slave"), "{message}");
    let message = refused_with(2, &["cycles", elf, "--dof", "9"]);
    assert!(message.contains("dof"), "{message}");
}
