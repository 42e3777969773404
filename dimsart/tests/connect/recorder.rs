//! Rows of a recorder on a device are read while it records; overwritten rows are not shown.

use std::sync::{Arc, Mutex};

use dimsart::connect::{DisplayValue, RecorderRow};
use dimsart_core::Command;
use dimsart_link::protocol::{MAX_FRAME_BYTES, Refusal, Request, Response, decode_request, encode_response};
use hil_sim::schemes::SchemeText;

use crate::emulated::{Emulated, QUICK, Robot, listen, message};

/// Rows of a scheme that record a signal.
fn recorder(signal: &str) -> String {
    format!("all RECORDER_MOD PORT_SIGNAL_IN {signal}\nall MOD_ENG MOD_ON RECORDER_MOD\n")
}

fn scheme(text: &str) -> SchemeText {
    SchemeText { name: "my.scheme".to_owned(), text: text.to_owned() }
}

/// Adds a recorder of this length to the running scheme.
fn add_recorder(emulated: &Emulated, signal: &str, length: u32) {
    let rows = scheme(&format!("all RECORDER_MOD LENGTH {length}\n{}", recorder(signal)));
    emulated.connect(QUICK).send_scheme(&rows, "master").unwrap();
}

fn with_recorder(length: u32) -> Emulated {
    let emulated = Emulated::with_scheme("master");
    add_recorder(&emulated, "POSITION", length);
    emulated
}

fn tick(emulated: &Emulated, positions: impl IntoIterator<Item = u8>) {
    let mut robot = emulated.robot.lock().unwrap();
    positions.into_iter().for_each(|position| robot.tick(position.into()));
}

/// The row recorded at this position.
fn row(number: u32, position: u16) -> RecorderRow {
    RecorderRow { number, values: [position.into(), 0.0, 0.0].map(DisplayValue::Real).to_vec() }
}

#[test]
fn rows_come_oldest_first_with_name_and_unit() {
    let emulated = with_recorder(25);
    for (ticks, first) in [(0..7, 0), (7..25, 0), (25..60, 35), (60..61, 36), (61..100, 75)] {
        let end = ticks.end;
        tick(&emulated, ticks);
        let state = emulated.state();
        let recorded = emulated.connect(QUICK).read_recorder(None).unwrap();
        assert_eq!(emulated.state(), state, "only reads");
        let expected: Vec<_> = (first..end).map(|number| row(number.into(), number.into())).collect();
        assert_eq!(recorded.rows, expected);
        assert_eq!(recorded.overwritten, 0);
        assert_eq!(recorded.columns, ["arm.POSITION[0] (m)", "arm.POSITION[1] (rad)", "arm.POSITION[2] (m)"]);
    }
}

#[test]
fn the_rows_are_printed_as_json() {
    let emulated = with_recorder(25);
    tick(&emulated, 0..3);
    let json = emulated.json(&["recorder", "--json"], 0);
    assert_eq!(json["signal"], "POSITION");
    assert_eq!(json["rows"][2], serde_json::json!({ "number": 2, "values": [2.0, 0.0, 0.0] }));
    let file = tempfile::tempdir().unwrap();
    let path = file.path().join("rows.csv");
    let json = emulated.json(&["recorder", "--out", path.to_str().unwrap(), "--json"], 0);
    assert_eq!((&json["rows"], &json["recorder"]), (&3.into(), &"RECORDER_MOD".into()));
    assert!(std::fs::read_to_string(path).unwrap().starts_with("row,arm.POSITION[0]"));
}

#[test]
fn the_rows_are_written_as_csv() {
    let emulated = with_recorder(4);
    tick(&emulated, 1..7);
    let csv = "row,arm.POSITION[0] (m),arm.POSITION[1] (rad),arm.POSITION[2] (m)\n2,3,0,0\n3,4,0,0\n4,5,0,0\n5,6,0,0\n";
    let output = emulated.run(&["recorder", "RECORDER_MOD"]);
    assert_eq!(String::from_utf8(output.stdout).unwrap(), csv);
    let note = String::from_utf8(output.stderr).unwrap();
    assert!(note.contains("4 rows of POSITION, numbered 2 to 5\n"), "{note}");

    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("rows.csv");
    let out = emulated.out(&["recorder", "--out", file.to_str().unwrap()], 0);
    assert_eq!(out, format!("{}: 4 rows of POSITION, numbered 2 to 5\n", file.display()));
    assert_eq!(std::fs::read_to_string(file).unwrap(), csv);
    let nowhere = message(&emulated.run(&["recorder", "--out", "/no/such/folder/rows.csv"]));
    assert!(nowhere.contains("cannot write /no/such/folder/rows.csv: "), "{nowhere}");
}

