//! All requests and commands: answers and refusals.

use std::collections::HashMap;
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::Instant;

use dimsart::connect::DisplayValue;
use dimsart_core::scheme;
use dimsart_link::protocol::{
    MAX_FRAME_BYTES, Receiver, Refusal, Response, decode_request, decode_response, encode_response,
};
use hil_sim::schemes::{SIDES, SchemeText};

use crate::emulated::{Emulated, QUICK, Robot, listen, message};
use test_requirements::TEST_TIMEOUT;

fn text(scheme: &str) -> SchemeText {
    SchemeText { name: "my.scheme".to_owned(), text: scheme.to_owned() }
}

#[test]
fn show_tells_who_it_is_what_runs_and_every_value_with_its_unit() {
    let emulated = Emulated::with_scheme("slave");
    emulated.robot.lock().unwrap().tick(0.25);
    let overview = emulated.connect(QUICK).overview().unwrap();
    assert_eq!((overview.identity.device.as_str(), overview.identity.image.as_str()), ("arm", "test 0.1"));
    assert_eq!(overview.status.state, "the scheme runs and commands the device");
    assert_eq!((overview.status.ticks, overview.status.is_running), (1, true));
    assert_eq!(overview.status.usage, emulated.robot.lock().unwrap().dimsart.engine().usage());
    let order: Vec<_> = overview.modules.iter().map(|module| (module.place, module.name.as_str())).collect();
    let names = ["COMM_RXMOD", "WTRANSF_MOD", "PDCTRL_MOD", "TIMEDELAY_MOD", "COMM_TXMOD"];
    assert_eq!(order, (1..).map(Some).zip(names).collect::<Vec<_>>());
    let pd = &overview.modules[2];
    assert!(pd.reads.contains(&"POSITION".to_owned()), "{pd:?}");
    assert_eq!(pd.writes, ["DES_FORCE"]);
    let stiffness = pd.parameters.iter().find(|parameter| parameter.name == "K_PARAM").unwrap();
    assert_eq!(stiffness.values, vec![DisplayValue::Real(5000.0); 3]);
    assert_eq!(stiffness.unit, "N/m or N·m/rad", "the axes differ");
    let side = &overview.modules[1].parameters.iter().find(|found| found.name == "CONF_MODE").unwrap();
    assert_eq!(side.values, [DisplayValue::Name("SLAVE".to_owned())]);
    let position = &overview.signals[0];
    assert_eq!((position.name.as_str(), position.unit.as_str()), ("POSITION", "m or rad"));
    assert_eq!(position.values, [0.25, 0.0, 0.0].map(DisplayValue::Real));
    let map = overview.signals.iter().find(|signal| signal.name == "MAP").unwrap();
    assert_eq!((map.values.len(), map.unit.as_str()), (40, "J"));
    assert_eq!(map.values[39], DisplayValue::Real(40.0));
}

#[test]
fn show_is_the_default_and_has_the_same_as_json() {
    let emulated = Emulated::with_scheme("master");
    let text = emulated.out(&[], 0);
    for part in [
        "arm, image test 0.1, protocol 17",
        "the scheme runs and commands the device; drive: ",
        "  3 PDCTRL_MOD  reads ",
        "3000  3000  3000 N/m or N·m/rad",
        "of 2048 words",
    ] {
        assert!(text.contains(part), "{part} is missing:\n{text}");
    }
    let json = emulated.json(&["show", "--json"], 0);
    assert_eq!(json["identity"]["axes"], serde_json::json!(["linear", "rotary", "linear"]));
    assert_eq!(json["modules"][2]["name"], "PDCTRL_MOD");
    assert_eq!(json["status"]["is_running"], true);
    assert_eq!(json["signals"][1]["values"].as_array().unwrap().len(), 40);
}

