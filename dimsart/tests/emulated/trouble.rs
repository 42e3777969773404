//! Faults of an emulator, simulated by a script.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use tempfile::TempDir;
use test_requirements::TEST_TIMEOUT;

/// A folder with a stand-in for the emulator, an image by name, and temporary files.
struct Stage(TempDir);

impl Stage {
    fn new(script: Option<&str>) -> Self {
        let stage = Self(tempfile::tempdir().unwrap());
        fs::create_dir(stage.path("bin")).unwrap();
        fs::create_dir(stage.path("tmp")).unwrap();
        fs::write(stage.path("image"), format!("dimsart {} mps2-an386", env!("CARGO_PKG_VERSION"))).unwrap();
        if let Some(script) = script {
            let emulator = stage.path("bin/qemu-system-arm");
            let pid = stage.path("pid");
            fs::write(&emulator, format!("#!/bin/sh\necho $$ > {}\n{script}\n", pid.display())).unwrap();
            fs::set_permissions(emulator, fs::Permissions::from_mode(0o755)).unwrap();
        }
        stage
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Returns the message of a failed run, which leaves no files.
    fn run(&self, image: &Path) -> String {
        let start = Instant::now();
        let output = self.command(image).output().unwrap();
        assert!(start.elapsed() < TEST_TIMEOUT);
        self.assert_clean();
        message(&output)
    }

    fn command(&self, image: &Path) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_dimsart"));
        command.args(["run", "--no-report", "--target", "mps2-an386", "--image"]).arg(image);
        command.env("PATH", self.path("bin")).env("TMPDIR", self.path("tmp"));
        command
    }

    fn assert_clean(&self) {
        assert_eq!(fs::read_dir(self.path("tmp")).unwrap().count(), 0, "a temporary folder remains");
        if let Ok(pid) = fs::read_to_string(self.path("pid")) {
            assert!(!Path::new("/proc").join(pid.trim()).exists(), "a process is still running");
        }
    }
}

/// Uses a script as emulator; its folder contains the FIFOs.
fn run_with(script: &str) -> String {
    let stage = Stage::new(Some(script));
    stage.run(&stage.path("image"))
}

fn message(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    String::from_utf8(output.stderr.clone()).unwrap()
}

fn assert_says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "{part}: {message}");
    }
}

#[test]
fn without_an_emulator_it_says_what_to_install() {
    let stage = Stage::new(None);
    assert_says(
        &stage.run(&stage.path("image")),
        &["cannot start the emulator qemu-system-arm", "install it"],
    );
}

#[test]
fn without_an_image_or_with_another_board_s_it_says_how_to_build_one() {
    let stage = Stage::new(None);
    assert_says(&stage.run(&stage.path("none")), &["not found", "cargo board mps2-an386", "--image"]);
    let another = stage.path("another");
    fs::write(&another, "dimsart 0.1.0 nucleo-g474re").unwrap();
    assert_says(&stage.run(&another), &["another is not an image of dimsart", "cargo board mps2-an386"]);
    let timer = format!("dimsart {} mps2-an386+panic-text+timer-tick", env!("CARGO_PKG_VERSION"));
    fs::write(&another, timer).unwrap();
    assert_says(&stage.run(&another), &["another is not an image of dimsart"]);
}

#[test]
fn an_emulator_that_hangs_is_ended() {
    // Before and after it opens the line.
    assert_says(&run_with("exec /bin/sleep 100"), &["timed out after 8 s"]);
    assert_says(&run_with("exec /bin/sleep 100 < to-board > from-board"), &["timed out after 8 s"]);
}

#[test]
fn who_cannot_wait_for_an_emulator_that_hangs_leaves_nothing_behind() {
    for signal in ["-INT", "-TERM"] {
        let stage = Stage::new(Some("exec /bin/sleep 100"));
        let mut run = stage.command(&stage.path("image")).stderr(Stdio::null()).spawn().unwrap();
        while fs::read_to_string(stage.path("pid")).unwrap_or_default().is_empty() {
            thread::sleep(Duration::from_millis(10));
        }
        let start = Instant::now();
        for _ in 0..2 {
            let id = run.id().to_string();
            assert!(Command::new("kill").args([signal, &id]).status().unwrap().success());
            thread::sleep(Duration::from_millis(300));
        }
        assert!(!run.wait().unwrap().success());
        assert!(start.elapsed() < TEST_TIMEOUT, "process still running after signal {signal}");
        stage.assert_clean();
    }
}

#[test]
fn an_emulator_that_ends_is_reported_with_its_last_words() {
    let message = run_with("echo no such machine >&2; exit 1");
    assert_says(&message, &["exited: exit status: 1", "end of the firmware's log:\n  no such machine"]);
    let panicked = "exec < to-board; exec > from-board; exit 101";
    assert_says(
        &run_with(panicked),
        &["panic, fault or watchdog reset (exit status 101); the firmware's log is empty"],
    );
}

#[test]
fn garbage_is_told_from_an_answer() {
    let answer = |bytes: &str| {
        run_with(&format!("exec 3< to-board; exec 4> from-board; printf '{bytes}' >&4; exec /bin/sleep 100"))
    };
    assert_says(&answer(r"\377\377garbage"), &["frame of 65537 bytes", "rebuild the image"]);
    assert_says(&answer(r"\004\000\143\001\000x"), &["unknown frame section 99"]);
    assert_says(&answer(r"\004\000\002\001\000\001"), &["uses version 1 of the exchange"]);
}
