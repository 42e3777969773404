//! `dimsart emulate`, as its user meets it.

use std::io::{BufRead as _, BufReader};
use std::process::{Command, Stdio};

use chips::BOARDS;

use crate::common::image_file;

fn dimsart() -> Command {
    Command::new(env!("CARGO_BIN_EXE_dimsart"))
}

#[test]
fn an_image_runs_alone_and_is_judged() {
    for board in BOARDS {
        let Some(image) = image_file(board.name) else { return };
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
    let Some(image) = image_file(name) else { return };
    let mut emulator = dimsart().args(["emulate", name]).arg(&image).stdout(Stdio::piped()).spawn().unwrap();
    let mut line = String::new();
    BufReader::new(emulator.stdout.take().unwrap()).read_line(&mut line).unwrap();
    let output = dimsart().args(["connect", &format!("sim:{name}"), "--timeout-s", "20", "show"]).output();
    emulator.kill().unwrap();
    emulator.wait().unwrap();
    let out = String::from_utf8(output.unwrap().stdout).unwrap();
    assert!(line.contains("runs until Ctrl-C"), "{line}");
    assert!(out.contains(name), "{out}");
}

#[test]
fn an_image_of_another_board_is_refused() {
    let Some(image) = image_file("nucleo-g474re") else { return };
    let output =
        dimsart().args(["emulate", "b-g431b-esc1"]).arg(&image).args(["--seconds", "1"]).output().unwrap();
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(error.contains("b-g431b-esc1") && error.contains("nucleo-g474re"), "{error}");
}