#[test]
fn every_command_says_in_json_what_it_came_to() {
    let emulated = Emulated::with_scheme("master");
    let rows = concat!(env!("CARGO_MANIFEST_DIR"), "/../schemes/bilateral.scheme");
    for (arguments, key, expected) in [
        (&["set", "PDCTRL_MOD", "K_PARAM[1]", "500"][..], "is_commanded", true.into()),
        (&["begin"], "effect", serde_json::Value::Null),
        (&["off", "PDCTRL_MOD"], "is_commanded", true.into()),
        (&["on", "PDCTRL_MOD"], "is_commanded", true.into()),
        (&["abort"], "is_commanded", true.into()),
        (&["watch", "POSITION", "--once"], "signals", serde_json::Value::Null),
        (&["scheme", rows, "--side", "master", "--replace"], "rows", 14.into()),
        (&["stop"], "is_commanded", false.into()),
    ] {
        let json = emulated.json(&[arguments, &["--json"]].concat(), 0);
        let found = json.get(key).unwrap();
        assert!(expected.is_null() || *found == expected, "{arguments:?}: {json}");
    }
    assert_eq!(
        emulated.json(&["--json"], 0)["modules"][0]["is_on"],
        emulated.json(&["show", "--json"], 0)["modules"][0]["is_on"]
    );
    assert!(emulated.out(&["set", "PDCTRL_MOD", "K_PARAM", "-1", "--json"], 1).is_empty());
}

#[test]
fn a_set_value_is_answered_by_what_holds_then() {
    let emulated = Emulated::with_scheme("master");
    let mut device = emulated.connect(QUICK);
    let outcome = device.set("PDCTRL_MOD", "K_PARAM[1]", "500").unwrap();
    assert_eq!(
        outcome.to_string(),
        "PDCTRL_MOD K_PARAM[1] is 500 N/m or N·m/rad; the scheme runs and commands the device"
    );
    let stiffness = device.get("PDCTRL_MOD", "K_PARAM").unwrap();
    assert_eq!(stiffness.values, [3000.0, 500.0, 3000.0].map(DisplayValue::Real));
    assert_eq!(stiffness.range, "0 to 1000000, per axis");
    assert_eq!(device.get("PDCTRL_MOD", "K_PARAM[1]").unwrap().range, "0 to 1000000");
    assert_eq!(emulated.json(&["get", "PDCTRL_MOD", "K_PARAM[1]", "--json"], 0)["values"][0], 500.0);

    let state = emulated.state();
    for (arguments, expected) in [
        (
            ["PDCTRL_MOD", "K_PARAM", "-1"],
            "'-1' is not a number from 0 to 1000000 N/m or N·m/rad; \
                 PDCTRL_MOD K_PARAM stays 3000  500  3000 N/m",
        ),
        (["PDCTRL_MOD", "K_PARAM", "nan"], "'nan' is not a number from 0 to 1000000"),
        (["PDCTRL_MOD", "K_PARAM", "much"], "'much' is not a number from 0 to 1000000 N/m or N·m/rad; "),
        (
            ["PDCTRL_MOD", "K_PARM", "1"],
            "'K_PARM' is not a parameter or port of PDCTRL_MOD; did you mean 'K_PARAM'?",
        ),
        (["PDCTL_MOD", "K_PARAM", "1"], "'PDCTL_MOD' is not a module; did you mean 'PDCTRL_MOD'?"),
        (
            ["PDCTRL_MOD", "K_PARAM[300]", "1"],
            "'K_PARAM[300]' is not an entry of K_PARAM, which has one value per axis: write K_PARAM[0]; axes \
            start at 0",
        ),
        (
            ["PDCTRL_MOD", "K_PARM[x]", "1"],
            "'K_PARM[x]' is not a parameter or port of PDCTRL_MOD; did you mean",
        ),
        (["PDCTRL_MOD", "K_PARAM[3]", "1"], "no such axis: the device has 3 axes, counted from 0"),
        (
            ["PDCTRL_MOD", "LAW_OUTPUT[0]", "ON"],
            "'LAW_OUTPUT[0]' has one value for all axes: remove the [axis]",
        ),
        (["WTRANSF_MOD", "CONF_MODE", "SLAV"], "'SLAV' is not a value of CONF_MODE; did you mean 'SLAVE'?"),
        (["PDCTRL_MOD", "PORT_POSITON", "MAP"], "did you mean 'PORT_POSITION'?"),
        (["PDCTRL_MOD", "PORT_POSITION", "MAPP"], "'MAPP' is not a data type; did you mean 'MAP'?"),
        (
            ["TIMEDELAY_MOD", "TD_PARAM", "3"],
            "refused: this parameter changes ports or memory: unplug the module first (MOD_OFF in a scheme, \
            `off` at a device)",
        ),
        (
            ["PDCTRL_MOD", "PORT_POSITION", "MAP"],
            "PDCTRL_MOD is plugged in: unplug it first (MOD_OFF in a scheme, `off` at a device)",
        ),
    ] {
        let output = emulated.run(&[&["set"], arguments.as_slice()].concat());
        let found = message(&output);
        assert!(found.contains(expected), "{arguments:?}: {found}");
    }
    assert_eq!(emulated.state(), state, "a refused command changed the scheme");
}

