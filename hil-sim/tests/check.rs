//! `dimsart check`: every mistake in a scheme is named with its place and the way out.

use std::fs;
use std::process::{Command, Output};

const BILATERAL: &str = include_str!("../../schemes/bilateral.scheme");
const LAST_ROW: &str = "m&s      MOD_ENG        MATCHING_CHECK";

fn dimsart(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_dimsart")).args(arguments).output().unwrap()
}

/// Exit status and output of a check, without the name of the scheme's file.
fn check(rows: &str, more: &[&str]) -> (Option<i32>, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("my.scheme");
    fs::write(&path, rows).unwrap();
    let path = path.to_str().unwrap();
    let output = dimsart(&[&["check", path], more].concat());
    let out = String::from_utf8(output.stdout).unwrap();
    (output.status.code(), out.replace(path, "my.scheme"))
}

/// The shipped scheme with one row changed, checked on the master: the output, which must tell of faults.
fn faulty(row: &str, instead: &str) -> String {
    assert!(BILATERAL.contains(row));
    let (status, out) = check(&BILATERAL.replacen(row, instead, 1), &["--side", "master"]);
    assert_eq!(status, Some(1), "{out}");
    assert!(out.starts_with("my.scheme on the master: does NOT match\n"), "{out}");
    out
}

#[test]
fn table_1_as_printed_lacks_one_provider_on_the_slave() {
    let output = dimsart(&["check", "builtin:table1"]);
    assert_eq!(output.status.code(), Some(1));
    let out = String::from_utf8(output.stdout).unwrap();
    let lines: Vec<&str> = out.lines().filter(|line| !line.contains("takes")).collect();
    let fault = "  fault: COMM_TXMOD reads CH1_TD_WAVES and nobody provides it: plug in a module that writes CH1_TD_WAVES";
    assert_eq!(
        lines,
        ["builtin:table1 on the master: matches", "builtin:table1 on the slave: does NOT match", fault]
    );
    assert!(dimsart(&["check", "builtin:table1", "--side", "master"]).status.success());
    let run = dimsart(&["run", "--set", "slave.scheme=builtin:table1", "--no-report"]);
    assert_eq!(run.status.code(), Some(1));
    let message = String::from_utf8(run.stderr).unwrap();
    assert!(
        message.contains("builtin:table1 does not run on the slave:\n  COMM_TXMOD reads CH1_TD"),
        "{message}"
    );
}

#[test]
fn both_sides_are_checked_unless_one_is_named() {
    let (status, out) = check(BILATERAL, &[]);
    assert_eq!(status, Some(0));
    assert!(out.contains("on the master: matches") && out.contains("on the slave: matches"), "{out}");
    assert!(out.contains("  takes 5 of 16 modules, "), "{out}");
    let (_, out) = check(BILATERAL, &["--side", "slave"]);
    assert!(!out.contains("master"), "{out}");
}

#[test]
fn a_read_of_the_last_tick_is_listed_as_a_delay() {
    let rows =
        BILATERAL.replace("m&s      WTRANSF_MOD    B_PARAM         10", "all WTRANSF_MOD FORM PRINTED");
    let (status, out) = check(&rows, &["--side", "master"]);
    assert_eq!(status, Some(0), "{out}");
    let delay = "  delay: PDCTRL_MOD reads DES_POSITION before WTRANSF_MOD writes it, so it sees the last tick's value";
    assert!(out.contains(delay), "{out}");
}

