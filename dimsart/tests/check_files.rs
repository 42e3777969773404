//! `dimsart check` of scenarios and rigs with their own axes, types, settings and paths, and with the limits of a board.
#![expect(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use std::fs;
use std::path::Path;
use std::process::Command;

use hil_sim::rig_file::RigFile;

/// Returns exit status, standard output and standard error of a check.
fn check(path: &Path, more: &[&str]) -> (Option<i32>, [String; 2]) {
    let output =
        Command::new(env!("CARGO_BIN_EXE_dimsart")).arg("check").arg(path).args(more).output().unwrap();
    (output.status.code(), [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap()))
}

const TYPED_RIG: &str = r#"
    duration_s = 0.1
    [[type]]
    name = "GRIP_WIDTH"
    unit = "m"
    [[device]]
    name = "gripper"
    measures = ["POSITION", "GRIP_WIDTH"]
    [[device.axis]]
    unit = "m"
    plant.load.inertia = 0.1
    [[controller]]
    device = "gripper"
    scheme = "my.scheme"
    [[experiment.move]]
    device = "gripper"
    on = "GRIP_WIDTH"
    step = { at_s = 0.1, amplitude = 0.5 }
"#;

#[test]
fn a_rig_with_a_type_of_its_own_is_checked_and_every_fault_of_it_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("my.toml");
    fs::write(&path, TYPED_RIG).unwrap();
    let rows = "all PDCTRL_MOD PORT_DES_POSITION GRIP_WIDTH\nall MOD_ENG MOD_ON PDCTRL_MOD\nall MOD_ENG \
    MATCHING_CHECK\n";
    fs::write(folder.path().join("my.scheme"), rows).unwrap();
    let (status, [out, _]) = check(&path, &[]);
    assert!(status == Some(0) && out.contains("on the gripper: matches"), "{out}");
    fs::write(folder.path().join("my.scheme"), rows.replace("GRIP_", "GRP_")).unwrap();
    let (status, [out, _]) = check(&path, &["--json"]);
    let found: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!((status, &found[0]["matches"]), (Some(1), &false.into()));
    let faults = found[0]["faults"].to_string();
    let expected = [
        "'GRP_WIDTH' is not a data type; did you mean 'GRIP_WIDTH'?",
        "reads DES_POSITION, which has no provider",
    ];
    assert!(expected.iter().all(|fault| faults.contains(fault)), "{faults}");
}

#[test]
fn a_rig_is_checked_for_the_axes_links_and_memory_of_a_board() {
    let (status, [out, _]) = check(Path::new("joint"), &["--board", "b-g431b-esc1"]);
    assert!(status == Some(0) && out.contains("22 of 480 words"), "{out}");
    let (status, [out, _]) = check(Path::new("arm_bus"), &["--board", "nucleo-g474re"]);
    assert_eq!(status, Some(1));
    for fault in [
        "the scheme needs 6 axes, nucleo-g474re has 3: reduce the number of axes",
        "the scheme uses link 2, nucleo-g474re has links 0 to 1: use an available link",
    ] {
        assert!(out.contains(&format!("  fault: {fault}\n")), "{out}");
    }
    let (status, [out, _]) =
        check(Path::new("builtin:bilateral"), &["--board", "b-g431b-esc1", "--dof", "7", "--side", "slave"]);
    assert!(status == Some(1) && out.contains("the scheme needs 7 axes, b-g431b-esc1 has 1"), "{out}");
    let (status, [_, message]) = check(Path::new("joint"), &["--board", "nucleo"]);
    assert!(status == Some(2) && message.contains("unknown board 'nucleo'"), "{message}");
}

#[test]
fn what_a_rig_says_itself_is_no_argument() {
    for argument in [["--side", "slave"], ["--dof", "2"], ["--sample-period-s", "0.01"]] {
        let (status, [_, message]) = check(Path::new("joint"), &argument);
        assert!(status == Some(2) && message.contains("a rig defines"), "{message}");
    }
}