#[test]
fn a_row_that_takes_two_answers_is_read_whole_and_named_by_row_and_column() {
    let emulated = Emulated::with_scheme("master");
    add_recorder(&emulated, "MAP", 3);
    tick(&emulated, 0..5);
    let recorded = emulated.connect(QUICK).read_recorder(None).unwrap();
    let columns: Vec<_> =
        (0..5).flat_map(|row| (0..8).map(move |column| format!("arm.MAP[{row}][{column}] (J)"))).collect();
    assert_eq!(recorded.columns, columns);
    assert_eq!(recorded.rows.iter().map(|row| row.number).collect::<Vec<_>>(), [2, 3, 4]);
    let values: Vec<_> = (1..=40_u8).map(|value| DisplayValue::Real(value.into())).collect();
    assert!(recorded.rows.iter().all(|row| row.values == values), "{recorded:?}");
}

#[test]
fn a_sign_is_kept_and_a_switch_is_written_as_a_number() {
    for (signal, csv) in [
        ("TURNS", "row,arm.TURNS (m or rad)\n0,-7\n1,-7\n"),
        ("BRAKES", "row,arm.BRAKES[0],arm.BRAKES[1],arm.BRAKES[2]\n0,1,0,0\n1,1,0,0\n"),
    ] {
        let emulated = Emulated::with_scheme("master");
        add_recorder(&emulated, signal, 5);
        tick(&emulated, 0..2);
        assert_eq!(emulated.out(&["recorder"], 0), csv);
    }
}

#[test]
fn what_is_no_recorder_to_read_is_said_with_what_to_do() {
    let emulated = Emulated::with_scheme("master");
    let found = message(&emulated.run(&["recorder"]));
    assert!(
        found.contains("no recorder to read; to plug in a recorder, bind its PORT_SIGNAL_IN with `set`"),
        "{found}"
    );
    add_recorder(&emulated, "POSITION", 5);
    for (name, expected) in [
        ("PDCTRL_MOD", "PDCTRL_MOD is not a recorder; plugged-in recorders: RECORDER_MOD"),
        ("RECODER_MOD", "'RECODER_MOD' is not a module; did you mean 'RECORDER_MOD'?"),
        (
            "RECORDER_MOD.2",
            "RECORDER_MOD.2 is not plugged in: plug it in first (MOD_ON in a scheme, `on` at a device)",
        ),
    ] {
        let found = message(&emulated.run(&["recorder", name]));
        assert!(found.contains(expected), "{found}");
    }
    let second = recorder("POSITION").replace("RECORDER_MOD", "RECORDER_MOD.2");
    let second = scheme(&format!("all RECORDER_MOD.2 PORT_ROWS RECORDED_ROWS.2\n{second}"));
    emulated.connect(QUICK).send_scheme(&second, "master").unwrap();
    let found = message(&emulated.run(&["recorder"]));
    assert!(
        found.contains("name the recorder to read; plugged-in recorders: RECORDER_MOD, RECORDER_MOD.2"),
        "{found}"
    );
    tick(&emulated, 0..3);
    assert_eq!(emulated.connect(QUICK).read_recorder(Some("RECORDER_MOD.2")).unwrap().rows.len(), 3);
    emulated.out(&["off", "RECORDER_MOD"], 0);
    let note = emulated.run(&["recorder"]).stderr;
    assert!(String::from_utf8(note).unwrap().contains("3 rows of POSITION"), "the only plugged-in recorder");
    let found = message(&emulated.run(&["recorder", "RECORDER_MOD"]));
    assert!(
        found.contains(
            "RECORDER_MOD is not plugged in: plug it in first (MOD_ON in a scheme, `on` at a device)"
        ),
        "{found}"
    );
}

