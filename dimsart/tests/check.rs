//! `dimsart check`: names the location and remedy of every mistake in a scheme.
#![expect(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use std::fs;
use std::process::{Command, Output};

use hil_sim::emulated::IMAGE_FOLDER_VARIABLE;
use test_requirements::stamped_image;

const BILATERAL: &str = include_str!("../../schemes/bilateral.scheme");
const LAST_ROW: &str = "m&s      MOD_ENG        MATCHING_CHECK";

fn dimsart(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_dimsart")).args(arguments).output().unwrap()
}

/// Returns exit status and output of a check, without the name of the scheme's file.
fn check(rows: &str, more: &[&str]) -> (Option<i32>, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("my.scheme");
    fs::write(&path, rows).unwrap();
    let path = path.to_str().unwrap();
    let output = dimsart(&[&["check", path], more].concat());
    let out = String::from_utf8(output.stdout).unwrap();
    (output.status.code(), out.replace(path, "my.scheme"))
}

/// Returns the output of a check of the shipped scheme with one changed row, on the master; it must report faults.
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
    let lines: Vec<&str> = out
        .lines()
        .filter(|line| !["  uses ", "  note: "].iter().any(|start| line.starts_with(start)))
        .collect();
    let fault = "  fault: COMM_TXMOD reads CH1_TD_WAVES, which has no provider: plug in a module that writes \
    CH1_TD_WAVES";
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
    assert!(out.contains("  uses 5 of 32 modules, "), "{out}");
    let (_, out) = check(BILATERAL, &["--side", "slave"]);
    assert!(!out.contains("master"), "{out}");
}

#[test]
fn whose_packets_are_heard_is_noted() {
    let (_, out) = check(BILATERAL, &[]);
    assert!(!out.contains("note"), "{out}");
    let without = |rows: &str| {
        let is_kept = |line: &&str| !line.contains(rows);
        check(&BILATERAL.lines().filter(is_kept).collect::<Vec<_>>().join("\n"), &["--side", "master"])
    };
    for (left_out, expected) in [
        (
            "_CHANNEL",
            "accepts its own packets as the peer's on a line with echo, and packets of every controller on a CAN bus",
        ),
        ("CTX_CHANNEL", "sends on channel 0, and on a CAN bus every controller"),
    ] {
        let (status, out) = without(left_out);
        assert_eq!(status, Some(0), "{out}");
        assert!(out.contains(&format!("  note: link 0 {expected}")), "{out}");
        assert!(out.contains("give each direction its own channel above 0"), "{out}");
    }
    let (_, out) = check(&BILATERAL.replace("_CHANNEL     2", "_CHANNEL     1"), &["--side", "master"]);
    assert!(out.contains("accepts its own packets as the peer's on a line with echo: give"), "{out}");
}

#[test]
fn a_read_of_the_last_tick_is_listed_as_a_delay() {
    let rows =
        BILATERAL.replace("m&s      WTRANSF_MOD    B_PARAM         10", "all WTRANSF_MOD FORM PRINTED");
    let (status, out) = check(&rows, &["--side", "master"]);
    assert_eq!(status, Some(0), "{out}");
    let delay =
        "  delay: PDCTRL_MOD reads DES_POSITION before WTRANSF_MOD writes it, so the value is one tick old";
    assert!(out.contains(delay), "{out}");
}

#[test]
fn a_device_that_cannot_be_is_refused() {
    for (arguments, expected) in [
        (["--dof", "0"], "device has 0 degrees of freedom: allowed are 1 to 8"),
        (["--dof", "9"], "device has 9 degrees of freedom: allowed are 1 to 8"),
        (["--sample-period-s", "nan"], "invalid sample period NaN s: it must be finite and above 0"),
        (["--sample-period-s", "-1"], "invalid sample period -1 s: it must be finite and above 0"),
    ] {
        let output = dimsart(&["check", "builtin:bilateral", arguments[0], arguments[1]]);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains(expected), "{message}");
    }
    for command in ["scheme", "dbc"] {
        assert_eq!(
            dimsart(&[command, "builtin:bilateral", "--dof", "9"]).status.code(),
            Some(2),
            "{command}"
        );
    }
}

