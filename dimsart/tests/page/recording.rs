//! Recordings of the page: every tick, as sent by the controller, until a client ends the recording or the rows end.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use dimsart::connect::{Subscription, SubscriptionRow};
use hil_sim::schemes::SchemeText;
use serde_json::{Value, json};

use crate::{Browser, Served};

fn record(on: bool) -> Value {
    json!({ "do": "record", "on": on })
}

fn begin(browser: &mut Browser) -> String {
    browser.ask(record(true)).unwrap().as_str().unwrap().to_owned()
}

/// Waits until there are some rows.
fn wait_for_rows(browser: &mut Browser, path: &str) {
    browser.news("recording", |now| {
        now["is_running"] == true && now["path"] == path && now["rows"].as_u64() > Some(300)
    });
}

/// Waits until the recording has ended by itself; returns its summary.
fn wait_for_end(browser: &mut Browser, path: &str) -> String {
    let ended = browser.news("recording", |now| now["is_running"] == false && now["path"] == path);
    ended["text"].as_str().unwrap().to_owned()
}

/// Returns the values of every tick of a finished file; checks that no tick is missing.
fn read(path: &Path) -> BTreeMap<u32, Vec<f64>> {
    let bytes = std::fs::read(path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    assert_eq!(summary.attachment_indexes.len(), 2, "device and scheme");
    let mut rows = BTreeMap::new();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        let values =
            message.data[20..].chunks(4).map(|word| f32::from_le_bytes(word.try_into().unwrap()).into());
        let tick = u64::from_le_bytes(message.data[4..12].try_into().unwrap());
        rows.insert(u32::try_from(tick).unwrap(), values.collect());
    }
    let (first, last) = (rows.keys().next().unwrap(), rows.keys().last().unwrap());
    assert_eq!(rows.len(), usize::try_from(last - first + 1).unwrap(), "a tick is missing");
    rows
}

#[test]
fn a_recording_has_every_tick_as_it_was_whoever_begins_and_ends_it() {
    let served = Served::joint("record");
    let (mut first, mut second) = (served.browser(), served.browser());
    assert!(second.ask(record(false)).unwrap_err().contains("no recording is running"));
    // Another client receives the same ticks.
    let (mut device, is_over) = (served.device(), Arc::new(AtomicBool::new(false)));
    let over = Arc::clone(&is_over);
    let listening = thread::spawn(move || {
        let (mut tap, mut rows) = (Subscription::new(1), Vec::<SubscriptionRow>::new());
        while !over.load(Ordering::Relaxed) {
            rows.extend(device.receive_rows(&mut tap, Duration::from_millis(20)).unwrap());
        }
        rows
    });
    let path = begin(&mut first);
    assert!(path.ends_with("joint-1/signals.mcap"), "{path}");
    assert!(second.ask(record(true)).unwrap_err().contains("already"));
    // The recording belongs to the station: it continues after its browser disconnects.
    drop(first);
    wait_for_rows(&mut second, &path);
    let came_to = second.ask(record(false)).unwrap();
    is_over.store(true, Ordering::Relaxed);
    let sent = listening.join().unwrap();
    let rows = read(Path::new(&path));
    let expected = format!("{path}: {} rows of 3 signals, 0 samples lost", rows.len());
    assert_eq!(came_to.as_str(), Some(expected.as_str()));
    let same = sent.iter().filter(|row| rows.get(&row.tick).is_some_and(|values| *values == row.values));
    let both = sent.iter().filter(|row| rows.contains_key(&row.tick)).count();
    assert!(both > 200, "{both}");
    assert_eq!(same.count(), both, "other values");

    // A further recording gets its own folder, and continues without a browser.
    let before = std::fs::read(&path).unwrap();
    let next = begin(&mut second);
    assert!(next.ends_with("joint-2/signals.mcap"), "{next}");
    drop(second);
    thread::sleep(Duration::from_millis(500));
    let mut third = served.browser();
    wait_for_rows(&mut third, &next);
    third.ask(record(false)).unwrap();
    assert!(read(Path::new(&next)).len() > 300);
    assert_eq!(std::fs::read(&path).unwrap(), before);
    assert_eq!(std::fs::read_dir(served.recordings.path()).unwrap().count(), 2);
}

#[test]
fn a_recording_that_cannot_go_on_ends_with_its_reason_and_a_whole_file() {
    let served = Served::joint("cut");
    let mut browser = served.browser();
    // The signals change.
    let path = begin(&mut browser);
    wait_for_rows(&mut browser, &path);
    let text = "all SIGGEN_MOD.2 PORT_SIGNAL_OUT SIGNAL_OUT.2\nall MOD_ENG MOD_ON SIGGEN_MOD.2\nall MOD_ENG MATCHING_CHECK";
    let scheme = SchemeText { name: "more".to_owned(), text: text.to_owned() };
    served.device().send_scheme(&scheme, "joint").unwrap();
    let text = wait_for_end(&mut browser, &path);
    assert!(
        text.contains("rows of 3 signals") && text.contains("the signals of the scheme changed"),
        "{text}"
    );
    assert!(read(Path::new(&path)).len() > 300);
    // The line closes.
    let path = begin(&mut browser);
    wait_for_rows(&mut browser, &path);
    served.trouble.is_deaf.store(true, Ordering::Relaxed);
    let text = wait_for_end(&mut browser, &path);
    assert!(text.contains("rows of 4 signals") && text.contains("connection to the device closed"), "{text}");
    assert!(read(Path::new(&path)).len() > 300);
    served.trouble.is_deaf.store(false, Ordering::Relaxed);
    // The server ends.
    browser.news("gone", Value::is_null);
    browser.news("status", |_| true);
    let path = begin(&mut browser);
    wait_for_rows(&mut browser, &path);
    let texts = served.page.end_recordings();
    assert!(
        matches!(texts.as_slice(), [text] if text.contains("recording ended with `dimsart serve`")),
        "{texts:?}"
    );
    assert!(read(Path::new(&path)).len() > 300);
    assert_eq!(served.page.end_recordings(), Vec::<String>::new());
}
