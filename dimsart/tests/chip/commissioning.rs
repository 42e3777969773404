//! Commissioning checks of a board, with an emulated chip.

use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::{Arc, Mutex};

use chips::SharedBoard;
use dimsart::commissioning::{BoardEnvironment, Check, LockedRotor, Verdict, examine};
use dimsart::connect::Device;

use crate::common::{CommandLine, PATIENCE, bench};
use crate::drive::aligned;
use crate::motor::Powered;

/// A folder for the report of a test.
fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("commission").join(name)
}

fn commission(board: &str, image: &Path, folder: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dimsart"));
    command.args(["commission", board, "--seconds", "0.5", "--emulated"]).arg(image);
    command.arg("--out").arg(folder).output().unwrap()
}

/// The checks of a report by name.
fn checks(folder: &Path) -> Vec<(String, String)> {
    let json = std::fs::read_to_string(folder.join("report.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let text = |value: &serde_json::Value| value.as_str().unwrap().to_owned();
    let checks = json["checks"].as_array().unwrap().iter();
    checks.map(|check| (text(&check["name"]), text(&check["verdict"]))).collect()
}

fn names(checks: &[(String, String)], wanted: &str) -> Vec<String> {
    checks.iter().filter(|(_, verdict)| verdict == wanted).map(|(name, _)| name.clone()).collect()
}

#[test]
fn all_of_a_board_is_checked_but_for_what_needs_silicon() {
    for name in ["nucleo-g474re", "b-g431b-esc1"] {
        let Some(image) = test_requirements::image(name) else { return };
        let folder = folder(name);
        let output = commission(name, &image, &folder);
        let checks = checks(&folder);
        // Images may be unstamped in tests.
        let is_stamped = !String::from_utf8_lossy(&output.stdout).contains("unstamped");
        let failed = names(&checks, "failed");
        assert_eq!(failed, if is_stamped { vec![] } else { vec!["image"] }, "{output:?}");
        assert_eq!(output.status.code(), Some(if is_stamped { 0 } else { 1 }));
        let passed = names(&checks, "passed");
        for wanted in [
            "tick rate over 1 s",
            "jitter of the tick over 1 s",
            "save, restart, confirm",
            "encoders",
            "rules of the chip",
        ] {
            assert!(passed.iter().any(|name| name == wanted), "{name} lacks {wanted}: {checks:?}");
        }
        let report = std::fs::read_to_string(folder.join("report.md")).unwrap();
        assert!(report.contains("not on a real board"), "{report}");
        assert!(report.contains("Jitter of the tick period:\n\n```text\n"), "{report}");
    }
}

#[test]
fn an_image_without_a_stamp_fails_and_so_does_another_board() {
    let (nucleo, esc) = ("nucleo-g474re", "b-g431b-esc1");
    let Some(plain) = test_requirements::image(nucleo) else { return };
    // A missing stamp: the name of its memory shows that there are costs.
    let mut bytes = std::fs::read(&plain).unwrap();
    let stamp = bytes.windows(8).position(|bytes| bytes == b"DIMSTAMP").unwrap();
    bytes[stamp + 32..stamp + 48].fill(0);
    let folder = folder("unstamped");
    std::fs::create_dir_all(&folder).unwrap();
    let unstamped = folder.join("image");
    std::fs::write(&unstamped, bytes).unwrap();
    let output = commission(nucleo, &unstamped, &folder);
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(names(&checks(&folder), "failed"), ["image"], "{output:?}");
    let refused = commission(esc, &plain, &folder);
    assert_eq!(refused.status.code(), Some(1));
    let report = std::fs::read_to_string(folder.join("report.md")).unwrap();
    assert!(report.starts_with("# b-g431b-esc1: FAILED") && report.contains(nucleo), "{report}");
}

/// Examines a board in an emulated chip with a fault.
fn examined(spoil: impl FnOnce(&mut Device<CommandLine>, &mut SharedBoard)) -> Option<Vec<Check>> {
    let mut around = SharedBoard::new(bench("nucleo-g474re")?);
    let mut device = Device::identify(around.line(), PATIENCE, dimsart_modules::ALL).unwrap();
    spoil(&mut device, &mut around);
    Some(examine(&mut device, &around, Some("nucleo-g474re")).unwrap())
}

#[track_caller]
fn assert_failed(checks: &[Check], name: &str, found: &str) {
    let check = checks.iter().find(|check| check.name == name).unwrap();
    assert_eq!(check.verdict, Verdict::Failed, "{check}");
    assert!(check.found.contains(found) && !check.remedy.is_empty(), "{check}");
}

#[test]
fn a_scheme_on_trial_and_a_crystal_of_another_frequency_are_told() {
    let Some(checks) = examined(|device, around| {
        device.save().unwrap();
        around.restart().unwrap();
        around.bench().run_for(0.1).unwrap();
    }) else {
        return;
    };
    assert_failed(&checks, "scheme", "on trial");
    let checks = examined(|_, around| {
        let mut bench = around.bench();
        bench.chip().set_crystal(Some(24.2e6));
        bench.reset();
        bench.run_for(0.1).unwrap();
    });
    // 0.8 % too fast.
    assert_failed(&checks.unwrap(), "tick rate over 1 s", "10");
}

/// The command line of a board with a motor.
#[derive(Clone)]
struct Line {
    powered: Arc<Mutex<Powered>>,
}

impl Read for Line {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut powered = self.powered.lock().unwrap();
        if powered.received.is_empty() {
            powered.run_for(1e-3);
        }
        if powered.received.is_empty() {
            return Err(ErrorKind::WouldBlock.into());
        }
        let count = buffer.len().min(powered.received.len());
        for (place, byte) in buffer.iter_mut().zip(powered.received.drain(..count)) {
            *place = byte;
        }
        Ok(count)
    }
}

impl Write for Line {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.powered.lock().unwrap().bench.send(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl BoardEnvironment for Line {
    fn now_s(&self) -> f64 {
        self.powered.lock().unwrap().time_s()
    }

    fn keeps_time(&self) -> bool {
        true
    }

    fn can_restart(&self) -> bool {
        false
    }

    fn restart(&mut self) -> Result<(), String> {
        Err("no user in this test".to_owned())
    }
}

#[test]
fn a_step_of_the_torque_on_a_locked_rotor_shows_the_motor_s_torque_constant() {
    let Some((mut powered, _)) = aligned() else { return };
    powered.lock(true);
    powered.received.clear();
    // The lease for the alignment ends.
    powered.run_for(0.3);
    powered.received.clear();
    let line = Line { powered: Arc::new(Mutex::new(powered)) };
    let mut device = Device::identify(line.clone(), PATIENCE, dimsart_modules::ALL).unwrap();
    let before = LockedRotor::load_zero_torque_scheme(&mut device).unwrap();
    let right = LockedRotor { torque_nm: 0.05, torque_constant_nm_per_a: 0.05 };
    let (check, step) = right.step(&mut device, &line).unwrap();
    assert_eq!(check.verdict, Verdict::Passed, "{check}");
    let (_, recording) = step.picture();
    let max_a = recording.column(1).fold(0.0, f64::max);
    assert!((0.9..1.3).contains(&max_a), "{max_a} A");
    // A motor with another torque constant than configured.
    let wrong = LockedRotor { torque_constant_nm_per_a: 0.06, ..right };
    let (check, _) = wrong.step(&mut device, &line).unwrap();
    assert_eq!(check.verdict, Verdict::Failed, "{check}");
    // A free rotor.
    line.powered.lock().unwrap().lock(false);
    let (check, _) = right.step(&mut device, &line).unwrap();
    assert!(check.verdict == Verdict::Failed && check.remedy.contains("the rotor turned"), "{check}");
    assert!(!line.powered.lock().unwrap().is_on(), "the lease was not released");
    LockedRotor::restore_scheme(&mut device, &before).unwrap();
    assert_eq!(device.scheme_rows(None).unwrap(), before);
}