#[test]
fn a_typo_is_named_with_row_column_and_the_nearest_word() {
    const K: &str = "master   PDCTRL_MOD     K_PARAM         3000";
    const ON: &str = "m&s      MOD_ENG        MOD_ON          PDCTRL_MOD";
    for (row, instead, expected) in [
        (K, "mastr PDCTRL_MOD K_PARAM 3000", "16:1: 'mastr' is not a destination; did you mean 'master'?"),
        (K, "master PDCTL_MOD K_PARAM 3000", "16:8: 'PDCTL_MOD' is not a module; did you mean 'PDCTRL_MOD'?"),
        (
            K,
            "master PDCTRL_MOD K_PARM 3000",
            "16:19: 'K_PARM' is not a parameter or port of PDCTRL_MOD; did you mean 'K_PARAM'?",
        ),
        (K, "master PDCTRL_MOD K_PARAM 3o00", "16:27: '3o00' is not a number from 0 to 1000000"),
        (K, "master PDCTRL_MOD K_PARAM nan", "16:27: 'nan' is not a number from 0 to 1000000"),
        (
            K,
            "master PDCTRL_MOD K_PARAM",
            "16:26: expected a number from 0 to 1000000 N/m at the end of the row",
        ),
        (K, "master PDCTRL_MOD K_PARAM 1 2", "16:29: unexpected word '2' at the end of the row"),
        (K, "master PDCTRL_MOD K_PARAM[3] 1", "16:19: no such axis: the device has 3 axes, counted from 0"),
        (
            K,
            "master PDCTRL_MOD PORT_POSITION POSITON",
            "16:33: 'POSITON' is not a data type; did you mean 'POSITION'?",
        ),
        (
            ON,
            "m&s MOD_ENG MOD_UN PDCTRL_MOD",
            "18:13: 'MOD_UN' is not a command of the engine; did you mean 'MOD_ON'?",
        ),
        (ON, "m&s MOD_ENG MOD_ON PDCTRL", "18:20: 'PDCTRL' is not a module; did you mean 'PDCTRL_MOD'?"),
        (
            LAST_ROW,
            "m&s MOD_ENG",
            "25:12: expected a command of the engine at the end of the row; available: MOD_ON, ",
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
        "port POSITION of PDCTRL_MOD is bound to CH1_WAVES, which has the wrong unit, sqrt(W): bind the port to \
         a compatible signal (PORT_POSITION command); `dimsart modules PDCTRL_MOD` shows the ports",
        "DES_FORCE has two providers, PDCTRL_MOD and PCTRL_MOD: unplug one of the two, or bind its port to another signal",
        "PDCTRL_MOD reads CH1_WAVES before WTRANSF_MOD writes it, so the value is one tick old: plug in the \
         writer first",
    ] {
        assert!(out.contains(&format!("\n  fault: {expected}")), "missing: {expected}\n{out}");
    }
}

#[test]
fn what_a_refused_row_may_have_caused_is_told_from_what_it_is() {
    let out = faulty("TD_PARAM        10", "TD_PARAM        10000");
    let refusal = "the module needs 30000 words of the Data Base, but only ";
    assert!(out.contains(refusal) && out.contains("use a shorter delay or fewer rows"), "{out}");
    let lines: Vec<&str> = out.lines().skip(1).collect();
    assert!(lines.len() == 2 && lines[1].ends_with("(possibly caused by an error above)"), "{out}");
}

#[test]
fn one_module_more_than_fit_is_refused_with_the_way_out() {
    let more: Vec<String> = (2..=29).map(|number| format!("all MOD_ENG MOD_ON PCTRL_MOD.{number}")).collect();
    let out = faulty(LAST_ROW, &more.join("\n"));
    let refusal = "'PCTRL_MOD.29' refused: too many modules: close one first (MOD_CLOSE in a scheme";
    assert!(out.contains(refusal) && !out.contains("'PCTRL_MOD.28' refused"), "{out}");
}

#[test]
fn a_scheme_that_never_starts_does_not_match() {
    let out = faulty(LAST_ROW, "");
    assert!(
        out.contains("the scheme is stopped after its last row: add the row `all MOD_ENG MATCHING_CHECK`"),
        "{out}"
    );
}

#[test]
fn a_transaction_that_is_never_ended_does_not_match() {
    let out = faulty(LAST_ROW, &format!("{LAST_ROW}\nall MOD_ENG BEGIN\nall PDCTRL_MOD K_PARAM 7"));
    let fault = "open transaction at the end of the scheme: add the row `all MOD_ENG COMMIT`";
    assert!(out.contains(fault), "{out}");
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

#[test]
fn on_a_board_a_scheme_is_told_how_long_its_ticks_can_be() {
    if stamped_image("nucleo-g474re").is_none() {
        return;
    }
    let (status, out) = check(BILATERAL, &["--side", "master", "--board", "nucleo-g474re"]);
    assert_eq!(status, Some(0), "{out}");
    let line = out.lines().find(|line| line.starts_with("  a tick takes up to ")).unwrap();
    assert!(line.contains(" of the allowed 84000 cycles (") && line.ends_with(" % of the period"), "{out}");
    let (_, without) = check(BILATERAL, &["--side", "master"]);
    assert!(!without.contains("a tick takes"), "{without}");
}

#[test]
fn a_module_too_many_for_a_board_is_named_with_the_numbers() {
    if stamped_image("mps2-an386").is_none() {
        return;
    }
    let receivers: String =
        (1..=16).map(|number| format!("all MOD_ENG MOD_ON COMM_RXMOD.{number}\n")).collect();
    let types = ["CH2_WAVES", "CH1_WAVES", "FORCE", "VELOCITY"];
    let rows: String = types.iter().map(|name| format!("all COMM_RXMOD CRX_ADD_DATA {name}\n")).collect();
    let more = ["--side", "master", "--dof", "8"];
    let (status, out) = check(&(rows + &receivers), &[&more[..], &["--board", "mps2-an386"]].concat());
    assert_eq!(status, Some(1), "{out}");
    let refused = out.lines().find(|line| line.contains("refused")).unwrap();
    let place = refused.contains("my.scheme:") && refused.contains("'COMM_RXMOD.");
    assert!(place && refused.contains("it may take 20000: unplug another module first"), "{refused}");
}

#[test]
fn without_a_stamped_image_of_the_board_the_scheme_is_checked_and_how_long_it_takes_is_not_known() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_dimsart"));
    let check = command.args(["check", "builtin:bilateral", "--board", "nucleo-g474re"]);
    let output = check.env(IMAGE_FOLDER_VARIABLE, folder.path()).output().unwrap();
    let out = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success() && out.contains("maximum tick time unknown: no firmware image"), "{out}");
    assert!(out.contains("cargo board nucleo-g474re"), "{out}");
}

