//! `dimsart config`: save, compare and restore.

use std::collections::VecDeque;
use std::fs;
use std::io::{self, Read, Write};
use std::path::PathBuf;
use std::process::Output;

use dimsart::config::{Difference, deviations};
use dimsart::connect::{ConfigurationReplacement, ConnectError, Device, InProcess};
use dimsart_core::{Command, Word};
use dimsart_link::protocol::{
    MAX_FRAME_BYTES, PROTOCOL_VERSION, Receiver, Request, Response, decode_request, encode_response, serve,
};
use dimsart_modules::ALL;
use hil_sim::law::Law;
use hil_sim::response::loaded_controllers;
use hil_sim::rig::SimulatedDimsart;
use hil_sim::rig_file::RigFile;
use hil_sim::schemes::device;
use hil_sim::schemes::{self, SchemeText};

use crate::emulated::{Emulated, QUICK, Robot, dimsart, listen, message};

/// The shipped rig's only controller.
fn of_rig(name: &str) -> Box<SimulatedDimsart> {
    let file = RigFile::read(RigFile::shipped(name).unwrap(), name, PathBuf::new(), &[]).unwrap();
    loaded_controllers(&file).unwrap().remove(0).dimsart
}

fn of_side(scheme: &str, side: &'static str) -> Box<SimulatedDimsart> {
    let mut dimsart = Box::new(SimulatedDimsart::new(device(side, 3, 1e-3).unwrap(), ALL).unwrap());
    schemes::load(&SchemeText::read(scheme).unwrap(), side, &[], &mut dimsart);
    dimsart
}

/// Moves without packets on its links.
fn without_peer(mut dimsart: Box<SimulatedDimsart>) -> Box<SimulatedDimsart> {
    // A controller without links has no such module.
    let _ = Device::identify(InProcess::new(&mut dimsart), QUICK, ALL).unwrap().set(
        "COMM_RXMOD",
        "TIMEOUT_TICKS",
        "0",
    );
    dimsart
}

fn saved(dimsart: &mut SimulatedDimsart) -> String {
    let (text, unknown) =
        Device::identify(InProcess::new(dimsart), QUICK, ALL).unwrap().configuration_text().unwrap();
    assert_eq!(unknown, 0);
    text
}

fn exchanged(dimsart: &mut SimulatedDimsart, text: &str, is_dry_run: bool) -> Result<(), ConnectError> {
    let scheme = SchemeText { name: "kept.scheme".to_owned(), text: text.to_owned() };
    let exchange =
        ConfigurationReplacement { scheme: &scheme, side: "all", skips_unknown: false, is_dry_run };
    Device::identify(InProcess::new(dimsart), QUICK, ALL)?.replace_configuration(exchange).map(drop)
}

fn without_modules(mut dimsart: Box<SimulatedDimsart>) -> Box<SimulatedDimsart> {
    dimsart.command(Command::Close).unwrap();
    dimsart
}

#[test]
fn what_is_saved_and_put_on_another_device_is_saved_there_byte_for_byte() {
    let make: [&dyn Fn() -> Box<SimulatedDimsart>; 5] = [
        &|| of_rig("joint"),
        &|| of_rig("arm"),
        &|| of_side("builtin:bilateral", "master"),
        &|| of_side("builtin:bilateral", "slave"),
        &|| of_side("builtin:table1", "master"),
    ];
    for make in make {
        let mut first = make();
        let text = saved(&mut first);
        assert!(text.starts_with("# Configuration of ") && text.contains("MOD_ON"), "{text}");
        assert_eq!(saved(&mut first), text, "twice");
        let mut fresh = without_modules(make());
        assert_ne!(saved(&mut fresh), text);
        exchanged(&mut fresh, &text, true).unwrap();
        assert!(!saved(&mut fresh).contains("MOD_ON"), "a dry run changes nothing");
        exchanged(&mut fresh, &text, false).unwrap();
        assert_eq!(saved(&mut fresh), text);
        assert!(fresh.engine().is_running());
    }
}

#[test]
fn what_does_not_match_is_saved_and_not_taken() {
    let text = saved(&mut of_side("builtin:table1", "slave"));
    let mut fresh = without_modules(of_side("builtin:table1", "slave"));
    let before = saved(&mut fresh);
    let error = exchanged(&mut fresh, &text, false).unwrap_err().to_string();
    assert!(error.contains("CH1_TD_WAVES") && error.contains("nothing has changed"), "{error}");
    assert_eq!(saved(&mut fresh), before);
}

