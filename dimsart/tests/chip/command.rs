//! Tests of `dimsart emulate` from the user's view.

use std::io::{BufRead as _, BufReader};
use std::process::{Child, Command, Output, Stdio};

use chips::BOARDS;

fn dimsart() -> Command {
    Command::new(env!("CARGO_BIN_EXE_dimsart"))
}

/// An emulated board as a separate process.
struct Emulator {
    process: Child,
    said: String,
    port: String,
}

impl Emulator {
    fn start(name: &str) -> Option<Self> {
        let image = test_requirements::image(name)?;
        let mut process =
            dimsart().args(["emulate", name]).arg(&image).stdout(Stdio::piped()).spawn().unwrap();
        let mut said = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut said).unwrap();
        Some(Self { process, said, port: format!("sim:{name}") })
    }

    fn ask(&self, arguments: &[&str]) -> Output {
        dimsart().args(arguments).output().unwrap()
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

#[test]
fn an_image_runs_alone_and_is_judged() {
    for board in BOARDS {
        let Some(image) = test_requirements::image(board.name) else { return };
        let output = dimsart().args(["emulate", board.name]).arg(&image).args(["--seconds", "0.2"]).output();
        let output = output.unwrap();
        let out = String::from_utf8(output.stdout).unwrap();
        assert!(output.status.success(), "{out}");
        assert!(out.ends_with("no rule broken, no fault, no reset\n"), "{out}");
    }
}

#[test]
fn its_command_line_is_a_port_for_other_commands() {
    let name = "nucleo-g474re";
    let Some(emulator) = Emulator::start(name) else { return };
    let output = emulator.ask(&["connect", &emulator.port, "--timeout-s", "20", "show"]);
    let (line, out) = (&emulator.said, String::from_utf8(output.stdout).unwrap());
    assert!(line.contains("runs until Ctrl-C"), "{line}");
    assert!(out.contains(name), "{out}");
}

#[test]
fn an_image_of_another_board_is_refused() {
    let Some(image) = test_requirements::image("nucleo-g474re") else { return };
    let output =
        dimsart().args(["emulate", "b-g431b-esc1"]).arg(&image).args(["--seconds", "1"]).output().unwrap();
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(error.contains("b-g431b-esc1") && error.contains("nucleo-g474re"), "{error}");
}

#[test]
fn a_board_s_motor_is_shown_set_and_forgotten_as_text() {
    let Some(emulator) = Emulator::start("b-g431b-esc1") else { return };
    let folder = tempfile::tempdir().unwrap();
    let motor = |action: &str, text: Option<&str>| {
        let file = folder.path().join("motor.toml");
        let mut arguments = vec!["motor", action, &emulator.port, "--timeout-s", "20"];
        if let Some(text) = text {
            std::fs::write(&file, text).unwrap();
            arguments.push(file.to_str().unwrap());
        }
        let Output { status, stdout, stderr } = emulator.ask(&arguments);
        (status.success(), String::from_utf8(stdout).unwrap(), String::from_utf8(stderr).unwrap())
    };
    let (is_shown, text, error) = motor("show", None);
    assert!(is_shown && text.contains("of the image, none is stored"), "{text}{error}");

    let geared = text.replace("gear_ratio = 1.0 ", "gear_ratio = 6.0 ");
    let (is_set, said, error) = motor("set", Some(&geared));
    assert!(
        is_set && said.contains("joint.gear_ratio: 1.0 -> 6.0") && said.contains("restart"),
        "{said}{error}"
    );
    for (from, to, expected) in [
        ("\ntrip_current_a = 10.0", "\ntrip_current_a = 1.0", "above limits.current_a"),
        ("\npole_pairs = 7", "\npole_pears = 7", "pole_pears"),
    ] {
        let (is_set, _, error) = motor("set", Some(&text.replace(from, to)));
        assert!(!is_set && error.contains(expected), "{error}");
    }
    let (is_forgotten, said, error) = motor("forget", None);
    assert!(is_forgotten && said.contains("the image's configuration"), "{said}{error}");
}
