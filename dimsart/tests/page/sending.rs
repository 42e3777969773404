//! Selection of the signals of a controller that cannot send all of them.

use std::fmt::Write as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use dimsart::connect::Subscription;
use dimsart_link::protocol::MAX_TELEMETRY_SIGNALS;
use hil_sim::response::TELEMETRY_STREAMS;
use hil_sim::schemes::SchemeText;
use serde_json::{Value, json};
use tungstenite::Message;

use crate::{Browser, Served};

fn names(layout: &Value) -> Vec<&str> {
    layout["signals"].as_array().unwrap().iter().map(|signal| signal["name"].as_str().unwrap()).collect()
}

/// Returns the number of values of the next row of a layout.
fn width(browser: &mut Browser, layout: &Value) -> u16 {
    browser.wait(|message| match message {
        Message::Binary(bytes) => {
            let number = u32::from_le_bytes(bytes[4..8].try_into().unwrap());
            (layout["number"] == number).then(|| u16::from_le_bytes([bytes[2], bytes[3]]))
        }
        _ => None,
    })
}

#[test]
fn what_a_device_with_one_stream_sends_is_chosen_for_every_page() {
    let served = Served::joint("choose");
    let mut rows = String::new();
    for number in 2..8 {
        let module = format!("SIGGEN_MOD.{number}");
        let _ =
            writeln!(rows, "all {module} PORT_SIGNAL_OUT SIGNAL_OUT.{number}\nall MOD_ENG MOD_ON {module}");
    }
    let scheme = SchemeText { name: "more".to_owned(), text: rows + "all MOD_ENG MATCHING_CHECK" };
    let mut other = served.device();
    other.send_scheme(&scheme, "joint").unwrap();
    // Another client uses all streams but one, as on a board.
    let taken = vec!["POSITION".to_owned(); (TELEMETRY_STREAMS - 1) * MAX_TELEMETRY_SIGNALS];
    let mut tap = Subscription::new(100).with_signals(&taken);
    other.receive_rows(&mut tap, Duration::from_millis(1)).unwrap();
    assert_eq!(tap.signals().len(), taken.len());
    let is_over = Arc::new(AtomicBool::new(false));
    let over = Arc::clone(&is_over);
    let keeping = thread::spawn(move || {
        while !over.load(Ordering::Relaxed) {
            other.receive_rows(&mut tap, Duration::from_millis(20)).unwrap();
        }
    });

    let (mut browser, mut onlooker) = (served.browser(), served.browser());
    let stream = |names: &[&str]| json!({ "do": "stream", "names": names });
    let first = onlooker.news("layout", |layout| names(layout).len() == 4);
    assert_eq!(names(&first)[..3], ["POSITION", "DES_POSITION", "DES_FORCE"]);
    assert_eq!(first["unsent"].as_array().unwrap().len(), 5, "{first}");
    // A refused selection: the previous signals continue.
    let too_many = ["POSITION", "DES_POSITION", "DES_FORCE", "SIGNAL_OUT.2", "SIGNAL_OUT.3"];
    for (wanted, reason) in [
        (&["POSITON"][..], "did you mean 'POSITION'?"),
        (&["POSITION", "VELOCITY"], "VELOCITY is not in the Data Base of joint"),
        (&too_many, "together: a board sends at most 4 signals with 12 words"),
    ] {
        let refused = browser.ask(stream(wanted)).unwrap_err();
        assert!(refused.contains(reason), "{refused}");
        assert_eq!(width(&mut browser, &first), 4, "after {wanted:?}");
    }
    // The selected signals are sent in their order; the others can be selected.
    let done = browser.ask(stream(&["SIGNAL_OUT.7", "POSITION"])).unwrap();
    assert_eq!(done, "the device sends SIGNAL_OUT.7, POSITION");
    let chosen = onlooker.news("layout", |layout| names(layout).len() == 2);
    assert_eq!(names(&chosen), ["SIGNAL_OUT.7", "POSITION"]);
    assert_eq!(chosen["unsent"].as_array().unwrap().len(), 7, "{chosen}");
    assert_eq!(width(&mut onlooker, &chosen), 2);
    // A recording contains the sent signals.
    browser.ask(json!({ "do": "record", "on": true })).unwrap();
    assert!(browser.ask(stream(&[])).unwrap_err().contains("end the recording first"));
    onlooker.news("recording", |now| now["rows"].as_u64() > Some(100));
    let text = browser.ask(json!({ "do": "record", "on": false })).unwrap();
    assert!(text.as_str().unwrap().contains("rows of 2 signals"), "{text}");
    // Back to the first signals.
    browser.ask(stream(&[])).unwrap();
    let last = onlooker.news("layout", |layout| names(layout).len() == 4);
    assert_eq!(names(&last), names(&first));
    is_over.store(true, Ordering::Relaxed);
    keeping.join().unwrap();
}