#[test]
fn an_axis_that_is_not_there_cannot_be_read() {
    let emulated = Emulated::with_scheme("master");
    let found = message(&emulated.run(&["get", "PDCTRL_MOD", "K_PARAM[3]"]));
    assert!(found.contains("no such axis: the device has 3 axes, counted from 0"), "{found}");
}

#[test]
fn a_module_that_is_not_there_cannot_be_read() {
    let found = message(&Emulated::start().run(&["get", "PDCTRL_MOD", "K_PARAM"]));
    assert!(found.contains("the device has no module PDCTRL_MOD"), "{found}");
}

#[test]
fn an_accepted_command_says_what_still_keeps_the_device_still() {
    let emulated = Emulated::start();
    let mut device = emulated.connect(QUICK);
    let missing = "the device is NOT commanded: PDCTRL_MOD reads DES_POSITION, which has no provider: plug in a \
    module \
                   that writes DES_POSITION";
    let outcome = device.plug_in("PDCTRL_MOD", None).unwrap();
    assert_eq!(outcome.to_string(), format!("PDCTRL_MOD is plugged in at position 1; {missing}"));
    assert!(!outcome.is_commanded);
    let found = message(&emulated.run(&["on", "PDCTRL_MOD"]));
    assert!(found.contains("refused: PDCTRL_MOD is plugged in"), "{found}");

    let check = device.check().unwrap();
    assert_eq!((check.is_running, check.faults, check.findings.len()), (false, 1, 1));
    assert!(missing.ends_with(&check.findings[0].text), "{check:?}");
    assert_eq!(emulated.json(&["check", "--json"], 1)["faults"], 1);
    assert!(emulated.out(&["faults"], 1).contains("  fault: PDCTRL_MOD reads DES_POSITION"));

    device.unplug("PDCTRL_MOD").unwrap();
    let bound = device.set("PDCTRL_MOD", "PORT_DES_POSITION", "POSITION").unwrap();
    assert_eq!(bound.effect, "PDCTRL_MOD PORT_DES_POSITION is POSITION");
    let outcome = device.plug_in("PDCTRL_MOD", None).unwrap();
    assert!(outcome.state.contains("the scheme is stopped; run `check` to start it"), "{outcome}");
    assert!(emulated.out(&["check"], 0).starts_with("the scheme runs and commands the device"));
    let found = message(&emulated.run(&["off", "PDCTRL_MOD"]));
    assert!(
        found.contains("refused: this command would break the running scheme: the device arm reads"),
        "{found}"
    );

    assert!(device.stop().unwrap().state.contains("the scheme is stopped"));
    assert!(!device.overview().unwrap().status.is_running);
}

#[test]
fn faults_name_the_first_tick_that_was_refused() {
    let emulated = Emulated::with_scheme("master");
    assert!(emulated.out(&["faults"], 0).contains("0 of 0 ticks refused"));
    for position in [0.0, f32::NAN, 0.0] {
        emulated.robot.lock().unwrap().tick(position);
    }
    let faults = emulated.json(&["faults", "--json"], 1);
    assert_eq!((&faults["refused_ticks"], &faults["first_fault"]["tick"]), (&1.into(), &2.into()));
    let reason = faults["first_fault"]["reason"].as_str().unwrap();
    assert!(reason.contains("invalid measurement: word 0 of POSITION is NaN or infinite"), "{reason}");
    assert!(faults["state"].as_str().unwrap().contains(reason), "until a reset");
    assert_eq!((&faults["drive"], &faults["cut_out"]), (&"fault".into(), &serde_json::Value::Null));
    assert!(emulated.out(&["reset"], 0).contains("the scheme runs and commands the device"));
    emulated.robot.lock().unwrap().tick(0.0);
    let faults = emulated.json(&["faults", "--json"], 1);
    assert_eq!((&faults["drive"], &faults["first_fault"]["tick"]), (&"operation enabled".into(), &2.into()));
}

