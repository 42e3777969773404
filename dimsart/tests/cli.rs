//! The `dimsart` command from the user's view: output, files and exit status.
//!
//! These tests are here because only a package's tests have access to its binaries. Schemes: `check.rs`.
#![expect(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use hil_sim::rig_file::RigFile;
use test_requirements::TEST_TIMEOUT;

fn dimsart(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_dimsart")).args(arguments).output().unwrap()
}

/// Returns standard output of a command that ends with 0.
fn out(arguments: &[&str]) -> String {
    let output = dimsart(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

/// Returns standard output and standard error of a command that ends with 0.
fn both(arguments: &[&str]) -> [String; 2] {
    let output = dimsart(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    [text(&output.stdout), text(&output.stderr)]
}

/// Returns standard error of a command that ends with `status`.
fn refused(arguments: &[&str], status: i32) -> String {
    let output = dimsart(arguments);
    assert_eq!(output.status.code(), Some(status), "{arguments:?}: {}", text(&output.stdout));
    text(&output.stderr)
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

fn json(out: &str) -> serde_json::Value {
    serde_json::from_str(out.lines().last().unwrap()).unwrap()
}

#[test]
fn without_a_command_the_shipped_scenario_runs_and_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_dimsart")).current_dir(folder.path()).output().unwrap();
    assert!(output.status.success());
    let out = text(&output.stdout);
    assert!(out.contains("stable") && out.contains("perceived stiffness (N/m)"), "{out}");
    assert!(out.ends_with("report: runs/latest/report.html\n"), "{out}");
    let written = folder.path().join("runs/latest");
    for file in ["report.html", "signals.csv", "positions.svg", "forces.svg", "energy.svg", "timeline.svg"] {
        assert!(written.join(file).metadata().unwrap().len() > 1000, "{file}");
    }
}

#[test]
fn standard_output_is_one_line_of_json_with_every_figure() {
    let [out, _] = both(&["run", "--json", "--no-report"]);
    assert_eq!(out.lines().count(), 1, "{out}");
    let figures = json(&out);
    assert_eq!(figures["stable"], true);
    assert_eq!(figures["round_trip_ticks"], 22);
    assert_eq!(figures["faults"], serde_json::json!([]));
    for key in ["ticks", "wall_s", "realtime_factor", "energy_min_j"] {
        assert!(figures[key].is_number(), "{key}: {}", figures[key]);
    }
    for key in ["k_perceived_n_per_m", "k_predicted_n_per_m"] {
        assert_eq!(figures[key].as_array().unwrap().len(), 3, "{key}");
    }
    assert!(!out.contains("report: "), "{out}");
}

/// Independent of the working folder; paths on the command line are relative to it.
#[test]
fn paths_in_a_scenario_begin_in_its_folder() {
    let folder = tempfile::tempdir().unwrap();
    let scheme = include_str!("../../schemes/bilateral.scheme");
    fs::create_dir(folder.path().join("mine")).unwrap();
    fs::write(folder.path().join("mine/my.scheme"), scheme).unwrap();
    let path = folder.path().join("mine/my.toml");
    fs::write(&path, "duration_s = 0.1\n[master]\nscheme = \"my.scheme\"\n").unwrap();
    let path = path.to_str().unwrap();
    out(&["run", path, "--no-report"]);
    let message = refused(&["run", path, "--no-report", "--set", "slave.scheme=my.scheme"], 1);
    assert!(message.contains("cannot read scheme file my.scheme"), "{message}");
}

#[test]
fn an_unstable_run_says_no_and_ends_well() {
    let arguments = ["run", "--set", "wave.form=printed", "--no-report", "--json"];
    let [figures, out] = both(&arguments);
    assert_eq!(json(&figures)["stable"], false);
    let row = out.lines().find(|line| line.contains("stable ")).unwrap();
    assert!(row.contains("NO") && row.contains("see the fault"), "{row}");
    assert!(out.contains("fault: ") && out.contains("limit ±"), "{out}");
    let asked = dimsart(&[&arguments[..], &["--fail-if-unstable"]].concat());
    assert_eq!(asked.status.code(), Some(3));
    assert_eq!(dimsart(&["run", "joint", "--no-report", "--fail-if-unstable"]).status.code(), Some(0));
}

#[test]
fn a_short_run_that_grows_is_not_stable_before_anything_leaves_its_range() {
    let out = out(&["run", "--set", "wave.form=printed", "--set", "duration_s=0.4", "--no-report", "--json"]);
    let figures = json(&out);
    assert_eq!((&figures["stable"], &figures["ticks"]), (&false.into(), &400.into()));
    assert!(figures["faults"].to_string().contains("grows without bound"), "{out}");
}

#[test]
fn an_account_that_there_is_none_of_is_null() {
    let scheme = ["master", "slave"].map(|side| format!("{side}.scheme=builtin:position_position"));
    let delays = ["link.forward_delay_ticks=0", "link.backward_delay_ticks=0", "duration_s=0.1"];
    let mut arguments = vec!["run", "--no-report", "--json"];
    for setting in scheme.iter().map(String::as_str).chain(delays) {
        arguments.extend(["--set", setting]);
    }
    let [figures, out] = both(&arguments);
    assert!(
        json(&figures)["energy_min_j"].is_null() && out.contains("requires wave variables on both sides"),
        "{out}"
    );
}

#[test]
fn an_output_folder_that_cannot_be_made_is_known_before_the_run() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("occupied");
    fs::write(&file, "a regular file").unwrap();
    let below = file.join("run");
    let output = dimsart(&["run", "--out", below.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(text(&output.stdout), "", "the run was made although its report cannot be written");
    let message = text(&output.stderr);
    assert!(message.contains(&format!("cannot create {}", below.display())), "{message}");
    assert!(message.trim_end().ends_with("choose another folder"), "{message}");
}

/// Returns the maximum memory of a run's process, kilobytes.
#[cfg(target_os = "linux")]
fn peak_kb(arguments: &[&str]) -> u64 {
    let mut run =
        Command::new(env!("CARGO_BIN_EXE_dimsart")).args(arguments).stdout(Stdio::null()).spawn().unwrap();
    let status = format!("/proc/{}/status", run.id());
    let mut peak_kb = 0;
    while run.try_wait().unwrap().is_none() {
        let text = fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kb = line.and_then(|line| line.split_whitespace().next()?.parse().ok());
        peak_kb = peak_kb.max(kb.unwrap_or(0));
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(run.wait().unwrap().success());
    peak_kb
}

/// 70 000 and 210 000 rows, of which 65 536 are kept for the pictures.
#[cfg(target_os = "linux")]
#[test]
fn memory_does_not_grow_with_the_length_of_a_run() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let peak = |duration: &str| {
        let signals = "record.signals=['world', 'slave.DES_FORCE']";
        peak_kb(&["run", "--set", "dof=1", "--set", duration, "--set", signals, "--out", out])
    };
    let (short_kb, long_kb) = (peak("duration_s=70"), peak("duration_s=210"));
    // The rows of the longer run alone would need 19 MB more.
    assert!(long_kb < short_kb + 6_000, "{long_kb} KB for {short_kb} KB");
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_a_run_and_what_was_recorded_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    // Long enough for every machine, recorded sparsely enough for its memory.
    let sets = ["duration_s=1e6", "record.every_ticks=1000"];
    let run = Command::new(env!("CARGO_BIN_EXE_dimsart"))
        .args(["run", "--json", "--set", sets[0], "--set", sets[1], "--out"])
        .arg(folder.path())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let signals = folder.path().join("signals.csv");
    let start = Instant::now();
    while fs::read_to_string(&signals).unwrap_or_default().lines().count() < 5 {
        assert!(start.elapsed() < TEST_TIMEOUT, "no row is recorded");
        std::thread::sleep(Duration::from_millis(10));
    }
    let kill = Command::new("kill").args(["-INT", &run.id().to_string()]).status().unwrap();
    assert!(kill.success());
    let output = run.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    let figures = json(&text(&output.stdout));
    let fault = figures["faults"][0].as_str().unwrap();
    assert!(fault.starts_with("run stopped by the user at "), "{fault}");
    let ticks = figures["ticks"].as_u64().unwrap();
    assert!(ticks > 1000, "nothing was run");
    let rows = fs::read_to_string(signals).unwrap().lines().count();
    assert_eq!(rows as u64, 1 + ticks.div_ceil(1000), "a header, and one row per 1000 ticks");
    assert!(folder.path().join("report.html").exists());
}

/// Returns the names of the files in a folder.
#[cfg(unix)]
fn files(folder: &Path) -> Vec<String> {
    let files = fs::read_dir(folder).unwrap();
    files.map(|file| file.unwrap().file_name().into_string().unwrap()).collect()
}

/// A folder with a report that has every kind of picture.
#[cfg(unix)]
fn reported() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().to_str().unwrap();
    out(&["run", "--set", "duration_s=0.1", "--set", "link.carrier=can", "--out", path]);
    assert_eq!(files(folder.path()).len(), 7, "{:?}", files(folder.path()));
    folder
}

#[cfg(unix)]
#[test]
fn a_run_that_is_killed_leaves_the_rows_until_then_and_no_older_report() {
    let folder = reported();
    let sets = ["duration_s=1e6", "record.every_ticks=1000"];
    let mut run = Command::new(env!("CARGO_BIN_EXE_dimsart"))
        .args(["run", "--set", sets[0], "--set", sets[1], "--out"])
        .arg(folder.path())
        .spawn()
        .unwrap();
    let signals = folder.path().join("signals.csv");
    // The rows of the older report are 1 ms apart, of this run 1 s; in between the file is missing.
    let rows = || {
        let table = csv::Reader::from_path(&signals);
        let rows: Vec<_> = table.map_or(Vec::new(), |table| table.into_records().flatten().collect());
        if rows.get(1).is_some_and(|row| row[0].starts_with("0.")) { 0 } else { rows.len() }
    };
    let start = Instant::now();
    // This run writes each row immediately.
    while (files(folder.path()).len() > 1 || rows() < 5) && start.elapsed() < TEST_TIMEOUT {
        std::thread::sleep(Duration::from_millis(10));
    }
    run.kill().unwrap();
    run.wait().unwrap();
    assert_eq!(files(folder.path()), ["signals.csv"]);
    assert!(rows() >= 5, "{} rows after {:?}", rows(), start.elapsed());
    let mut table = csv::Reader::from_path(&signals).unwrap();
    for (number, row) in table.records().enumerate() {
        let time_s: f64 = row.unwrap()[0].parse().unwrap();
        assert!((time_s - number as f64).abs() < 1e-6, "row {number}, one per second, is of {time_s} s");
    }
}

/// A system limit stops the growth of the file, as a full disk does.
#[cfg(unix)]
#[test]
fn a_disk_that_becomes_full_is_told_with_the_file_and_leaves_whole_rows_and_no_older_report() {
    let folder = reported();
    let run = "ulimit -f 500; trap '' XFSZ; exec \"$0\" run --set duration_s=1 --out \"$1\"";
    let output = Command::new("sh")
        .args(["-c", run, env!("CARGO_BIN_EXE_dimsart")])
        .arg(folder.path())
        .output()
        .unwrap();
    let signals = folder.path().join("signals.csv");
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stdout).contains("perceived stiffness"), "the figures are printed anyway");
    let message = text(&output.stderr);
    assert!(message.contains(&format!("cannot write {}: File too large", signals.display())), "{message}");
    assert!(message.contains("free some space there or choose another folder"), "{message}");
    assert_eq!(files(folder.path()), ["signals.csv"]);
    let rows = csv::Reader::from_path(&signals).unwrap().records().map(Result::unwrap).count();
    assert!((10..1000).contains(&rows), "{rows}");
}

#[cfg(unix)]
#[test]
fn a_reader_that_has_seen_enough_is_no_error() {
    let mut modules =
        Command::new(env!("CARGO_BIN_EXE_dimsart")).arg("modules").stdout(Stdio::piped()).spawn().unwrap();
    drop(modules.stdout.take());
    assert!(modules.wait().unwrap().success());
}

#[test]
fn wrong_usage_ends_with_2_and_shows_the_way() {
    for arguments in [
        ["rnu"].as_slice(),
        &["run", "--side", "middle"],
        &["run", "--wait-s", "5"],
        &["run", "--side", "slave", "--wait-s", "-1"],
        &["check"],
        &["check", "builtin:table1", "--dof", "three"],
        &["new-module"],
    ] {
        let message = refused(arguments, 2);
        assert!(message.contains("--help"), "{arguments:?}: {message}");
    }
}

#[test]
fn every_command_explains_itself_with_examples() {
    let all = out(&["--help"]);
    for command in ["run", "check", "modules", "new-module", "new-project"] {
        assert!(all.contains(&format!("\n  {command}")), "{all}");
        let help = out(&[command, "--help"]);
        assert!(help.contains(&format!("Usage: dimsart {command}")), "{help}");
        assert!(help.contains("Example") || help.contains("In a scheme:"), "{help}");
    }
}

#[test]
fn a_wrong_setting_is_named_with_what_is_right() {
    for (setting, expected) in [
        ("link.los=0.1", "unknown key `link.los`; did you mean `link.loss`?"),
        ("master.device.mass_kg=-1", "`master.device.mass_kg` is -1, must be a finite number > 0"),
        ("master.device.mass_kg=nan", "is nan, must be a finite number > 0"),
        ("dof=0", "`dof` is 0, must be a number from 1 to 8"),
        ("dof=9", "`dof` is 9, must be a number from 1 to 8"),
        ("seed=18446744073709551615", "must be an integer >= 0"),
        ("seed=9007199254740992", "seed is 9007199254740992, must be 0 to 9007199254740991"),
        ("link.loss=lots", "is lots, must be a number from 0 to 1"),
        ("record.signals=['mastr']", "record.signals: unknown name 'mastr'; did you mean 'master'?"),
        ("record.signals=['master.DES_FORC']", "did you mean 'master.DES_FORCE'?"),
        (
            "record.signals=['world', '']",
            "available: master, slave, world; for one signal, write STATION.SIGNAL",
        ),
        ("link.loss", "write key=value"),
        ("master.scheme=no.scheme", "cannot read scheme file no.scheme"),
        ("master.scheme=builtin:tabel1", "builtin:bilateral, "),
        (
            "master.time_delay_ticks=70000",
            "master.time_delay_ticks = 70000 is invalid for TIMEDELAY_MOD TD_PARAM: '70000' is not an integer \
            from 0 to 60000 ticks; change master.time_delay_ticks",
        ),
        ("master.time_delay_ticks=50000", "needs 150000 words of the Data Base, but only "),
        ("environment=sea", "`environment` is sea, must be one of wall, spring, nothing"),
        (
            "slave.stiffness_n_per_m=1e9",
            "slave.stiffness_n_per_m = 1000000000 is invalid for PDCTRL_MOD K_PARAM",
        ),
    ] {
        // Errors that only a scheme or recorder can detect are not usage errors.
        let later = ["record.signals", "master.scheme", "master.time_delay_ticks", "slave.stiffness_n_per_m"];
        let status = if later.iter().any(|key| setting.starts_with(key)) { 1 } else { 2 };
        let message = refused(&["run", "--no-report", "--set", setting], status);
        assert!(message.starts_with("dimsart: ") && message.contains(expected), "{setting}: {message}");
        assert!(!message.contains("has no effect"), "{setting} is wrong, not idle: {message}");
    }
}

#[test]
fn a_rig_file_that_is_wrong_is_named_with_the_place() {
    let message = refused(&["run", "no/such.toml"], 1);
    assert!(message.contains("cannot read the rig file no/such.toml"), "{message}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.toml");
    fs::write(&path, "[link]\nlos = 0.1\n").unwrap();
    let path = path.to_str().unwrap();
    let message = refused(&["run", path], 1);
    let expected = format!("{path}:2:1: unknown key `link.los`; did you mean `link.loss`?");
    assert!(message.contains(&expected), "{message}");
}

#[test]
fn the_printed_keys_are_a_rig_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.toml");
    fs::write(&path, out(&["run", "--keys"])).unwrap();
    let mut printed = RigFile::load(&path, &[]).unwrap();
    // A path in a file is relative to its folder.
    assert_eq!(printed.folder, folder.path());
    printed.folder = PathBuf::new();
    assert_eq!(printed, RigFile::from_shipped("bilateral", &[]).unwrap());
}

