//! `dimsart doctor` with installed, outdated or missing programs.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;

/// A folder of programs with fixed output.
struct Programs(tempfile::TempDir);

impl Programs {
    fn new(programs: &[(&str, &str)]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for (name, prints) in programs {
            let path = folder.path().join(name);
            fs::write(&path, format!("#!/bin/sh\nprintf '{prints}\\n'\n")).unwrap();
            fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
        }
        Self(folder)
    }

    /// Returns the exit status, and the line about `what`.
    fn doctor(&self, what: &str) -> (Option<i32>, String) {
        let mut doctor = Command::new(env!("CARGO_BIN_EXE_dimsart"));
        let output = doctor.arg("doctor").env("PATH", self.0.path()).output().unwrap();
        let out = String::from_utf8(output.stdout).unwrap();
        assert_eq!(out.lines().count(), 5, "{out}");
        let line = out.lines().find(|line| line.contains(&format!("  {what}: "))).unwrap();
        (output.status.code(), line.to_owned())
    }
}

const QEMU: (&str, &str) = ("qemu-system-arm", "QEMU emulator version 10.0.2 (Debian)\\nmps2-an386  ARM");

#[test]
fn what_is_missing_is_named_with_the_next_step() {
    let programs = Programs::new(&[]);
    for (what, step) in [
        (
            "emulator",
            "qemu-system-arm not found: install QEMU 7.2 or later (Debian: apt-get install qemu-system-arm)",
        ),
        ("probe-rs", "not installed: run `cargo install probe-rs-tools --locked`"),
        ("probe", "needs probe-rs: run `cargo install probe-rs-tools --locked`"),
    ] {
        assert_eq!(programs.doctor(what), (Some(1), format!("missing  {what}: {step}")));
    }
    let (_, line) = programs.doctor("compiler");
    let is_debian = Path::new("/usr/lib/rustlib/src/rust/library/core").is_dir();
    assert!(line.starts_with(if is_debian { "ok " } else { "missing " }), "{line}");
    assert!(is_debian || line.contains("rustup target add thumbv7em-none-eabihf"), "{line}");
}

#[test]
fn the_findings_are_printed_as_json() {
    let programs = Programs::new(&[QEMU]);
    let mut doctor = Command::new(env!("CARGO_BIN_EXE_dimsart"));
    let output = doctor.args(["doctor", "--json"]).env("PATH", programs.0.path()).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["is_well"], false);
    assert_eq!(
        (&json["things"][1]["name"], &json["things"][1]["is_there"]),
        (&"emulator".into(), &true.into())
    );
    assert!(
        json["things"][2]["finding"].as_str().unwrap().contains("cargo install probe-rs-tools"),
        "{json}"
    );
}

#[test]
fn what_is_there_is_named_with_its_version() {
    let programs = Programs::new(&[QEMU, ("rustc", "/"), ("probe-rs", "probe-rs 0.32.1 (git commit: 1)")]);
    let found = |what| programs.doctor(what).1;
    assert_eq!(found("compiler"), "ok       compiler: target thumbv7em-none-eabihf");
    assert_eq!(found("emulator"), "ok       emulator: QEMU emulator version 10.0.2 (Debian)");
    assert_eq!(found("probe-rs"), "ok       probe-rs: probe-rs 0.32.1 (git commit: 1)");
    assert_eq!(found("probe"), "missing  probe: not found: connect the board's debug port by USB");
}

#[test]
fn what_is_too_old_counts_as_missing() {
    let old_qemu = ("qemu-system-arm", "QEMU emulator version 6.2.15\\nmps2-an386");
    let programs = Programs::new(&[old_qemu, ("probe-rs", "probe-rs 0.9.0")]);
    for (what, version) in [("emulator", "QEMU emulator version 6.2.15"), ("probe-rs", "probe-rs 0.9.0")] {
        let (status, line) = programs.doctor(what);
        assert_eq!(status, Some(1));
        assert!(line.starts_with(&format!("missing  {what}: {version} is too old: ")), "{line}");
    }
}

#[test]
fn a_connected_probe_is_shown() {
    let list = "The following debug probes were found:\\n[0]: STLink V3 -- 0483:374e (ST-LINK)";
    let (_, line) = Programs::new(&[("probe-rs", list)]).doctor("probe");
    assert_eq!(line, "ok       probe: [0]: STLink V3 -- 0483:374e (ST-LINK)");
}