#[test]
fn faults_name_the_module_that_failed_with_what_it_wrote() {
    let emulated = Emulated::with_scheme("master");
    emulated.robot.lock().unwrap().tick(0.0);
    emulated.out(&["set", "PDCTRL_MOD", "K_PARAM", "1e6"], 0);
    emulated.robot.lock().unwrap().tick(1e5);
    let faults = emulated.out(&["faults"], 1);
    for part in [
        "the device is NOT commanded: PDCTRL_MOD: module failed (reason 40)",
        "drive: fault",
        "PDCTRL_MOD wrote -1",
        "to word 0 of DES_FORCE (limit 1e9): isolated with the modules that depend on it; lower the module's gains",
        "40 module failed 1",
    ] {
        assert!(faults.contains(part), "{part} is missing:\n{faults}");
    }
}

#[test]
fn a_scheme_sent_row_by_row_leaves_the_controller_as_loading_it_does() {
    for side in SIDES {
        let emulated = Emulated::with_scheme(side);
        let mut loaded = Robot::new().dimsart;
        let scheme = SchemeText::read("builtin:bilateral").unwrap();
        assert_eq!(scheme::load(&scheme.text, side, SIDES, &mut loaded, |error| panic!("{error:?}")), 0);
        assert_eq!(emulated.state(), format!("{loaded:?}"), "{side}");
    }
    let out = Emulated::start().out(&["scheme", "builtin:bilateral", "--side", "slave"], 0);
    let expected = "builtin:bilateral: sent 14 rows for the slave; the scheme runs and commands the device\n";
    assert_eq!(out, expected);
}

#[test]
fn a_scheme_stops_at_its_first_refusal_and_names_the_place() {
    const GOOD: &str = "all PDCTRL_MOD K_PARAM 7\n";
    for (row, expected) in [
        (
            "  all PDCTRL_MOD K_PARAM 3o00 # stiff",
            "2:26: '3o00' is not a number from 0 to 1000000 N/m or N·m/rad",
        ),
        ("all PDCTRL_MOD K_PARAM -1", "2:24: '-1' is not a number from 0 to 1000000"),
        ("all PDCTRL_MOD K_PARAM[9] 1", "2:16: no such axis"),
        (
            "all PDCTRL_MOD K_PARAM",
            "2:23: expected a number from 0 to 1000000 N/m or N·m/rad at the end of the row",
        ),
        ("all PDCTRL_MOD K_PARAM 1 2", "2:26: unexpected word '2' at the end"),
        ("all PDCTL_MOD K_PARAM 1", "2:5: 'PDCTL_MOD' is not a module; did you mean"),
        (
            "all MOD_ENG MOD_UN PDCTRL_MOD",
            "2:13: 'MOD_UN' is not a command of the engine; did you mean 'MOD_ON'?",
        ),
        ("all MOD_ENG STOP NOW", "2:18: unexpected word 'NOW' at the end of the row"),
        (
            "middle PDCTRL_MOD K_PARAM 1",
            "2:1: 'middle' is not a destination; available: master, slave, m&s, all",
        ),
        (
            "all MOD_ENG MOD_ON PDCTRL_MOD\nall MOD_ENG MATCHING_CHECK",
            "3:13: refused: the scheme has 1 fault(s): PDCTRL_MOD reads DES_POSITION, which has no provider",
        ),
    ] {
        let emulated = Emulated::start();
        let mut device = emulated.connect(QUICK);
        device.set("PDCTRL_MOD", "K_PARAM", "5").unwrap();
        let rows = format!("{GOOD}{row}\nall PDCTRL_MOD K_PARAM 8\n");
        let error = device.send_scheme(&text(&rows), "master").unwrap_err();
        let message = error.to_string();
        assert!(message.starts_with(&format!("my.scheme:{expected}")), "{row}: {message}");
        let hint = ". The device has 1 modules already: use `--replace` to replace them";
        assert!(message.ends_with(&format!("; nothing has changed{hint}")), "{message}");
        let stiffness = device.get("PDCTRL_MOD", "K_PARAM[0]").unwrap().values;
        assert_eq!(stiffness, [DisplayValue::Real(5.0)], "{row}");
    }
}