/// Two moving controllers: restoring its own configuration to one changes no bit of its motion.
#[test]
fn modules_that_stay_go_on_with_their_state() {
    type Make<'a> = &'a dyn Fn() -> Box<SimulatedDimsart>;
    let rigs: [(Make<'_>, u16, usize); 2] =
        [(&|| of_rig("joint"), 2, 1), (&|| of_side("builtin:bilateral", "slave"), 3, 3)];
    for (make, measures, takes) in rigs {
        let [mut one, mut other, mut replaced] = [make(), make(), make()].map(without_peer);
        let (text, mut differs) = (saved(&mut one), false);
        let tick = |dimsart: &mut SimulatedDimsart, number: u16| {
            // Different words, so that there is something to control.
            let value = |word: u16| (0.05 * f32::from(number) + f32::from(word)).sin();
            let measured: Vec<Word> = (0..measures).map(|word| Word::from(value(word))).collect();
            let mut taken = vec![Word(0); takes];
            dimsart.tick(&measured, &mut taken);
            taken
        };
        for number in 0..200 {
            if number == 100 {
                exchanged(&mut one, &text, false).unwrap();
                let scheme = SchemeText { name: "kept.scheme".to_owned(), text: text.clone() };
                let mut device = Device::identify(InProcess::new(&mut replaced), QUICK, ALL).unwrap();
                device.replace_scheme(&scheme, "all").unwrap();
            }
            let expected = tick(&mut other, number);
            assert_eq!(tick(&mut one, number), expected, "tick {number}");
            differs |= tick(&mut replaced, number) != expected;
        }
        assert_ne!(tick(&mut one, 200), vec![Word(0); takes]);
        assert!(differs, "restarted modules would move differently");
    }
}

fn file(text: &str) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("my.scheme");
    fs::write(&path, text).unwrap();
    let name = path.display().to_string();
    (folder, name)
}

fn config(arguments: &[&str]) -> Output {
    dimsart(&[&["config"], arguments].concat())
}

fn out(arguments: &[&str], status: i32) -> String {
    let output = config(arguments);
    assert_eq!(output.status.code(), Some(status), "{arguments:?}: {output:?}");
    String::from_utf8(output.stdout).unwrap()
}

fn error(arguments: &[&str], status: i32) -> String {
    let output = config(arguments);
    assert_eq!(output.status.code(), Some(status), "{arguments:?}: {output:?}");
    String::from_utf8(output.stderr).unwrap()
}

#[test]
fn what_differs_from_the_defaults_is_a_table_with_units() {
    let emulated = Emulated::with_scheme("slave");
    let table = out(&["diff", &emulated.port], 0);
    let row = table.lines().find(|line| line.contains("K_PARAM")).unwrap();
    assert!(row.contains("3 ┆ PDCTRL_MOD") && row.contains("5000 N/m or N·m/rad"), "{table}");
    assert!(!table.contains("B_PARAM"), "as by default: {table}");
    let json: serde_json::Value =
        serde_json::from_str(&out(&["diff", "builtin:joint", "--json"], 0)).unwrap();
    let first = &json["deviations"][0];
    assert_eq!((&first["place"], &first["parameter"]), (&1.into(), &"K_PARAM".into()));
    assert_eq!((&first["value"], &first["default"]), (&"150".into(), &"0".into()));
    out(&["diff", "builtin:joint", "--exit-code"], 3);
    let (_folder, empty) = file("# nothing\n");
    assert!(out(&["diff", &empty, "--exit-code"], 0).ends_with(": no modules\n"));
}

#[test]
fn what_differs_between_two_is_added_removed_changed_moved_or_bound() {
    let (_one, first) = file(
        "all PDCTRL_MOD K_PARAM 5\nall MOD_ENG MOD_ON PDCTRL_MOD\nall MOD_ENG MOD_ON SUM_MOD\n\
         all MOD_ENG MOD_ON SUM_MOD.2\nall MOD_ENG MOD_ON TIMEDELAY_MOD\nall NEW_MOD K 5\n",
    );
    let (_two, second) = file(
        "all MOD_ENG MOD_ON SUM_MOD.2\nall PDCTRL_MOD K_PARAM 5\nall PDCTRL_MOD K_PARAM[1] 6\n\
         all PDCTRL_MOD PORT_POSITION POSITION.2\nall MOD_ENG MOD_ON PDCTRL_MOD\n\
         all MOD_ENG MOD_ON SUM_MOD\nall PIDCTRL_MOD K_PARAM 7\nall MOD_ENG MOD_ON PIDCTRL_MOD\n\
         all NEW_MOD   K 5\nall NEW_MOD K 6\n",
    );
    let json: serde_json::Value =
        serde_json::from_str(&out(&["diff", &first, &second, "--json", "--exit-code"], 3)).unwrap();
    let texts: Vec<String> = json["changes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|change| {
            let word = |key: &str| change[key].as_str().unwrap_or("-").to_owned();
            ["change", "module", "parameter", "from", "to"].map(word).join(" ")
        })
        .collect();
    let expected = [
        "moved SUM_MOD.2 - 3 1",
        "changed PDCTRL_MOD K_PARAM[1] 5 6",
        "bound PDCTRL_MOD PORT_POSITION POSITION POSITION.2",
        "added PIDCTRL_MOD -  position 4",
        "added PIDCTRL_MOD K_PARAM 0 7",
        "removed TIMEDELAY_MOD - position 4 ",
    ];
    assert_eq!(texts, expected);
    assert_eq!(json["unknown_removed"].as_array().unwrap().len(), 0);
    assert_eq!(json["unknown_added"][0]["line"], 10);
    let table = out(&["diff", &first, &second], 0);
    assert!(table.contains("unknown row: all NEW_MOD K 6: 'NEW_MOD' is not a module"), "{table}");
    assert!(out(&["diff", &first, &first, "--exit-code"], 0).contains("are equal"));
}

