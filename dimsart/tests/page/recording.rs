//! What is recorded from a page: every tick, as the controller sent it, until somebody ends it or there is no more.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use dimsart::connect::{Tap, TapRow};
use hil_sim::schemes::SchemeText;
use serde_json::{Value, json};

use crate::{Browser, Served};

fn record(on: bool) -> Value {
    json!({ "do": "record", "on": on })
}

fn begin(browser: &mut Browser) -> String {
    browser.ask(record(true)).unwrap().as_str().unwrap().to_owned()
}

/// Until there are some rows.
fn wait_for_rows(browser: &mut Browser, path: &str) {
    browser.news("recording", |now| {
        now["is_running"] == true && now["path"] == path && now["rows"].as_u64() > Some(300)
    });
}

/// Until it has ended by itself; what it came to.
fn wait_for_end(browser: &mut Browser, path: &str) -> String {
    let ended = browser.news("recording", |now| now["is_running"] == false && now["path"] == path);
    ended["text"].as_str().unwrap().to_owned()
}

/// Values of every tick in a finished file, whose ticks are all there.
fn read(path: &Path) -> BTreeMap<u32, Vec<f64>> {
    let bytes = std::fs::read(path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    assert_eq!(summary.attachment_indexes.len(), 2, "what was recorded, and its scheme");
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
    assert!(second.ask(record(false)).unwrap_err().contains("nothing is recorded"));
    // What another client gets of the same ticks.
    let (mut device, is_over) = (served.device(), Arc::new(AtomicBool::new(false)));
    let over = Arc::clone(&is_over);
    let listening = thread::spawn(move || {
        let (mut tap, mut rows) = (Tap::new(1), Vec::<TapRow>::new());
        while !over.load(Ordering::Relaxed) {
            rows.extend(device.tap(&mut tap, Duration::from_millis(20)).unwrap());
        }
        rows
    });
    let path = begin(&mut first);
    assert!(path.ends_with("joint-1/signals.mcap"), "{path}");
    assert!(second.ask(record(true)).unwrap_err().contains("already"));
    // It is the station's: the browser that has begun it goes.
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

    // Another one is beside it, and goes on while nobody looks.
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
    // Other signals.
    let path = begin(&mut browser);
    wait_for_rows(&mut browser, &path);
    let text = "all SIGGEN_MOD.2 PORT_SIGNAL_OUT SIGNAL_OUT.2\nall MOD_ENG MOD_ON SIGGEN_MOD.2\nall MOD_ENG MATCHING_CHECK";
    let scheme = SchemeText { name: "more".to_owned(), text: text.to_owned() };
    served.device().send_scheme(&scheme, "joint").unwrap();
    let text = wait_for_end(&mut browser, &path);
    assert!(
        text.contains("rows of 3 signals") && text.contains("the scheme has other signals now"),
        "{text}"
    );
    assert!(read(Path::new(&path)).len() > 300);
    // No line.
    let path = begin(&mut browser);
    wait_for_rows(&mut browser, &path);
    served.trouble.is_deaf.store(true, Ordering::Relaxed);
    let text = wait_for_end(&mut browser, &path);
    assert!(text.contains("rows of 4 signals") && text.contains("the line has ended"), "{text}");
    assert!(read(Path::new(&path)).len() > 300);
    served.trouble.is_deaf.store(false, Ordering::Relaxed);
    // No server.
    browser.news("gone", Value::is_null);
    browser.news("status", |_| true);
    let path = begin(&mut browser);
    wait_for_rows(&mut browser, &path);
    let texts = served.page.end_recordings();
    assert!(matches!(texts.as_slice(), [text] if text.contains("`dimsart serve` was ended")), "{texts:?}");
    assert!(read(Path::new(&path)).len() > 300);
    assert_eq!(served.page.end_recordings(), Vec::<String>::new());
}