#[test]
fn the_modules_are_readable_on_a_terminal_of_100_columns() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dimsart"));
    let list = text(&command.env("COLUMNS", "100").arg("modules").output().unwrap().stdout);
    let out = list + &text(&command.arg("PDCTRL_MOD").output().unwrap().stdout);
    let widest = out.lines().map(|line| line.chars().count()).max().unwrap();
    assert!(widest <= 100, "{widest} columns");
    for expected in [
        "trajectories",
        "PDCTRL_MOD: ",
        "K_PARAM",
        "N/m or N·m/rad",
        "0 to 1000000, per axis",
        "reads DES_POSITION",
    ] {
        assert!(out.contains(expected), "{expected} is missing");
    }
    let message = refused(&["modules", "PDCTL_MOD"], 1);
    assert!(message.contains("unknown module or group 'PDCTL_MOD'; did you mean 'PDCTRL_MOD'?"), "{message}");
}

#[test]
fn modules_and_messages_are_printed_as_json() {
    let json = |arguments: &[&str]| serde_json::from_str::<serde_json::Value>(&out(arguments)).unwrap();
    let all = json(&["modules", "--json"]);
    assert!(all.as_array().unwrap().len() > 10, "{all}");
    let one = json(&["modules", "PDCTRL_MOD", "--json"]);
    assert_eq!((&one[0]["name"], one.as_array().unwrap().len()), (&"PDCTRL_MOD".into(), 1));
    let parameters = one[0]["parameters"].as_array().unwrap();
    let stiffness = parameters.iter().find(|parameter| parameter["name"] == "K_PARAM").unwrap();
    assert_eq!(stiffness["unit"], "N/m or N·m/rad");
    let dbc = json(&["dbc", "builtin:bilateral", "--json"]);
    assert_eq!(
        (&dbc["messages"][0]["sender"], &dbc["messages"][0]["frames"]),
        (&"master".into(), &"can-fd".into())
    );
}