#[test]
fn an_empty_recorder_is_said_to_be_empty() {
    let emulated = with_recorder(5);
    let output = emulated.run(&["recorder"]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let out = String::from_utf8(output.stdout).unwrap();
    assert_eq!(out, "row,arm.POSITION[0] (m),arm.POSITION[1] (rad),arm.POSITION[2] (m)\n");
    let note = String::from_utf8(output.stderr).unwrap();
    assert!(
        note.contains("RECORDER_MOD has no rows of POSITION yet: it records every EVERY ticks while the scheme runs (`check`) and its RECORD is ON"),
        "{note}"
    );
}

#[test]
fn a_kind_that_the_image_lacks_is_named() {
    let emulated = Emulated::start();
    let robot = Arc::clone(&emulated.robot);
    let place = dimsart_modules::ALL.list().iter().position(|kind| kind.name == "RECORDER_MOD").unwrap();
    let port = listen(move |content| match decode_request(content) {
        // The list ends before this number.
        Ok((id, Request::Module { place: asked })) if usize::from(asked) >= place => {
            let response = Response::Refused(Refusal::NotFound);
            encode_response(&response, id, &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec()
        }
        _ => robot.lock().unwrap().answer(content),
    });
    let emulated = Emulated { port, ..emulated };
    for arguments in [&["recorder"][..], &["recorder", "RECORDER_MOD"], &["on", "RECORDER_MOD.2"]] {
        let found = message(&emulated.run(arguments));
        assert!(
            found.contains(
                "the image does not include RECORDER_MOD: build it with this module kind (docs/firmware.md)"
            ),
            "{found}"
        );
    }
}

/// Another connection to the same robot, with an action before every block of memory is read.
fn while_read(emulated: &Emulated, mut happens: impl FnMut(&mut Robot) + Send + 'static) -> Emulated {
    let robot = Arc::clone(&emulated.robot);
    let port = listen(move |content| {
        let mut robot = robot.lock().unwrap();
        if let Ok((_, Request::Memory { .. })) = decode_request(content) {
            happens(&mut robot);
        }
        robot.answer(content)
    });
    Emulated { port, robot: Arc::clone(&emulated.robot) }
}

#[test]
fn rows_that_are_overwritten_meanwhile_are_left_out_and_counted() {
    const LENGTH: u16 = 100;
    // A block has 10 rows.
    for ticks_per_piece in [0, 1, 5, 8, 15, 200] {
        let emulated = with_recorder(LENGTH.into());
        (0..LENGTH + 23).for_each(|number| emulated.robot.lock().unwrap().tick(number.into()));
        let mut next = LENGTH + 23;
        let busy = while_read(&emulated, move |robot| {
            for _ in 0..ticks_per_piece {
                robot.tick(next.into());
                next += 1;
            }
        });
        let recorded = busy.connect(QUICK).read_recorder(None).unwrap();
        let found = &recorded.rows;
        for taken in found {
            assert_eq!(*taken, row(taken.number, taken.number.try_into().unwrap()), "wrong row number");
        }
        let kept = u32::try_from(found.len()).unwrap();
        assert_eq!(kept + recorded.overwritten, u32::from(LENGTH), "every row is shown or counted");
        // The newest rows are overwritten last.
        let expected: Vec<u32> = (23 + recorded.overwritten..23 + u32::from(LENGTH)).collect();
        let is_whole = found.iter().map(|row| row.number).eq(expected);
        assert!(is_whole || ticks_per_piece > 5, "{ticks_per_piece}: {found:?}");
        assert_eq!(recorded.overwritten > 0, ticks_per_piece > 0);
        assert_eq!(kept == 0, ticks_per_piece > 10);
        let text = recorded.to_string();
        let says = format!("; {} rows were overwritten during the read", recorded.overwritten);
        assert_eq!(text.contains(&says), ticks_per_piece > 0, "{text}");
    }
}

#[test]
fn a_recorder_that_begins_anew_meanwhile_is_not_mixed_with_what_it_was() {
    for is_unplugged in [false, true] {
        let emulated = with_recorder(100);
        tick(&emulated, 0..150);
        let recorder = dimsart_modules::ALL.module("RECORDER_MOD").unwrap();
        let pieces = Mutex::new(0);
        let busy = while_read(&emulated, move |robot| {
            let mut pieces = pieces.lock().unwrap();
            *pieces += 1;
            if *pieces == 3 {
                let command = match is_unplugged {
                    true => Command::Unplug(recorder),
                    false => Command::ResetModule(recorder),
                };
                robot.dimsart.command(command).unwrap();
                robot.tick(1.0);
            }
        });
        let error = busy.connect(QUICK).read_recorder(None).unwrap_err().to_string();
        assert_eq!(error, "RECORDER_MOD was changed or reset during the read: repeat the read");
    }
}