#[test]
fn a_scheme_upon_a_scheme_is_told_how_to_replace_it() {
    let emulated = Emulated::with_scheme("master");
    let mut device = emulated.connect(QUICK);
    let scheme = SchemeText::read("builtin:bilateral").unwrap();
    let message = device.send_scheme(&scheme, "master").unwrap_err().to_string();
    assert!(message.contains("The device has 5 modules already: use `--replace`"), "{message}");
    assert_eq!(device.replace_scheme(&scheme, "slave").unwrap().rows, 14);
    let expected = Emulated::with_scheme("slave").connect(QUICK).overview().unwrap();
    assert_eq!(device.overview().unwrap(), expected);
}

#[test]
fn a_scheme_that_cannot_replace_another_one_loses_nothing_of_it() {
    for is_running in [true, false] {
        let emulated = Emulated::with_scheme("master");
        let mut device = emulated.connect(QUICK);
        device.set("PDCTRL_MOD", "K_PARAM[1]", "77").unwrap();
        if !is_running {
            device.stop().unwrap();
        }
        let before = device.overview().unwrap();
        let error =
            device.replace_scheme(&text("all PDCTRL_MOD K_PARAM 7\nall PDCTRL_MOD K_PARM 1\n"), "master");
        let message = error.unwrap_err().to_string();
        assert!(
            message.starts_with("my.scheme:2:16: 'K_PARM' is not a parameter or port of PDCTRL_MOD"),
            "{message}"
        );
        assert!(message.ends_with("; nothing has changed"), "{message}");
        assert_eq!(device.overview().unwrap(), before, "running: {is_running}");
    }
}

#[test]
fn modules_are_reset_initialised_and_closed_one_by_one_or_all() {
    let emulated = Emulated::with_scheme("master");
    assert!(emulated.out(&["reset"], 0).starts_with("all modules reset; the scheme runs"));
    assert!(emulated.out(&["reset", "PDCTRL_MOD"], 0).starts_with("PDCTRL_MOD reset; the scheme runs"));
    let found = message(&emulated.run(&["init", "PDCTRL_MOD"]));
    assert!(found.contains("PDCTRL_MOD is plugged in: unplug it first"), "{found}");
    emulated.out(&["stop"], 0);
    emulated.out(&["off", "PDCTRL_MOD"], 0);
    assert!(emulated.out(&["init", "PDCTRL_MOD"], 0).starts_with("PDCTRL_MOD has its default parameters; "));
    assert!(emulated.out(&["close", "PDCTRL_MOD"], 0).starts_with("PDCTRL_MOD is deleted; "));
    assert_eq!(emulated.connect(QUICK).overview().unwrap().modules.len(), 4);
    assert!(emulated.out(&["close"], 0).starts_with("all modules deleted; "));
    assert_eq!(emulated.connect(QUICK).overview().unwrap().status.usage.modules, 0);
}