#[test]
fn a_board_that_does_not_exist_is_told_with_the_ones_that_do() {
    let output = dimsart(&["check", "builtin:bilateral", "--board", "nucleo"]);
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(2) && message.contains("unknown board 'nucleo'"), "{message}");
    assert!(boards::BOARDS.iter().all(|board| message.contains(board.name)), "{message}");
}

/// A board of one axis and little memory.
#[test]
fn a_scheme_is_checked_for_the_axes_and_the_memory_of_the_board() {
    let output = dimsart(&["check", "builtin:bilateral", "--board", "b-g431b-esc1"]);
    let out = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success() && out.contains(" of 480 words"), "{out}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("long.scheme");
    let scheme =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../schemes/bilateral.scheme")).unwrap();
    std::fs::write(&path, scheme.replace("TD_PARAM        10", "TD_PARAM        900")).unwrap();
    let check = |board: &str| dimsart(&["check", path.to_str().unwrap(), "--board", board]);
    let out = String::from_utf8(check("b-g431b-esc1").stdout).unwrap();
    assert!(out.contains("words of the Data Base, b-g431b-esc1 has 480: shorten a delay"), "{out}");
    assert!(check("nucleo-g474re").status.success());
}

/// JSON contains all findings of the text.
#[test]
fn what_is_found_can_be_read_by_a_program() {
    let output = dimsart(&["check", "builtin:table1", "--json"]);
    assert_eq!(output.status.code(), Some(1));
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let [master, slave] = [&found[0], &found[1]];
    assert_eq!((&master["controller"], &master["matches"]), (&"master".into(), &true.into()));
    assert_eq!((&slave["controller"], &slave["matches"]), (&"slave".into(), &false.into()));
    assert!(slave["faults"][0].as_str().unwrap().contains("which has no provider"), "{slave}");
    assert!(
        master["words"].as_u64().unwrap() > 100
            && master["max_words"] == 2048
            && master["most_words"] == 2048,
        "{master}"
    );
}