#[test]
fn a_device_that_cannot_be_is_refused() {
    for (arguments, expected) in [
        (["--dof", "0"], "0 degrees of freedom: 1 to 8 are possible"),
        (["--dof", "9"], "9 degrees of freedom: 1 to 8 are possible"),
        (["--sample-period-s", "nan"], "a sample period of NaN s: it must be finite and above 0"),
        (["--sample-period-s", "-1"], "a sample period of -1 s: it must be finite and above 0"),
    ] {
        let output = dimsart(&["check", "builtin:bilateral", arguments[0], arguments[1]]);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{message}");
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn a_typo_is_named_with_row_column_and_the_nearest_word() {
    const K: &str = "master   PDCTRL_MOD     K_PARAM         3000";
    const ON: &str = "m&s      MOD_ENG        MOD_ON          PDCTRL_MOD";
    for (row, instead, expected) in [
        (K, "mastr PDCTRL_MOD K_PARAM 3000", "13:1: 'mastr' is not a side; did you mean 'master'?"),
        (K, "master PDCTL_MOD K_PARAM 3000", "13:8: 'PDCTL_MOD' is not a module; did you mean 'PDCTRL_MOD'?"),
        (
            K,
            "master PDCTRL_MOD K_PARM 3000",
            "13:19: 'K_PARM' is not a parameter or port of PDCTRL_MOD; did you mean 'K_PARAM'?",
        ),
        (K, "master PDCTRL_MOD K_PARAM 3o00", "13:27: '3o00' is not a number from 0 to 1000000"),
        (K, "master PDCTRL_MOD K_PARAM nan", "13:27: 'nan' is not a number from 0 to 1000000"),
        (K, "master PDCTRL_MOD K_PARAM", "13:26: the row ends where a number from 0 to 1000000 should be"),
        (K, "master PDCTRL_MOD K_PARAM 1 2", "13:29: '2' is one word too many on this row"),
        (K, "master PDCTRL_MOD K_PARAM[3] 1", "13:30: no such axis: the device has 3 of them"),
        (
            K,
            "master PDCTRL_MOD PORT_POSITION POSITON",
            "13:33: 'POSITON' is not a data type; did you mean 'POSITION'?",
        ),
        (
            ON,
            "m&s MOD_ENG MOD_UN PDCTRL_MOD",
            "15:13: 'MOD_UN' is not a command of the engine; did you mean 'MOD_ON'?",
        ),
        (ON, "m&s MOD_ENG MOD_ON PDCTRL", "15:20: 'PDCTRL' is not a module; did you mean 'PDCTRL_MOD'?"),
        (
            LAST_ROW,
            "m&s MOD_ENG",
            "20:12: the row ends where a command of the engine should be; there is MOD_ON, ",
        ),
    ] {
        let out = faulty(row, instead);
        assert!(out.contains(&format!("\n  fault: my.scheme:{expected}")), "{instead}: {out}");
    }
}

#[test]
fn faults_of_the_whole_scheme_are_named_all_at_once() {
    let out = faulty(
        "m&s      MOD_ENG        MOD_ON          PDCTRL_MOD",
        "all PDCTRL_MOD PORT_POSITION CH1_WAVES\nall MOD_ENG MOD_ON PDCTRL_MOD\nall MOD_ENG MOD_ON PCTRL_MOD",
    );
    for expected in [
        "port POSITION of PDCTRL_MOD is bound to CH1_WAVES, whose unit, sqrt(W), is not the port's: bind it to a \
         signal that fits (PORT_POSITION command); `dimsart modules PDCTRL_MOD` shows what fits",
        "DES_FORCE has two providers, PDCTRL_MOD and PCTRL_MOD: unplug one or bind its port to another signal",
        "PDCTRL_MOD reads CH1_WAVES before WTRANSF_MOD writes it, so it sees the last tick's value: plug in the \
         writer first",
    ] {
        assert!(out.contains(&format!("\n  fault: {expected}")), "missing: {expected}\n{out}");
    }
}

#[test]
fn what_a_refused_row_may_have_caused_is_told_from_what_it_is() {
    let out = faulty("TD_PARAM        10", "TD_PARAM        10000");
    let refusal = "the module needs 30000 words of the Data Base and ";
    assert!(out.contains(refusal) && out.contains("ask for less (a shorter delay, fewer rows)"), "{out}");
    let lines: Vec<&str> = out.lines().skip(1).collect();
    assert!(lines.len() == 2 && lines[1].ends_with("(perhaps because of a row above)"), "{out}");
}

#[test]
fn one_module_more_than_fit_is_refused_with_the_way_out() {
    let more: Vec<String> = (2..=13).map(|number| format!("all MOD_ENG MOD_ON PCTRL_MOD.{number}")).collect();
    let out = faulty(LAST_ROW, &more.join("\n"));
    let refusal = "'PCTRL_MOD.13' refused: 16 modules exist already and no more fit: MOD_CLOSE one first";
    assert!(out.contains(refusal) && !out.contains("'PCTRL_MOD.12' refused"), "{out}");
}

#[test]
fn a_scheme_that_never_starts_does_not_match() {
    let out = faulty(LAST_ROW, "");
    assert!(
        out.contains("its last row leaves it stopped: end it with the row `all MOD_ENG MATCHING_CHECK`"),
        "{out}"
    );
}

#[test]
fn the_rows_in_the_help_of_modules_are_understood() {
    let help = String::from_utf8(dimsart(&["modules", "--help"]).stdout).unwrap();
    let words = |line: &str| line.split_whitespace().take(4).collect::<Vec<_>>().join(" ");
    let rows: Vec<String> = help.lines().filter(|line| line.starts_with("  all ")).map(words).collect();
    assert!(rows.len() >= 5, "{help}");
    let (_, out) = check(&rows.join("\n"), &["--side", "master"]);
    assert!(out.contains("PDCTRL_MOD.2") && !out.contains("fault: my.scheme:"), "{out}");
}