#[test]
fn a_configuration_is_put_back_and_a_dry_run_changes_nothing() {
    let emulated = Emulated::with_scheme("master");
    let folder = tempfile::tempdir().unwrap();
    let kept = folder.path().join("kept.scheme").display().to_string();
    assert!(out(&["save", &emulated.port, &kept], 0).contains(&kept));
    assert_eq!(out(&["save", &emulated.port], 0), fs::read_to_string(&kept).unwrap());
    emulated.out(&["set", "PDCTRL_MOD", "K_PARAM", "70"], 0);
    let changed = out(&["save", &emulated.port], 0);
    let dry = out(&["apply", &kept, &emulated.port, "--dry-run"], 0);
    assert!(dry.contains("70 N/m") && dry.contains("3000 N/m") && dry.contains("nothing changed"), "{dry}");
    assert_eq!(out(&["save", &emulated.port], 0), changed);
    assert!(!emulated.robot.lock().unwrap().dimsart.engine().is_in_transaction());
    let json: serde_json::Value =
        serde_json::from_str(&out(&["apply", &kept, &emulated.port, "--json"], 0)).unwrap();
    assert_eq!((&json["changes"][0]["to"], &json["is_dry_run"]), (&"3000".into(), &false.into()));
    assert!(out(&["diff", &kept, &emulated.port, "--exit-code"], 0).contains("are equal"));
}

#[test]
fn rows_that_the_device_does_not_know_are_named_and_change_nothing_unless_they_are_left_out() {
    let emulated = Emulated::with_scheme("master");
    let before = out(&["save", &emulated.port], 0);
    let (_folder, newer) = file(&format!(
        "{}all NEW_MOD K 5\nall PDCTRL_MOD SHINE 4\nall PDCTRL_MOD PORT_SHINE FORCE\nall MOD_ENG MOD_ON NEW_MOD\n",
        before.replace("3000", "2000").replace("all  MOD_ENG        MATCHING_CHECK\n", "")
    ));
    let refused = config(&["apply", &newer, &emulated.port]);
    assert_eq!(refused.status.code(), Some(1), "{refused:?}");
    let table = String::from_utf8(refused.stdout).unwrap();
    for place in [":5: unknown row: all NEW_MOD K 5", ":16: unknown row: all PDCTRL_MOD SHINE 4"] {
        assert!(table.contains(place), "{table}");
    }
    assert_eq!(out(&["save", &emulated.port], 0), before);
    let taken = config(&["apply", &newer, &emulated.port, "--skip-unknown"]);
    let (text, left_out) =
        (String::from_utf8(taken.stdout.clone()).unwrap(), String::from_utf8(taken.stderr.clone()).unwrap());
    // Ports of a plugged-in module, as reported by the device.
    assert!(taken.status.success() && text.contains(": applied "), "{taken:?}");
    assert_eq!(left_out.matches("skipped: ").count(), 4, "{left_out}");
    assert_eq!(out(&["save", &emulated.port], 0), before.replace("3000", "2000"));
}