#[test]
fn a_rig_is_checked_controller_by_controller() {
    let output = dimsart(&["check", "arm_bus"]);
    let out = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success() && out.contains("arm_bus on the coordinator: matches"), "{out}");
    assert_eq!(out.lines().filter(|line| line.ends_with("matches")).count(), 7, "{out}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("my.toml");
    let rig = hil_sim::rig_file::RigFile::shipped("joint").unwrap();
    fs::write(&path, rig.replace("builtin:joint", "builtin:three")).unwrap();
    let output = dimsart(&["check", path.to_str().unwrap()]);
    let out = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(out.contains("on the joint: does NOT match\n  fault: "), "{out}");
}

#[test]
fn a_link_that_a_board_has_not_is_a_fault_there_alone() {
    let rows = BILATERAL.replacen(
        LAST_ROW,
        &format!(
            "all COMM_TXMOD.2 CTX_ADD_DATA POSITION\nall COMM_TXMOD.2 \
    CTX_LINK 3\nall MOD_ENG MOD_ON COMM_TXMOD.2\n{LAST_ROW}"
        ),
        1,
    );
    assert_eq!(check(&rows, &["--side", "master"]).0, Some(0));
    let (status, out) = check(&rows, &["--side", "master", "--board", "nucleo-g474re"]);
    assert_eq!(status, Some(1), "{out}");
    assert!(out.contains("the scheme uses link 3, nucleo-g474re has links 0 to 1"), "{out}");
}

/// For every shipped scheme of two sides, the printed rows rebuild the same scheme and are stable.
#[test]
fn a_printed_scheme_is_the_same_scheme() {
    let folder = tempfile::tempdir().unwrap();
    for scheme in ["bilateral", "position_position", "small_motors"] {
        for side in ["master", "slave"] {
            let printed = dimsart(&["scheme", &format!("builtin:{scheme}"), "--side", side]);
            assert!(printed.status.success(), "{scheme}: {printed:?}");
            let path = folder.path().join(format!("{scheme}-{side}.scheme"));
            fs::write(&path, &printed.stdout).unwrap();
            let path = path.to_str().unwrap();
            let again = dimsart(&["scheme", path, "--side", side]);
            assert_eq!(
                String::from_utf8(again.stdout).unwrap(),
                String::from_utf8(printed.stdout).unwrap(),
                "{scheme}"
            );
        }
    }
    let paper = dimsart(&["scheme", "builtin:bilateral"]);
    let rows = String::from_utf8(paper.stdout).unwrap();
    assert!(
        rows.lines().any(|row| row.split_whitespace().eq(["master", "PDCTRL_MOD", "K_PARAM", "3000"])),
        "{rows}"
    );
    assert!(rows.ends_with("MATCHING_CHECK\n"), "{rows}");
}

