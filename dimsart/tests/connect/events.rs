//! Event log of a controller.

use crate::emulated::Emulated;

#[test]
fn a_device_on_which_nothing_happened_says_so() {
    let out = Emulated::start().out(&["events"], 0);
    assert!(out.contains("no events"), "{out}");
}

/// From the fault to the recovery, with ticks, module, signal and value.
#[test]
fn events_tell_what_led_to_a_fault_and_who_ended_it() {
    let emulated = Emulated::with_scheme("master");
    let tick = |position| emulated.robot.lock().unwrap().tick(position);
    tick(0.0);
    emulated.out(&["set", "PDCTRL_MOD", "K_PARAM", "1e6"], 0);
    tick(1e5);
    tick(0.0);
    emulated.out(&["reset"], 0);
    tick(0.0);
    tick(f32::NAN);

    let expected = [
        "     1  tick         0  130 scheme changed",
        "     2  tick         1    0 the scheme commands the device",
        "     3  tick         2   40 module failed: PDCTRL_MOD wrote -100000000000 to word 0 of DES_FORCE (limit \
         1e9): isolated with the modules that depend on it; lower the module's gains or check its inputs, then `reset`",
        "     4  tick         3  129 reset",
        "     5  tick         4    0 the scheme commands the device",
        "     6  tick         5   32 measurement refused: word 0 of POSITION is NaN or infinite",
    ];
    assert_eq!(emulated.out(&["events"], 0).lines().collect::<Vec<_>>(), expected);
}

/// More events than are kept: the last ones are shown, each once, in order, in text and JSON.
#[test]
fn the_last_64_events_are_told() {
    let emulated = Emulated::with_scheme("master");
    for _ in 0..100 {
        emulated.robot.lock().unwrap().tick(f32::NAN);
        emulated.out(&["reset"], 0);
    }
    let events = emulated.json(&["events", "--json"], 0);
    let events = events.as_array().unwrap();
    let numbers: Vec<u64> = events.iter().map(|event| event["number"].as_u64().unwrap()).collect();
    let last = numbers.last().copied().unwrap();
    assert!(last > 100, "{last}");
    assert_eq!(numbers, (last - 63..=last).collect::<Vec<_>>());
    assert!(events.iter().all(|event| [32, 129].contains(&event["what"].as_u64().unwrap())));
}