#[test]
fn wrong_inputs_are_told() {
    let emulated = Emulated::with_scheme("master");
    let before = out(&["save", &emulated.port], 0);
    let port = emulated.port.as_str();
    let (_folder, begins) = file("all MOD_ENG BEGIN\n");
    // Invalid in every version: not skipped.
    let (_folder, mistyped) = file("all PDCTRL_MOD K_PARAM 3o00\n");
    let (_folder, wrong) = file("all PDCTRL_MOD K_PARAM 5 6\nsome PDCTRL_MOD K_PARAM 5\n");
    for (arguments, status, expected) in [
        (&["diff", "no.scheme"][..], 1, "cannot read scheme file no.scheme"),
        (&["diff", "builtin:none"], 1, "unknown scheme builtin:none"),
        (&["diff", "sim:nobody-here"], 1, "nobody-here"),
        (&["save", "tcp:127.0.0.1:1"], 1, "start the emulated board first"),
        (&["save", port, "/no/such/folder/file"], 1, "cannot write /no/such/folder/file"),
        (&["apply", "builtin:bilateral", port], 2, "builtin:bilateral:8: this row is for m&s"),
        (&["apply", "builtin:bilateral", port, "--side", "both"], 2, "invalid value 'both'"),
        (
            &["apply", &begins, port],
            1,
            ":1:13: refused: remove this row, because a file is always sent as one transaction",
        ),
        (&["apply", &wrong, port, "--side", "master"], 1, "does not know 2 rows"),
        (&["apply", &mistyped, port, "--skip-unknown"], 1, "'3o00'"),
        (&["apply", "builtin:table1", port, "--side", "slave"], 1, "CH1_TD_WAVES"),
        (&["apply"], 2, "required"),
    ] {
        let found = error(arguments, status);
        assert!(found.contains(expected), "{arguments:?}: {found}");
        assert_eq!(out(&["save", port], 0), before, "{arguments:?}");
    }
}