#[test]
fn the_page_of_the_modules_is_what_they_say_of_themselves() {
    let page = include_str!("../../docs/modules.md");
    assert!(
        page == out(&["modules", "--markdown"]),
        "docs/modules.md is out of date; run `cargo run -- modules --markdown > docs/modules.md` at the top"
    );
}

#[test]
fn a_new_module_is_written_once_and_never_over_another_file() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path().to_str().unwrap();
    let printed = out(&["new-module", "damped-spring", "--folder", here]);
    for line in ["pub mod damped_spring;", "pub use damped_spring::DampedSpring;", "\n  DampedSpring,"] {
        assert!(printed.contains(line), "{printed}");
    }
    let file = folder.path().join("damped_spring.rs");
    assert!(fs::read_to_string(&file).unwrap().contains("impl Module for DampedSpring"));
    fs::write(&file, "my own work").unwrap();
    let message = refused(&["new-module", "damped-spring", "--folder", here], 1);
    assert!(message.contains("no file was changed: choose another name"), "{message}");
    assert_eq!(fs::read_to_string(&file).unwrap(), "my own work");
    let message = refused(&["new-module", "spring", "--folder", "no/such/folder"], 1);
    assert!(message.contains("give another --folder"), "{message}");
    assert!(refused(&["new-module", "9x"], 1).contains("invalid module name '9x'"));
}