#[test]
fn what_a_controller_of_a_rig_has_is_printed() {
    let joint = dimsart(&["scheme", "joint"]);
    let rows = String::from_utf8(joint.stdout).unwrap();
    assert!(
        rows.lines().any(|row| row.split_whitespace().eq(["all", "PIDCTRL_MOD", "K_PARAM", "150"])),
        "{rows}"
    );
    let one = dimsart(&["scheme", "arm_bus", "--controller", "coordinator"]);
    let rows = String::from_utf8(one.stdout).unwrap();
    assert!(rows.starts_with("coordinator  COMM_TXMOD"), "{rows}");
    for (arguments, expected) in [
        (&["arm_bus"][..], "arm_bus has several controllers: select one with --controller: coordinator, "),
        (
            &["arm_bus", "--controller", "finger"],
            "arm_bus has no controller finger: select one with --controller: coordinator, ",
        ),
        (
            &["joint", "--side", "slave"],
            "--side and --dof apply to schemes only: omit them, because a rig defines",
        ),
        (&["builtin:bilateral", "--controller", "joint"], "--controller applies to rigs only"),
    ] {
        let output = dimsart(&[&["scheme"], arguments].concat());
        let message = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(2) && message.contains(expected), "{arguments:?}: {message}");
    }
}

/// If the resolution of `f32` is too coarse for a position, the rig's check reports the usable range.
#[test]
fn positions_beyond_what_an_f32_has_fine_steps_for_are_noted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("far.toml");
    let far = |limit: &str| {
        let rig = include_str!("../../scenarios/telerobot.toml");
        fs::write(&path, rig.replace("position_limit = 2.0 ", &format!("position_limit = {limit} ")))
            .unwrap();
        let output = dimsart(&["check", path.to_str().unwrap()]);
        assert!(output.status.success());
        String::from_utf8(output.stdout).unwrap()
    };
    let note = "note: position resolution (f32) is only 6.2e-2 m at position_limit 1000000 m, but 0.0001 m or \
    finer within ±1024 m";
    assert_eq!(far("1e6").matches(note).count(), 1);
    assert!(!far("1000.0").contains("resolution"));
}

/// 0.49 of the module's rate, on every axis; a first-order low-pass has no maximum.
#[test]
fn a_filter_s_frequency_above_its_rate_is_refused_with_the_maximum() {
    let with = |rows: &str| {
        let rows = rows.split('|').map(|row| format!("master {row}\n")).collect::<String>();
        let signals = "PORT_SIGNAL_IN POSITION|PORT_SIGNAL_OUT SIGNAL";
        let module = rows.split_whitespace().nth(1).unwrap();
        let bound = signals.split('|').map(|row| format!("master {module} {row}\n")).collect::<String>();
        let all = format!("{rows}{bound}master MOD_ENG MOD_ON {module}\n{LAST_ROW}");
        let (_, out) = check(&BILATERAL.replacen(LAST_ROW, &all, 1), &["--side", "master"]);
        out.lines().filter(|line| line.contains("FREQUENCY")).map(str::trim).collect::<Vec<_>>().join("\n")
    };
    assert_eq!(
        with("NOTCH_MOD FREQUENCY[1] 491"),
        "fault: FREQUENCY[1] of NOTCH_MOD is 491 Hz, above 0.49 × module rate = 490.0 Hz: lower FREQUENCY"
    );
    assert_eq!(with("NOTCH_MOD FREQUENCY 490"), "");
    let slow = with("LOWPASS_MOD ORDER SECOND|LOWPASS_MOD EVERY_TICKS 10");
    assert_eq!(slow.lines().count(), 3, "{slow}");
    assert!(slow.ends_with("is 100 Hz, above 0.49 × module rate = 49.0 Hz: lower FREQUENCY or EVERY_TICKS"));
    assert_eq!(with("LOWPASS_MOD FREQUENCY 1e5"), "");
}

#[test]
fn a_word_of_megabytes_is_refused_at_once_and_shown_in_part() {
    let word = "K".repeat(2_000_000);
    for rows in [
        format!("all {word} K 1\n"),
        format!("all PDCTRL_MOD {word} 1\n"),
        format!("all PDCTRL_MOD K_PARAM {word}\n"),
    ] {
        let begun = std::time::Instant::now();
        let (status, printed) = check(&rows, &[]);
        assert!(status == Some(1) && printed.contains("KKK…") && printed.len() < 20_000, "{printed:.300}");
        assert!(begun.elapsed().as_secs_f64() < 4.0, "{:?}", begun.elapsed());
    }
}