/// A device that reports a newer version, with an unknown command as the first of its scheme.
fn newer(robot: &mut Robot, content: &[u8]) -> Vec<u8> {
    let Ok((id, request)) = decode_request(content) else { return Vec::new() };
    robot.commands += u32::from(request.needs_key());
    if request == (Request::SchemeCommand { place: 0, index: 0 }) {
        let [low, high] = id.to_le_bytes();
        let mut content = vec![2, low, high, 250];
        let crc =
            crc::Crc::<u32>::new(&crc::CRC_32_AUTOSAR).checksum(&[&[0; 4], content.as_slice()].concat());
        content.extend(crc.to_le_bytes());
        return [&[0], cobs::encode_vec(&content).as_slice(), &[0]].concat();
    }
    let mut response = serve(id, &request, &mut robot.dimsart, &mut robot.info);
    if let Response::Identity(identity) = &mut response {
        identity.protocol_version = PROTOCOL_VERSION + 1;
    }
    encode_response(&response, id, &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec()
}

fn robot_with_a_scheme() -> Robot {
    let mut robot = Robot::new();
    let text = SchemeText::read("builtin:bilateral").unwrap().text;
    let failed = dimsart_core::scheme::load(&text, "master", schemes::SIDES, &mut robot.dimsart, |_| ());
    assert_eq!(failed, 0);
    robot
}

/// The same device without a line.
struct Newer {
    robot: Robot,
    receiver: Receiver,
    answers: VecDeque<u8>,
}

impl Write for Newer {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let Self { robot, receiver, answers } = self;
        receiver.push_all(bytes, |content| answers.extend(newer(robot, content)));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Read for Newer {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self.answers.read(buffer)? {
            0 => Err(io::ErrorKind::WouldBlock.into()),
            count => Ok(count),
        }
    }
}

#[test]
fn a_device_of_a_newer_version_is_read_as_far_as_it_is_understood_and_never_changed() {
    let mut stream =
        Newer { robot: robot_with_a_scheme(), receiver: Receiver::new(), answers: VecDeque::new() };
    let mut device = Device::identify(&mut stream, QUICK, ALL).unwrap();
    assert!(device.version_note().is_some());
    let (text, unknown) = device.configuration_text().unwrap();
    assert_eq!(unknown, 1);
    assert!(
        text.contains("# 1 commands of a newer version are omitted") && text.contains("MOD_ON"),
        "{text}"
    );
    assert!(device.get("PDCTRL_MOD", "K_PARAM").is_ok());
    let scheme = SchemeText { name: "kept.scheme".to_owned(), text };
    let exchange =
        ConfigurationReplacement { scheme: &scheme, side: "all", skips_unknown: true, is_dry_run: true };
    let refusals = [
        device.replace_configuration(exchange).map(drop),
        device.set("PDCTRL_MOD", "K_PARAM", "1").map(drop),
        device.begin().map(drop),
        device.save().map(drop),
        device.hold_lease().map(drop),
    ];
    for refusal in refusals {
        let error = refusal.unwrap_err();
        assert!(matches!(error, ConnectError::ReadOnly(_)), "{error}");
        let expected = format!(
            "read-only, nothing has changed: the device has protocol version {}, this program {PROTOCOL_VERSION}",
            PROTOCOL_VERSION + 1
        );
        assert!(error.to_string().contains(&expected), "{error}");
    }
    device.stop().unwrap();
    assert_eq!(stream.robot.commands, 0, "no command has reached the device");
}

#[test]
fn a_device_of_a_newer_version_is_saved_with_a_warning_and_takes_nothing() {
    let mut robot = robot_with_a_scheme();
    let port = listen(move |content| newer(&mut robot, content));
    let saved = config(&["save", &port]);
    assert_eq!(saved.status.code(), Some(0), "{saved:?}");
    let (text, note) = (String::from_utf8(saved.stdout).unwrap(), String::from_utf8(saved.stderr).unwrap());
    assert!(
        note.contains("only reading and `stop` are possible") && note.contains("1 commands of tcp:"),
        "{note}"
    );
    let (_folder, kept) = file(&text.replace("3000", "2000"));
    assert!(out(&["diff", &port, &kept], 0).contains("2000 N/m"));
    let found = message(&config(&["apply", &kept, &port]));
    assert!(found.contains("read-only, nothing has changed: the device has protocol version"), "{found}");
    assert!(!message(&config(&["apply", &kept, &port, "--dry-run"])).is_empty());
    assert_eq!(config(&["save", &port]).stdout, text.into_bytes());
}

#[test]
fn rows_have_the_names_of_the_law_that_is_on_the_device() {
    let text = "law SPRING\nin x: POSITION\nout force: DES_FORCE\nparam stiffness: Stiffness = 2 in 0..10\n\
                force = -stiffness * x";
    let rows = "all ONLINE_MOD PROGRAM 1\nall ONLINE_MOD stiffness 4\nall ONLINE_MOD PORT_x POSITION\n\
                all MOD_ENG MOD_ON ONLINE_MOD\nall MOD_ENG MATCHING_CHECK";
    let mut joint = of_rig("joint");
    let law = Law::compile(text, "spring.law").unwrap();
    Device::identify(InProcess::new(&mut joint), QUICK, ALL).unwrap().upload_law(&law, None).unwrap();

    let error = exchanged(&mut joint, &rows.replace("stiffness", "gain"), false).unwrap_err().to_string();
    let names =
        "'gain' is not a parameter or port of ONLINE_MOD; available: PROGRAM, stiffness, PORT_x, PORT_force";
    assert!(error.contains(names), "{error}");
    let error = exchanged(&mut joint, &rows.replace(" 4", " 11"), false).unwrap_err().to_string();
    assert!(error.contains("'11' is not a number from 0 to 10"), "{error}");

    exchanged(&mut joint, rows, false).unwrap();
    let mut device = Device::identify(InProcess::new(&mut joint), QUICK, ALL).unwrap();
    // The instructions of the law are commands without rows.
    let (on_device, _) = device.configuration_text().unwrap();
    let stiffness = device.get("ONLINE_MOD", "stiffness").unwrap().to_string();
    assert!(stiffness.contains(" 4"), "{stiffness}");
    let [file, there] = [rows, &on_device].map(|rows| device.read_configuration(rows, "all").unwrap());
    assert_eq!((&file.unknown[..], &there.unknown[..]), (&[][..], &[][..]));
    assert!(Difference::between(&file, &there).changes.is_empty(), "{file:?} {there:?}");
    let stiffness =
        deviations(&there).into_iter().find(|found| found.parameter.as_deref() == Some("stiffness"));
    assert_eq!(stiffness.and_then(|found| found.default).as_deref(), Some("2"), "of the law");
}