/// `cargo xtask test` checks that the created project compiles and passes its tests.
#[test]
fn a_project_has_its_law_and_takes_more() {
    let folder = tempfile::tempdir().unwrap();
    let dimsart = |inside: &str, arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_dimsart"));
        let output = command.args(arguments).current_dir(folder.path().join(inside)).output().unwrap();
        let text = [output.stdout, output.stderr].concat();
        (output.status.code(), String::from_utf8(text).unwrap())
    };
    let (status, said) = dimsart("", &["new-project", "gripper", "--law", "grip-force"]);
    assert!(status == Some(0) && said.contains("cargo dimsart run scenarios/grip_force.toml"), "{said}");
    let read = |path: &str| fs::read_to_string(folder.path().join("gripper").join(path)).unwrap();
    assert!(read("src/modules/grip_force.rs").contains("\"GRIP_FORCE_MOD\""));
    let list = read("src/modules/mod.rs");
    assert!(list.contains("    GripForce,\n"), "{list}");
    let all =
        ["Cargo.toml", ".cargo/config.toml", "README.md", "tests/grip_force.rs", "schemes/grip_force.scheme"];
    for text in all.map(read) {
        assert!(!["template", "PROJECT", "HIL_SIM"].iter().any(|left| text.contains(left)), "{text}");
    }
    let (status, said) = dimsart("gripper", &["new-module", "approach"]);
    assert!(status == Some(0) && said.contains("cargo test --test approach"), "{said}");
    let longer = read("src/modules/mod.rs");
    assert!(longer.contains("pub mod approach;\npub mod grip_force;\n"), "{longer}");
    let (status, said) = dimsart("gripper", &["new-module", "approach"]);
    assert!(status == Some(1) && said.contains("no file was changed"), "{said}");
    assert_eq!(read("src/modules/mod.rs"), longer);
    let (status, said) = dimsart("", &["new-project", "gripper"]);
    assert!(status == Some(1) && said.contains("already exists"), "{said}");
    let (status, said) = dimsart("", &["new-module", "approach"]);
    assert!(status == Some(1) && said.contains("dimsart new-project"), "{said}");
}

