//! Output of all sub-commands: within the width of the terminal, and only JSON with `--json`.
#![expect(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use std::path::Path;
use std::process::{Command, Output};

fn dimsart(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dimsart"));
    command.current_dir(folder).env("COLUMNS", "80").args(arguments).output().unwrap()
}

#[test]
fn tables_are_as_wide_as_the_terminal() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in [
        &["run", "joint", "--no-report"][..],
        &["run", "--no-report", "--set", "duration_s=1"],
        &["bus", "--no-picture"],
        &["modules", "PDCTRL_MOD"],
        &["modules", "COMM_RXMOD"],
        &["config", "diff", "builtin:arm"],
        &["config", "diff", "builtin:joint", "builtin:arm"],
    ] {
        let text = String::from_utf8(dimsart(folder.path(), arguments).stdout).unwrap();
        let rows: Vec<&str> = text.lines().filter(|line| line.starts_with(['│', '╞', '┌', '└'])).collect();
        assert!(rows.len() > 4, "{arguments:?}: {text}");
        assert!(rows.iter().all(|row| row.chars().count() <= 80), "{arguments:?}:\n{text}");
    }
}

#[test]
fn standard_output_is_json_alone() {
    let folder = tempfile::tempdir().unwrap();
    let short = ["--set", "duration_s=0.2"];
    for arguments in [
        &["run", "--json"][..],
        &["run", "joint", "--json"],
        &["sweep", "--vary", "seed=1,2", "--vary", "dof=1,2", "--json"],
        &["bus", "--json"],
        &["check", "arm_bus", "--json"],
        &["check", "builtin:table1", "--json"],
        &["modules", "--json"],
        &["dbc", "builtin:bilateral", "--json"],
        &["doctor", "--json"],
        &["config", "diff", "builtin:joint", "--json"],
        &["config", "diff", "builtin:joint", "builtin:arm", "--json"],
    ] {
        let takes_settings = ["run", "sweep"].iter().any(|command| arguments.contains(command));
        let output = dimsart(folder.path(), &[arguments, if takes_settings { &short } else { &[] }].concat());
        let found = serde_json::from_slice::<serde_json::Value>(&output.stdout);
        assert!(found.is_ok(), "{arguments:?}: {output:?}");
    }
}

#[test]
fn a_side_that_a_rig_has_not_or_that_has_no_address_is_wrong_usage() {
    let folder = tempfile::tempdir().unwrap();
    let output = dimsart(folder.path(), &["run", "joint", "--side", "slave"]);
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(2) && message.contains("unknown controller slave"), "{message}");
    let output = dimsart(folder.path(), &["run", "joint", "--side", "joint"]);
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(2) && message.contains("with an `address`"), "{message}");
}

#[test]
fn a_scheme_that_is_run_as_a_rig_is_told_from_one() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("my.scheme"), "all PDCTRL_MOD K_PARAM 3\n").unwrap();
    let output = dimsart(folder.path(), &["run", "my.scheme"]);
    let message = String::from_utf8(output.stderr).unwrap();
    let hint = "To check a scheme: `dimsart check my.scheme`; to run it: `dimsart run --set master.scheme=my.scheme`";
    assert!(output.status.code() == Some(1) && message.contains(hint), "{message}");
}