#[test]
fn watch_shows_signals_by_name_and_all_of_them_without_one() {
    let emulated = Emulated::with_scheme("master");
    emulated.robot.lock().unwrap().tick(0.125);
    let one = emulated.out(&["watch", "POSITION", "--once"], 0);
    let words: Vec<_> = one.split_whitespace().collect();
    assert_eq!(words, ["POSITION", "m", "or", "rad", "0.125", "0", "0"]);
    let all = emulated.out(&["watch", "--once"], 0);
    assert!(all.contains("MAP") && all.contains("DES_FORCE") && all.contains("sqrt(W)"), "{all}");
    let absent = emulated.out(&["watch", "POSITION.2", "--once"], 0);
    assert!(absent.contains("POSITION.2") && absent.contains("not in the Data Base"), "{absent}");
    let found = message(&emulated.run(&["watch", "POSITON", "--once"]));
    assert!(found.contains("did you mean 'POSITION'?"), "{found}");
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_a_live_view_well() {
    let emulated = Emulated::start();
    let mut watch = Command::new(env!("CARGO_BIN_EXE_dimsart"))
        .args(["connect", &emulated.port, "watch", "POSITION", "--period-s", "0.05"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(watch.stdout.take().unwrap()).lines().map(Result::unwrap);
    let mut out = String::new();
    for tick in ["tick 0: ", "tick 1: "] {
        let seen = lines.by_ref().inspect(|line| out += line).any(|line| line.starts_with(tick));
        assert!(seen, "{out}");
        emulated.robot.lock().unwrap().tick(0.5);
    }
    assert!(Command::new("kill").args(["-INT", &watch.id().to_string()]).status().unwrap().success());
    out.extend(lines);
    assert_eq!(watch.wait().unwrap().code(), Some(0));
    assert!(!out.contains('\x1b'), "no terminal, no escapes");
}

#[test]
fn a_force_of_a_fixed_size_takes_a_running_scheme_s_place() {
    let emulated = Emulated::with_scheme("master");
    let scheme = concat!(env!("CARGO_MANIFEST_DIR"), "/../schemes/first_start.scheme");
    emulated.out(&["stop"], 0);
    emulated.out(&["scheme", scheme, "--side", "master"], 0);
    emulated.out(&["set", "SIGGEN_MOD", "AMPLITUDE[1]", "-0.25"], 0);
    emulated.robot.lock().unwrap().tick(0.5);
    let force = emulated.out(&["watch", "--once", "DES_FORCE"], 0);
    assert!(force.contains("-0.25"), "{force}");
}

#[test]
fn a_transaction_changes_the_scheme_at_once_while_it_runs() {
    let emulated = Emulated::with_scheme("master");
    let before = emulated.connect(QUICK).overview().unwrap();
    let found = emulated.out(&["begin"], 0);
    assert!(
        found.starts_with("transaction open: run `commit` to apply its changes; the scheme runs"),
        "{found}"
    );
    let found = message(&emulated.run(&["begin"]));
    assert!(found.contains("refused: a transaction is open already"), "{found}");
    let found = emulated.out(&["off", "PDCTRL_MOD"], 0);
    let waits = "PDCTRL_MOD is unplugged and keeps its parameters in the pending scheme; run `commit` to apply \
    it; the \
                 scheme runs";
    assert!(found.starts_with(waits), "{found}");
    let found = emulated.out(&["show"], 0);
    assert!(found.contains("transaction open: the modules below belong to the pending scheme"), "{found}");
    assert!(found.contains("  - PDCTRL_MOD, not plugged in"), "{found}");
    let found = message(&emulated.run(&["commit"]));
    assert!(
        found.contains(
            "refused: the scheme has 2 fault(s): WTRANSF_MOD reads DES_FORCE, which has no provider"
        ),
        "{found}"
    );
    for row in
        [&["set", "PIDCTRL_MOD", "K_PARAM", "3000"][..], &["on", "PIDCTRL_MOD", "--before", "TIMEDELAY_MOD"]]
    {
        emulated.out(row, 0);
    }
    let found = emulated.out(&["commit"], 0);
    assert!(found.starts_with("the pending scheme is applied; the scheme runs"), "{found}");
    let after = emulated.connect(QUICK).overview().unwrap();
    assert_eq!(after.modules.iter().find(|module| module.name == "PIDCTRL_MOD").unwrap().place, Some(3));
    // And back, after a discarded transaction.
    let rows = "all MOD_ENG MOD_CLOSE PIDCTRL_MOD\nall MOD_ENG PLACE_BEFORE TIMEDELAY_MOD\nall MOD_ENG MOD_ON \
    PDCTRL_MOD\n";
    let mut device = emulated.connect(QUICK);
    let error =
        device.send_scheme(&text(&format!("{rows}all MOD_ENG MOD_OFF TIMEDELAY_MOD")), "master").unwrap_err();
    assert!(error.to_string().contains("which has no provider"), "{error}");
    assert_eq!(device.overview().unwrap().modules, after.modules);
    device.send_scheme(&text(rows), "master").unwrap();
    assert_eq!(device.overview().unwrap().modules, before.modules);
    let found = message(&emulated.run(&["abort"]));
    assert!(
        found.contains("refused: no transaction is open: open one with BEGIN (`begin` at a device)"),
        "{found}"
    );
}

#[test]
fn the_scheme_that_is_printed_builds_the_same_one() {
    let emulated = Emulated::with_scheme("slave");
    let rows = emulated.out(&["scheme"], 0);
    assert!(rows.lines().all(|row| row.starts_with("all  ")), "{rows}");
    let before = emulated.connect(QUICK).overview().unwrap();
    let empty = Emulated::start();
    let mut device = empty.connect(QUICK);
    device.replace_scheme(&text(&rows), "slave").unwrap();
    assert_eq!(device.overview().unwrap().modules, before.modules);
    assert_eq!(device.scheme_rows(None).unwrap().trim_end(), rows.trim_end());
}

#[test]
fn a_file_that_is_sent_ends_no_transaction() {
    let emulated = Emulated::with_scheme("master");
    let mut device = emulated.connect(QUICK);
    let before = device.overview().unwrap();
    for row in ["BEGIN", "COMMIT", "ABORT"] {
        let rows = format!("all PDCTRL_MOD K_PARAM 7\nall MOD_ENG {row}\nall PDCTRL_MOD K_PARAM 9999\n");
        let message = device.send_scheme(&text(&rows), "master").unwrap_err().to_string();
        assert!(
            message.starts_with(
                "my.scheme:2:13: refused: remove this row, because a file is always sent as one transaction"
            ),
            "{message}"
        );
        assert_eq!(device.overview().unwrap(), before, "{row}");
    }
}

#[test]
fn a_board_whose_ticks_stand_still_is_not_well_and_one_that_does_not_answer_neither() {
    let emulated = Emulated::with_scheme("slave");
    let doctor = |port: &str| {
        let output = crate::emulated::dimsart(&["doctor", "--board", port, "--timeout-s", "0.1"]);
        assert_eq!(output.status.code(), Some(1), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let out = doctor(&emulated.port);
    assert!(
        out.contains("passed   answers: ") && out.contains("FAILED   tick rate over 1 s: 0.0 Hz"),
        "{out}"
    );
    assert!(out.contains("; next: "), "{out}");
    let out = doctor("tcp:localhost:1");
    assert!(out.starts_with("FAILED   answers: ") && out.lines().count() == 1, "{out}");
}

#[test]
fn a_device_whose_lists_have_no_end_is_told_so_and_asked_no_more() {
    let emulated = Emulated::with_scheme("master");
    let robot = Arc::clone(&emulated.robot);
    // Repeats its last answer of the same kind for an unused index.
    let mut last = HashMap::new();
    let port = listen(move |content| {
        let framed = robot.lock().unwrap().answer(content);
        let mut answer = Vec::new();
        Receiver::new().push_all(&framed, |content| answer = content.to_vec());
        let (Ok((id, request)), Ok((_, response))) = (decode_request(content), decode_response(&answer))
        else {
            return framed;
        };
        let kind = std::mem::discriminant(&request);
        if !matches!(response, Response::Refused(Refusal::NotFound)) {
            last.insert(kind, answer.clone());
        }
        match last.get(&kind).and_then(|last: &Vec<u8>| decode_response(last).ok()) {
            Some((_, again)) => encode_response(&again, id, &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec(),
            None => framed,
        }
    });
    let endless = Emulated { port, robot: Arc::clone(&emulated.robot) };
    for arguments in [&["show"][..], &["scheme"]] {
        let begun = Instant::now();
        let found = message(&endless.run(arguments));
        assert!(
            found.contains("the device sent a list that exceeds the maximum length"),
            "{arguments:?}: {found}"
        );
        assert!(begun.elapsed() < TEST_TIMEOUT, "{arguments:?}: {:?}", begun.elapsed());
    }
    for arguments in [&["config", "save"][..], &["doctor", "--board"]] {
        let begun = Instant::now();
        let mut command = Command::new(env!("CARGO_BIN_EXE_dimsart"));
        let output = command.args(arguments).arg(&endless.port).output().unwrap();
        assert!(!output.status.success(), "{arguments:?}: {output:?}");
        assert!(begun.elapsed() < TEST_TIMEOUT, "{arguments:?}: {:?}", begun.elapsed());
    }
}