#[cfg(not(feature = "zenoh"))]
#[test]
fn a_build_without_zenoh_says_how_to_build_the_bridge() {
    assert!(
        refused(&["bridge", "sim:joint"], 1).contains("cargo build --release -p dimsart --features zenoh")
    );
    assert!(out(&["bridge", "--help"]).contains("--router"));
}

#[cfg(unix)]
#[test]
fn bash_completes_commands() {
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("dimsart.bash");
    fs::write(&script, out(&["completions", "bash"])).unwrap();
    // As bash does when a user presses Tab after `dimsart rep`.
    let asked = "source \"$1\"; COMP_WORDS=(dimsart rep); COMP_CWORD=1; _dimsart dimsart rep dimsart; echo \
    \"${COMPREPLY[@]}\"";
    let Ok(output) = Command::new("bash").args(["-c", asked, "bash"]).arg(&script).output() else {
        eprintln!("skipped: no bash to test its completion");
        return;
    };
    assert_eq!(text(&output.stdout).trim(), "replay", "{}", text(&output.stderr));
    assert!(refused(&["completions", "cmd"], 2).contains("bash"));
}

#[test]
fn every_command_has_a_page_of_the_manual_with_its_options() {
    let folder = tempfile::tempdir().unwrap();
    let pages = folder.path().join("man1");
    out(&["man", "--out", pages.to_str().unwrap()]);
    let help = out(&["help"]);
    let (_, commands) = help.split_once("Commands:\n").unwrap();
    let names = commands.lines().take_while(|line| !line.is_empty()).filter(|line| !line.starts_with("   "));
    let names: Vec<&str> =
        names.filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help").collect();
    assert!(names.len() > 15, "{names:?}");
    for name in names {
        let page = fs::read_to_string(pages.join(format!("dimsart-{name}.1"))).unwrap().replace('\\', "");
        let help = out(&[name, "--help"]);
        let options = help.lines().filter(|line| line.trim_start().starts_with('-'));
        let long = options.flat_map(str::split_whitespace).filter(|word| word.starts_with("--"));
        for option in long.map(|word| word.trim_end_matches(|end: char| !end.is_ascii_alphanumeric())) {
            assert!(page.contains(option), "{option} is not in the page of {name}");
        }
    }
    assert!(
        fs::read_to_string(pages.join("dimsart-run.1"))
            .unwrap()
            .replace('\\', "")
            .contains("--fail-if-unstable")
    );
    assert!(pages.join("dimsart-connect-arm.1").exists());
}

#[test]
fn a_wrong_word_is_answered_with_the_right_one() {
    for (arguments, status, expected) in [
        (
            &["run", "joint", "--set", "device.joint.plant.inertia=1"][..],
            2,
            "did you mean `device.joint.axis.0.plant.",
        ),
        (&["run", "joint", "--set", "link.loss=0.1"], 2, "the file has no [[link]]"),
        (&["identify", "nofile.csv"], 1, "cannot read nofile.csv"),
        (&["connect", "joint"], 1, "sim:NAME"),
        (&["modules", "pid"], 1, "PIDCTRL_MOD"),
    ] {
        let output = dimsart(arguments);
        let printed = text(&output.stderr);
        assert!(printed.contains(expected), "{arguments:?}: {printed}");
        assert_eq!(output.status.code(), Some(status), "{arguments:?}: {printed}");
    }
    assert!(out(&["connect", "--help"]).contains("sim:NAME"));
}
