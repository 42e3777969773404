//! Recorder files of a simulated run are next to its signals, and contain the same values.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "a failed unwrap is a failed test")]

use std::fs;
use std::net::UdpSocket;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

const BILATERAL: &str = include_str!("../../schemes/bilateral.scheme");
const JOINT: &str = include_str!("../../scenarios/joint.toml");
const JOINT_SCHEME: &str = include_str!("../../schemes/joint.scheme");
const START: &str = "MOD_ENG        MATCHING_CHECK";

/// A scheme with an additional recorder of this number of rows of a signal.
fn with_recorder(scheme: &str, signal: &str, length: u32) -> String {
    let rows = format!(
        "RECORDER_MOD LENGTH {length}\nall RECORDER_MOD PORT_SIGNAL_IN {signal}\nall MOD_ENG MOD_ON RECORDER_MOD\n"
    );
    let kept: Vec<&str> = scheme.lines().filter(|line| !line.ends_with("MATCHING_CHECK")).collect();
    format!("{}\nall {rows}all {START}\n", kept.join("\n"))
}

fn start(folder: &Path, arguments: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dimsart"));
    let command = command.current_dir(folder).args(arguments);
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

fn printed(process: Child) -> String {
    let Output { status, stdout, stderr } = process.wait_with_output().unwrap();
    let [out, errors] = [stdout, stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    assert!(status.success(), "{out}{errors}");
    out
}

fn run(folder: &Path, arguments: &[&str]) -> String {
    printed(start(folder, arguments))
}

/// Returns the columns of a file whose names start with `prefix`, as bits of their numbers.
fn columns(path: &Path, prefix: &str) -> Vec<Vec<u32>> {
    let text = fs::read_to_string(path).unwrap();
    let names: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let is_meant = |place: &usize| names[*place].starts_with(prefix);
    let meant: Vec<usize> = (0..names.len()).filter(is_meant).collect();
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        meant.iter().map(|place| cells[*place].parse::<f32>().unwrap().to_bits()).collect()
    };
    text.lines().skip(1).map(row).collect()
}

/// Checks that a controller's recorder file is equal to the end of its signals.
fn assert_same(folder: &Path, controller: &str, signal: &str, length: usize) {
    // A column has the same name in both.
    let name = format!("{controller}.{signal}[");
    let recorded = columns(&folder.join(format!("recorder_{controller}_RECORDER_MOD.csv")), &name);
    let signals = columns(&folder.join("signals.csv"), &name);
    assert_eq!(recorded.len(), length);
    assert!(recorded == signals[signals.len() - length..], "{controller}");
    assert!(recorded.concat().iter().any(|bits| *bits != 0), "{controller}: only zeros");
}

#[test]
fn a_rigs_recorder_has_its_file_until_a_run_without_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::write(path.join("my.scheme"), with_recorder(JOINT_SCHEME, "DES_FORCE", 300)).unwrap();
    fs::write(path.join("my.toml"), JOINT.replace("builtin:joint", "my.scheme")).unwrap();
    let out = run(path, &["run", "my.toml", "--out", "out"]);
    assert_same(&path.join("out"), "joint", "DES_FORCE", 300);
    let content = "300 rows of DES_FORCE, numbered 1300 to 1599";
    let name = "recorder_joint_RECORDER_MOD.csv";
    assert!(out.contains(&format!("\nrecorder: out/{name}: {content}\n")), "{out}");
    let page = fs::read_to_string(path.join("out/report.html")).unwrap();
    assert!(page.contains(&format!("<a href=\"{name}\">{name}</a>: {content}.")), "{page}");

    fs::write(path.join("out/recorder_notes.csv"), "not of a run").unwrap();
    let out = run(path, &["run", "joint", "--out", "out"]);
    assert!(!out.contains("recorder: ") && !path.join("out").join(name).exists(), "{out}");
    assert!(path.join("out/recorder_notes.csv").exists());
}

#[test]
fn both_sides_of_a_scenario_have_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::write(path.join("my.scheme"), with_recorder(BILATERAL, "POSITION", 500)).unwrap();
    let schemes = ["master.scheme=my.scheme", "slave.scheme=my.scheme"].map(|set| ["--set", set]);
    run(path, &[&["run", "--set", "duration_s=2"], schemes.as_flattened()].concat());
    for side in ["master", "slave"] {
        assert_same(&path.join("runs/latest"), side, "POSITION", 500);
    }
}

#[test]
fn one_side_alone_has_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::write(path.join("my.scheme"), with_recorder(BILATERAL, "POSITION", 100)).unwrap();
    let ports = [(); 2].map(|()| UdpSocket::bind("127.0.0.1:0").unwrap());
    let addresses: Vec<String> = ["master", "slave"]
        .iter()
        .zip(&ports)
        .map(|(side, port)| format!("link.{side}_address={}", port.local_addr().unwrap()))
        .collect();
    drop(ports);
    let sides = ["master", "slave"].map(|side| {
        let schemes = ["master.scheme=my.scheme", "slave.scheme=my.scheme"];
        let mut arguments = vec!["run", "--side", side, "--set", "duration_s=1"];
        for setting in schemes.into_iter().chain(addresses.iter().map(String::as_str)) {
            arguments.extend(["--set", setting]);
        }
        start(path, &arguments)
    });
    sides.into_iter().for_each(|side| drop(printed(side)));
    for side in ["master", "slave"] {
        assert_same(&path.join("runs").join(side), side, "POSITION", 100);
    }
}
