//! Stored schemes and timing, of devices that answer like a board.

use std::num::NonZeroU32;
use std::sync::{Arc, Mutex};

use dimsart_core::{CommandError, Cost, Costs, Timing};
use dimsart_link::protocol::{
    Fallback, MAX_FRAME_BYTES, Origin, Refusal, Request, Response, SchemeAction, SchemeStatus, StoreError,
    Trial, decode_request, encode_response,
};
use dimsart_link::saved_scheme::LoadError;

use crate::emulated::{Emulated, Robot, dimsart, listen, message};

/// A device that gives these answers to scheme requests and records them.
fn keeping(answer: Result<SchemeStatus, Refusal>) -> (String, Arc<Mutex<Vec<SchemeAction>>>) {
    let (mut robot, asked) = (Robot::new(), Arc::new(Mutex::new(Vec::new())));
    let mut timing = Timing::default();
    timing.count(true, false);
    timing.measure(4_000);
    robot.info.set_timing(timing);
    robot.dimsart.engine_mut().set_costs(Some(Costs::new(const { &[Cost::new(700, 100)] }, &[])));
    robot.dimsart.engine_mut().set_cycle_limit(NonZeroU32::new(9_000));
    let notes = Arc::clone(&asked);
    let port = listen(move |content| match decode_request(content) {
        Ok((id, Request::Schemes(action))) => {
            notes.lock().unwrap().push(action);
            let response = answer.map_or_else(Response::Refused, Response::Schemes);
            encode_response(&response, id, &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec()
        }
        _ => robot.answer(content),
    });
    (port, asked)
}

fn status(origin: Origin, fallback: Option<Fallback>, trial: Trial, is_saved: bool) -> SchemeStatus {
    SchemeStatus { origin, fallback, trial, is_saved }
}

fn out(port: &str, action: &str) -> String {
    let output = dimsart(&["connect", port, action]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn each_command_is_given_as_it_is_and_answered_by_how_the_schemes_stand_and_what_comes_next() {
    let not_confirmed = Some(Fallback::Unconfirmed);
    let other_image = Some(Fallback::Trial(LoadError::IncompatibleImage));
    let refused = LoadError::Refused { command: 4, error: CommandError::HasFaults { faults: 2 } };
    for (action, expected, found, lines) in [
        (
            "save",
            SchemeAction::Save,
            status(Origin::BuiltIn, None, Trial::Pending, false),
            "started with the built-in scheme\nthe next start runs the scheme on trial, once\n",
        ),
        (
            "confirm",
            SchemeAction::Confirm,
            status(Origin::Trial, None, Trial::None, true),
            "started with the scheme on trial\n",
        ),
        (
            "rollback",
            SchemeAction::RollBack,
            status(Origin::Saved, not_confirmed, Trial::None, true),
            "started with the saved scheme: the scheme on trial was started before and not confirmed\n",
        ),
        (
            "save",
            SchemeAction::Save,
            status(Origin::Trial, None, Trial::Tried, true),
            "started with the scheme on trial\nrun `confirm` to keep the scheme; without `confirm` the next start runs \
             the saved scheme\n",
        ),
        (
            "save",
            SchemeAction::Save,
            status(Origin::BuiltIn, other_image, Trial::Tried, false),
            "started with the built-in scheme: cannot load the scheme on trial: saved by an image with other \
             modules, parameters or data types: save the scheme again\nthe scheme on trial does not run again: `save` another \
             scheme\n",
        ),
        (
            "rollback",
            SchemeAction::RollBack,
            status(Origin::Saved, Some(Fallback::Damaged), Trial::None, true),
            "started with the saved scheme: a storage entry is damaged or incomplete, an older entry was loaded: \
             `save` the scheme again\n",
        ),
        (
            "rollback",
            SchemeAction::RollBack,
            status(Origin::Saved, Some(Fallback::NotRecorded), Trial::None, true),
            "started with the saved scheme: the scheme on trial was not started, because storage could not record the \
             trial: `save` the scheme again\n",
        ),
        (
            "rollback",
            SchemeAction::RollBack,
            status(Origin::Empty, Some(Fallback::BuiltIn(refused)), Trial::None, false),
            "started without a scheme: cannot load the built-in scheme: command 5 was refused: the scheme has \
             2 fault(s) and does not start; run `faults` to list them\n",
        ),
    ] {
        let (port, asked) = keeping(Ok(found));
        assert_eq!(out(&port, action), lines);
        assert_eq!(*asked.lock().unwrap(), [expected]);
    }
}

#[test]
fn what_a_board_refuses_is_told_with_what_to_do() {
    for (refusal, expected) in [
        (Refusal::Store(StoreError::NoStorage), "the device cannot store schemes"),
        (Refusal::Store(StoreError::SchemeIsRunning), "`stop` the scheme first"),
        (Refusal::Store(StoreError::TooLong), "the scheme exceeds 920 bytes"),
        (Refusal::Store(StoreError::NoTrial), "restart the device"),
        (Refusal::Store(StoreError::Storage), "uses the earlier data"),
        (Refusal::Engine(CommandError::HasFaults { faults: 1 }), "run `faults` to list them"),
    ] {
        let (port, _) = keeping(Err(refusal));
        let found = message(&dimsart(&["connect", &port, "save"]));
        assert!(found.contains(expected), "{found}");
    }
}

#[test]
fn show_has_timing_and_schemes_where_the_device_has_them() {
    let (port, _) = keeping(Ok(status(Origin::Saved, None, Trial::None, true)));
    let text = out(&port, "show");
    let lines = "1 ticks started late, 0 overran; tick: last 4000 cycles, mean 4000, max 4000; \
                 WCET bound from the machine code: 1000 cycles, limit 9000 cycles\n\
                 started with the saved scheme\n";
    assert!(text.contains(lines), "{text}");
    let json = dimsart(&["connect", &port, "show", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    assert_eq!(json["status"]["timing"]["max_cycles"], 4000);
    assert_eq!(json["status"]["timing"]["bound_cycles"], 1000);
    assert_eq!(json["status"]["schemes"]["origin"], "saved");

    let without = Emulated::start();
    let json = without.json(&["show", "--json"], 0);
    assert!(json["status"]["timing"].is_null() && json["status"]["schemes"].is_null(), "{json}");
}
