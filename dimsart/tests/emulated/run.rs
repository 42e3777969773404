//! Tests of `dimsart run --target mps2-an386` from the user's view.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use crate::common::image;

fn dimsart() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dimsart"));
    command.arg("run");
    command
}

/// Figures without wall-clock times.
fn figures(command: &mut Command) -> serde_json::Value {
    let output = command.arg("--json").output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).unwrap();
    let mut figures: serde_json::Value = serde_json::from_str(text.lines().last().unwrap()).unwrap();
    for of_the_clock in ["wall_s", "realtime_factor"] {
        figures.as_object_mut().unwrap().remove(of_the_clock);
    }
    figures
}

#[test]
fn figures_and_report_are_those_of_a_run_on_the_host() {
    let Some(image) = image() else { return };
    let folder = tempfile::tempdir().unwrap();
    let [here, there] = ["here", "there"].map(|name| folder.path().join(name));
    let expected = figures(dimsart().arg("--out").arg(&here));
    for side in ["master", "slave", "both"] {
        let target = ["--target", "mps2-an386", "--target-side", side, "--image"];
        let found = figures(dimsart().args(target).arg(image.path()).arg("--out").arg(&there));
        assert_eq!(found, expected, "{side}");
        for file in ["signals.csv", "positions.svg", "timeline.svg"] {
            assert!(
                fs::read(here.join(file)).unwrap() == fs::read(there.join(file)).unwrap(),
                "{side}: {file}"
            );
        }
    }
    for side in ["master", "slave"] {
        let log = fs::read_to_string(there.join(format!("firmware-{side}.log"))).unwrap();
        assert!(log.contains("tick 9000: Ran, 0 late, 0 overruns"), "{log}");
    }
}

#[test]
fn an_interrupt_ends_the_run_and_its_emulators() {
    let Some(image) = image() else { return };
    let folder = tempfile::tempdir().unwrap();
    let child = dimsart()
        .args(["--target", "mps2-an386", "--no-report", "--set", "duration_s=1e6", "--image"])
        .arg(image.path())
        .env("TMPDIR", folder.path())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let id = child.id().to_string();
    let emulators = || {
        let listed = Command::new("ps").args(["-o", "pid=", "--ppid", &id]).output().unwrap();
        String::from_utf8(listed.stdout).unwrap().split_whitespace().map(str::to_owned).collect::<Vec<_>>()
    };
    // Stopped during the setup or during the run: it ends in both cases.
    wait_until("no emulator starts", || !emulators().is_empty());
    let started = emulators();
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && text.contains("run stopped by the user at"), "{output:?}");
    let is_left = |pid: &String| Path::new("/proc").join(pid).exists();
    assert!(!started.iter().any(is_left), "a process is still running");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "a temporary folder remains");
}

#[test]
fn a_run_that_is_killed_at_its_start_leaves_no_emulator() {
    let Some(image) = image() else { return };
    for delay_ms in (0..60).step_by(5) {
        let folder = tempfile::tempdir().unwrap();
        let mut run = dimsart()
            .args(["--target", "mps2-an386", "--no-report", "--set", "duration_s=1e6", "--image"])
            .arg(image.path())
            .env("TMPDIR", folder.path())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        wait_until("no emulator starts", || are_emulators_in(folder.path()));
        thread::sleep(Duration::from_millis(delay_ms));
        run.kill().unwrap();
        run.wait().unwrap();
        let left = format!("an emulator is still running after a kill {delay_ms} ms after its start");
        wait_until(&left, || !are_emulators_in(folder.path()));
    }
}

/// Returns whether a process uses one of the folders in `folder`, removed or not.
pub(crate) fn are_emulators_in(folder: &Path) -> bool {
    let processes = fs::read_dir("/proc").unwrap().flatten();
    let mut works_in = processes.filter_map(|process| fs::read_link(process.path().join("cwd")).ok());
    works_in.any(|works_in| works_in.starts_with(folder))
}

fn wait_until(or_else: &str, is_so: impl Fn() -> bool) {
    test_requirements::wait_until(|| or_else.to_owned(), is_so);
}