/// One side is independent of the other.
#[test]
fn a_rigs_schemes_are_checked_with_its_axes_and_settings() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("my.toml");
    let scheme = include_str!("../../schemes/bilateral.scheme");
    fs::write(folder.path().join("my.scheme"), scheme).unwrap();
    let write = |text: &str| fs::write(&path, text).unwrap();
    write("dof = 1\n[master]\nscheme = \"my.scheme\"\n[slave]\nscheme = \"not/here.scheme\"\n");
    let (status, [out, _]) = check(&path, &["--side", "master", "--json"]);
    let one: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(status, Some(0), "{out}");
    let (status, [out, _]) = check(&path, &["--side", "slave"]);
    assert!(status == Some(1) && out.contains("fault: cannot read scheme file"), "{out}");
    write("[master]\ntime_delay_ticks = 20\n");
    let (status, [out, _]) = check(&path, &["--json"]);
    let three: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!((status, three[1]["controller"].as_str()), (Some(0), Some("slave")));
    let words = |found: &serde_json::Value| found[0]["words"].as_u64().unwrap();
    assert!(words(&three) > words(&one) + 20, "{one} {three}");
    write(
        "[master]\nstiffness_n_per_m = 3000\nscheme = \"builtin:table1\"\n[slave]\nscheme = \"builtin:table1\"\n",
    );
    let (status, [out, _]) = check(&path, &[]);
    assert!(status == Some(1) && out.contains("on the slave: does NOT match"), "{out}");
    write("los = 1\n");
    let (status, [_, message]) = check(&path, &[]);
    assert!(status == Some(1) && message.contains("my.toml:1:1: unknown key `los`"), "{message}");
}

#[test]
fn every_fault_of_a_rig_is_named_also_where_a_scheme_cannot_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("my.toml");
    fs::write(&path, "[master]\nscheme = \"not/here.scheme\"\n[slave]\nscheme = \"builtin:table1\"\n")
        .unwrap();
    let (status, [out, _]) = check(&path, &[]);
    assert_eq!(status, Some(1));
    for fault in ["cannot read scheme file", "COMM_TXMOD reads CH1_TD_WAVES, which has no provider"] {
        assert!(out.contains(&format!("  fault: {fault}")), "{out}");
    }
    fs::write(&path, "[master]\nscheme = \"a.scheme\"\n[slave]\nscheme = \"b.scheme\"\n").unwrap();
    let (_, [out, _]) = check(&path, &["--json"]);
    let found: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert!(found[0]["faults"][0].as_str().unwrap().contains("a.scheme"), "{out}");
    assert!(found[1]["faults"][0].as_str().unwrap().contains("b.scheme"), "{out}");
}

#[test]
fn a_rig_is_checked_for_the_axes_of_a_board_that_has_fewer_and_that_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("my.toml");
    fs::write(&path, "").unwrap();
    let (status, [out, message]) = check(&path, &["--board", "b-g431b-esc1"]);
    assert_eq!(status, Some(0), "{out}{message}");
    let note = "  note: checked for the 1 axis of b-g431b-esc1; the rig has 3 axes\n";
    assert_eq!(out.matches(note).count(), 2, "{out}");
    for more in [&["--board", "nucleo-g474re"][..], &["--board", "b-g431b-esc1", "--dof", "1"]] {
        let (status, [out, _]) = check(&path, more);
        assert!(status == Some(0) && !out.contains("the rig's"), "{out}");
    }
    let (status, [out, _]) = check(&path, &["--board", "b-g431b-esc1", "--dof", "2"]);
    assert!(status == Some(1) && out.contains("the scheme needs 2 axes, b-g431b-esc1 has 1"), "{out}");
}

#[test]
fn a_scheme_for_the_devices_of_a_rig_points_to_the_rig() {
    for rig in ["joint", "arm"] {
        let (status, [out, _]) = check(Path::new(&format!("builtin:{rig}")), &[]);
        assert_eq!(status, Some(1));
        assert!(out.contains(&format!("the rig {rig}: run `dimsart check {rig}`")), "{out}");
    }
    let (_, [out, _]) = check(Path::new("builtin:table1"), &[]);
    assert!(!out.contains("the rig"), "{out}");
}

/// Every shipped rig's schemes match their devices.
#[test]
fn every_shipped_rig_matches() {
    for name in ["arm", "joint", "phantom", "rokviss", "three"] {
        assert!(RigFile::shipped(name).is_some());
        let (status, [out, message]) = check(Path::new(name), &[]);
        assert_eq!(status, Some(0), "{name}: {out}{message}");
    }
}
