//! The page's server without a browser: access, end of motion, and completeness of ticks.
#![cfg(unix)]
#![expect(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    reason = "in helpers of tests as in tests"
)]

#[path = "page/recording.rs"]
mod recording;
#[path = "page/sending.rs"]
mod sending;

use std::fmt::Write as _;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use dimsart::broker::{self, SharedPort};
use dimsart::connect::{Device, Timeouts};
use dimsart::page::{Access, OpenLine, Page, Station};
use hil_sim::clock;
use hil_sim::link::Stream;
use hil_sim::response::LiveRig;
use hil_sim::rig_file::RigFile;
use serde_json::{Value, json};
use tempfile::TempDir;
use test_requirements::TEST_TIMEOUT;
use tungstenite::client::IntoClientRequest;
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Message, WebSocket};

const PATIENCE: Timeouts = Timeouts { timeout: Duration::from_secs(20), tries: 3 };
/// Time scale for a busy machine: a lease lasts one second of the computer's time.
const SPEED: f64 = 0.2;

/// A simulated rig of one controller, and its page.
struct Served {
    port: String,
    url: String,
    page: Page,
    /// Folder for recordings.
    recordings: TempDir,
    stop: Arc<AtomicBool>,
    running: Option<JoinHandle<()>>,
    _shared: SharedPort,
    trouble: Arc<Trouble>,
}

/// Faults of the page's lines.
#[derive(Debug, Default)]
struct Trouble {
    /// Drops bytes from the device.
    is_deaf: AtomicBool,
    /// Drops bytes to the device.
    is_mute: AtomicBool,
    /// Delay of all bytes from the device, ms.
    delay_ms: AtomicU64,
}

/// A line of the page.
#[derive(Debug)]
struct Troubled(Box<dyn Stream>, Arc<Trouble>);

impl Read for Troubled {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let read = self.0.read(buffer);
        if self.1.is_deaf.load(Ordering::Relaxed) && matches!(read, Ok(1..)) {
            return Err(std::io::ErrorKind::WouldBlock.into());
        }
        if matches!(read, Ok(1..)) {
            clock::sleep(Duration::from_millis(self.1.delay_ms.load(Ordering::Relaxed)));
        }
        read
    }
}

impl Write for Troubled {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        if self.1.is_mute.load(Ordering::Relaxed) { Ok(bytes.len()) } else { self.0.write(bytes) }
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.flush()
    }
}

impl Served {
    fn start(name: &str, text: &str) -> Self {
        clock::set_speed(SPEED);
        let file = RigFile::read(text, name, PathBuf::new(), &[]).unwrap();
        let (live, mut lines) = LiveRig::new(&file).unwrap();
        let port = format!("sim:page-{name}-{}", std::process::id());
        let shared = SharedPort::new(&port, Box::new(lines.remove(0).1)).unwrap();
        let at = port.clone();
        let trouble = Arc::new(Trouble::default());
        let of_lines = Arc::clone(&trouble);
        let open: OpenLine =
            Box::new(move || Ok(Box::new(Troubled(broker::open(&at, 0)?, Arc::clone(&of_lines)))));
        let recordings = tempfile::tempdir().unwrap();
        let folder = Some(recordings.path().to_owned());
        let access = Access {
            port: port.clone(),
            open,
            kinds: dimsart_modules::ALL,
            baud: None,
            hand: None,
            geometry: None,
            recordings: folder,
        };
        let stations = vec![Station::new(0, "joint", access).unwrap()];
        let page = Page::serve(stations, dimsart_modules::ALL, Page::listen(0).unwrap()).unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stop);
        let running = Some(thread::spawn(move || live.run(&flag, |_| ())));
        Self { port, url: page.url(), page, recordings, stop, running, _shared: shared, trouble }
    }

    fn joint(name: &str) -> Self {
        Self::start(name, RigFile::shipped("joint").unwrap())
    }

    fn host(&self) -> &str {
        self.url.split('/').nth(2).unwrap()
    }

    fn token(&self) -> &str {
        self.url.split_once("token=").unwrap().1
    }

    fn device(&self) -> Device<Box<dyn Stream>> {
        Device::identify(broker::open(&self.port, 0).unwrap(), PATIENCE, dimsart_modules::ALL).unwrap()
    }

    /// Returns the status line of an answer.
    fn get(&self, path: &str, host: &str) -> String {
        let mut stream = TcpStream::connect(self.host()).unwrap();
        write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        answer.lines().next().unwrap().to_owned()
    }

    fn socket(&self, origin: &str, token: &str) -> Result<Browser, tungstenite::Error> {
        let mut request = format!("ws://{}/socket?token={token}", self.host()).into_client_request().unwrap();
        request.headers_mut().insert("Origin", origin.parse().unwrap());
        let (socket, _) = tungstenite::connect(request)?;
        if let MaybeTlsStream::Plain(stream) = socket.get_ref() {
            stream.set_read_timeout(Some(Duration::from_millis(50))).unwrap();
        }
        Ok(Browser { socket, next: 1 })
    }

    fn browser(&self) -> Browser {
        self.socket(&format!("http://{}", self.host()), self.token()).unwrap()
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let _ = self.running.take().map(JoinHandle::join);
    }
}

struct Browser {
    socket: WebSocket<MaybeTlsStream<TcpStream>>,
    next: u32,
}

impl Browser {
    fn say(&mut self, what: &Value) {
        self.socket.send(Message::text(what.to_string())).unwrap();
    }

    /// Reads messages until one satisfies the condition.
    fn wait<T>(&mut self, mut wanted: impl FnMut(&Message) -> Option<T>) -> T {
        let deadline = Instant::now() + TEST_TIMEOUT;
        while Instant::now() < deadline {
            if let Ok(message) = self.socket.read()
                && let Some(found) = wanted(&message)
            {
                return found;
            }
        }
        panic!("the expected news never arrived");
    }

    fn news(&mut self, kind: &str, is_it: impl Fn(&Value) -> bool) -> Value {
        self.wait(|message| {
            let value: Value = serde_json::from_str(message.to_text().ok()?).ok()?;
            (value["kind"] == kind && is_it(&value["content"])).then(|| value["content"].clone())
        })
    }

    /// Reports presence until news satisfies the condition.
    fn stay_until(&mut self, kind: &str, is_it: impl Fn(&Value) -> bool) {
        let (deadline, mut said) = (Instant::now() + TEST_TIMEOUT, None::<Instant>);
        while Instant::now() < deadline {
            if said.is_none_or(|said| clock::elapsed_since(said) > Duration::from_millis(50)) {
                self.say(&json!({ "say": "here" }));
                said = Some(clock::now());
            }
            let Ok(message) = self.socket.read() else { continue };
            let value: Option<Value> =
                message.to_text().ok().and_then(|text| serde_json::from_str(text).ok());
            if value.is_some_and(|value| value["kind"] == kind && is_it(&value["content"])) {
                return;
            }
        }
        panic!("the expected news never arrived");
    }

    /// Requests an action and returns its result.
    fn ask(&mut self, mut what: Value) -> Result<Value, String> {
        self.next += 1;
        (what["id"], what["station"]) = (self.next.into(), 0.into());
        if what["say"].is_null() {
            what["say"] = "do".into();
        }
        self.say(&what);
        let id = self.next;
        let answer: Value = self.wait(|message| {
            let value: Value = serde_json::from_str(message.to_text().ok()?).ok()?;
            (value["kind"] == "answer" && value["id"] == id).then_some(value)
        });
        match answer["refused"].as_str() {
            Some(refused) => Err(refused.to_owned()),
            None => Ok(answer["done"].clone()),
        }
    }
}

/// Returns the time until no client holds the lease.
fn time_to_rest(device: &mut Device<Box<dyn Stream>>) -> Duration {
    let start = clock::now();
    while device.live().unwrap().holder.is_some() {
        assert!(clock::elapsed_since(start) < TEST_TIMEOUT, "the device is still moving");
        device.listen(Duration::from_millis(2)).unwrap();
    }
    clock::elapsed_since(start)
}

#[test]
fn nobody_gets_in_without_the_token_from_another_page_or_by_another_name() {
    let served = Served::joint("entry");
    let (host, token) = (served.host().to_owned(), served.token().to_owned());
    let with_token = format!("/?token={token}");
    assert!(served.get(&with_token, &host).contains("200"));
    assert!(served.get("/", &host).contains("401"));
    assert!(served.get("/?token=", &host).contains("401"));
    assert!(served.get(&with_token, "rebound.example").contains("403"));
    let own = format!("http://{host}");
    for (origin, token) in [("http://evil.example", token.as_str()), ("null", token.as_str()), (&own, "0")] {
        assert!(served.socket(origin, token).is_err(), "{origin} {token}");
    }
    assert!(served.socket(&own, &token).is_ok());
}

/// Moves the device from a page for a while.
fn hold(browser: &mut Browser) {
    browser.ask(json!({ "do": "arm" })).unwrap();
    browser.stay_until("status", |status| {
        status["live"]["is_commanded"] == true && status["holder"].is_number()
    });
}

#[test]
fn a_page_moves_a_device_until_it_closes_falls_silent_or_somebody_stops() {
    let served = Served::joint("lease");
    let mut device = served.device();
    let mut browser = served.browser();
    // Another page observes: it can neither take over nor change anything.
    let mut other = served.browser();
    hold(&mut browser);
    let set =
        json!({ "do": "edit", "edit": "set", "module": "PIDCTRL_MOD", "parameter": "K_PARAM", "value": "1" });
    for action in [json!({ "do": "arm" }), json!({ "do": "disarm" }), json!({ "do": "reset" }), set] {
        assert!(other.ask(action).unwrap_err().contains("another client"));
    }
    // The page closes.
    assert!(device.live().unwrap().is_commanded);
    drop(browser);
    assert!(time_to_rest(&mut device) < Duration::from_millis(500));
    // The page sleeps: it reports no presence.
    let mut browser = served.browser();
    hold(&mut browser);
    assert!(time_to_rest(&mut device) < Duration::from_millis(1200));
    other.news("lost", |lost| lost["reason"].as_str().unwrap().contains("silent for 0.5 s"));
    // The observing page stops the device.
    hold(&mut browser);
    other.ask(json!({ "say": "stop" })).unwrap();
    assert!(!device.live().unwrap().is_commanded);
}

#[test]
fn a_lease_that_was_told_to_be_lost_is_lost() {
    let served = Served::joint("gap");
    let (mut device, mut browser) = (served.device(), served.browser());
    hold(&mut browser);
    // Renewals arrive, but their answers are lost: for the page, the lease may have expired.
    served.trouble.is_deaf.store(true, Ordering::Relaxed);
    for _ in 0..8 {
        browser.say(&json!({ "say": "here" }));
        clock::sleep(Duration::from_millis(50));
    }
    served.trouble.is_deaf.store(false, Ordering::Relaxed);
    browser.news("lost", |_| true);
    // The page still reports presence.
    browser.stay_until("status", |status| status["holder"].is_null());
    time_to_rest(&mut device);
    // It can arm again.
    hold(&mut browser);
}

#[test]
fn what_waits_when_the_line_comes_back_moves_nothing() {
    let served = Served::joint("outage");
    let (mut device, mut browser) = (served.device(), served.browser());
    browser.news("status", |_| true);
    served.trouble.is_mute.store(true, Ordering::Relaxed);
    // The page notices the loss first; then it tries to reach the device repeatedly.
    for id in [900, 901] {
        browser.say(&json!({ "say": "do", "id": id, "station": 0, "do": "arm" }));
        browser.say(&json!({ "say": "stop", "id": id + 10, "station": 0 }));
        clock::sleep(Duration::from_millis(1700));
    }
    served.trouble.is_mute.store(false, Ordering::Relaxed);
    let mut refused = Vec::new();
    browser.wait(|message| {
        let answer: Value = serde_json::from_str(message.to_text().ok()?).ok()?;
        if answer["kind"] == "answer" && answer["id"].as_u64() < Some(910) {
            refused.push(answer["refused"].as_str().expect("the request was carried out").to_owned());
        }
        (refused.len() == 2).then_some(())
    });
    let start = clock::now();
    while clock::elapsed_since(start) < Duration::from_secs(1) {
        browser.say(&json!({ "say": "here" }));
        assert_eq!(device.live().unwrap().holder, None);
        device.listen(Duration::from_millis(20)).unwrap();
    }
}

#[test]
fn a_page_that_closes_in_the_middle_of_a_long_change_moves_nothing_any_more() {
    let served = Served::joint("long");
    let (mut device, mut browser) = (served.device(), served.browser());
    browser.news("overview", |_| true);
    hold(&mut browser);
    served.trouble.delay_ms.store(20, Ordering::Relaxed);
    let set = json!({ "edit": "set", "module": "PIDCTRL_MOD", "parameter": "K_PARAM", "value": "120" });
    let edits = vec![set; 30];
    browser.say(
        &json!({ "say": "do", "id": 7, "station": 0, "do": "transaction", "edits": edits, "commit": false }),
    );
    clock::sleep(Duration::from_millis(20));
    assert!(device.live().unwrap().is_commanded);
    drop(browser);
    let time = time_to_rest(&mut device);
    assert!(time < Duration::from_millis(1200), "{time:?}");
}

#[test]
fn idle_connections_keep_neither_a_page_nor_a_stop_out() {
    let served = Served::joint("idle");
    let mut idle: Vec<TcpStream> = (0..400).map(|_| TcpStream::connect(served.host()).unwrap()).collect();
    let with_token = format!("/?token={}", served.token());
    assert!(served.get(&with_token, served.host()).contains("200"));
    let mut browser = served.browser();
    browser.ask(json!({ "say": "stop" })).unwrap();
    assert!(!served.device().stop().unwrap().is_commanded);
    // The oldest connections were closed for new ones.
    assert_eq!(idle[0].read(&mut [0]).unwrap_or_default(), 0);
}

#[test]
fn stopping_waits_for_nobody_on_the_page() {
    let served = Served::joint("stop");
    let mut browser = served.browser();
    browser.news("overview", |_| true);
    // Long enough to fill the buffer of a line that is not read.
    clock::sleep(Duration::from_secs(3));
    let mut times: Vec<Duration> = (0..20)
        .map(|_| {
            let start = clock::now();
            browser.ask(json!({ "say": "stop" })).unwrap();
            clock::elapsed_since(start)
        })
        .collect();
    assert!(times[0] < Duration::from_millis(250), "the first one: {times:?}");
    times.sort();
    // The device itself stops within its next tick; on a busy machine, threads are sometimes late.
    assert!(times[10] < Duration::from_millis(40), "{times:?}");
}

#[test]
fn edits_are_tried_without_effect_and_take_effect_together_or_not_at_all() {
    let served = Served::joint("edits");
    let mut browser = served.browser();
    let set = |parameter: &str, value: &str| json!({ "edit": "set", "module": "PIDCTRL_MOD", "parameter": parameter, "value": value });
    let gain = |device: &mut Device<Box<dyn Stream>>| {
        device.get("PIDCTRL_MOD", "K_PARAM").unwrap().values[0].to_string()
    };
    let mut device = served.device();
    let before = gain(&mut device);
    // Checked without applying.
    let edits = json!([set("K_PARAM", "123"), set("I_PARAM", "7")]);
    let tried = browser.ask(json!({ "do": "transaction", "edits": edits, "commit": false })).unwrap();
    assert_eq!((tried["faults"].as_u64(), gain(&mut device)), (Some(0), before.clone()));
    // A mismatch names its module and signal, and changes nothing.
    let plug = |edit: &str| json!({ "edit": edit, "module": "PIDCTRL_MOD", "before": null });
    let wrong = json!([plug("off"), set("K_PARAM", "123"), set("PORT_DES_FORCE", "POSITION"), plug("on")]);
    let tried = browser.ask(json!({ "do": "transaction", "edits": wrong, "commit": false })).unwrap();
    assert!(tried["faults"].as_u64().unwrap() > 0, "{tried}");
    assert!(tried["findings"].to_string().contains("PIDCTRL_MOD"), "{tried}");
    browser.ask(json!({ "do": "transaction", "edits": wrong, "commit": true })).unwrap_err();
    // Out of range.
    let wild = json!([set("I_PARAM", "7"), set("K_PARAM", "1e30")]);
    browser.ask(json!({ "do": "transaction", "edits": wild, "commit": true })).unwrap_err();
    assert_eq!(gain(&mut device), before);
    assert!(!device.overview().unwrap().status.is_in_transaction);
    // Applied together.
    browser.ask(json!({ "do": "transaction", "edits": edits, "commit": true })).unwrap();
    assert_eq!(gain(&mut device), "123");
    // The page receives the change.
    browser.news("overview", |overview| overview["modules"].to_string().contains("123"));
}

#[test]
fn a_dry_run_shows_the_pending_scheme_and_the_reason_of_a_refusal() {
    let served = Served::joint("pending");
    let mut browser = served.browser();
    let rows = browser.ask(json!({ "do": "rows" })).unwrap();
    let names = |tried: &serde_json::Value| -> Vec<String> {
        let modules = tried["overview"]["modules"].as_array().unwrap();
        modules.iter().map(|module| module["name"].as_str().unwrap().to_owned()).collect()
    };
    let on = |module: &str| json!({ "edit": "on", "module": module, "before": "PIDCTRL_MOD" });
    // A new module with an empty list, and one whose input has no provider.
    let edits = json!([on("COMM_RXMOD"), on("LOWPASS_MOD")]);
    let mut dry_run = |rows: serde_json::Value, edits: &serde_json::Value| {
        browser.ask(json!({ "do": "transaction", "rows": rows, "edits": edits, "commit": false })).unwrap()
    };
    let tried = dry_run(serde_json::Value::Null, &edits);
    assert_eq!(names(&tried), ["COMM_RXMOD", "LOWPASS_MOD", "PIDCTRL_MOD"], "{tried}");
    let input = &tried["overview"]["modules"][1]["ports"][0];
    assert_eq!((&input["unit"], &input["shape"]), (&"any".into(), &"1".into()), "{input}");
    assert!(tried["refused"].is_null() && tried["findings"].to_string().contains("SIGNAL"), "{tried}");
    // The first refused edit ends the dry run.
    let wild = json!({ "edit": "set", "module": "LOWPASS_MOD", "parameter": "FREQUENCY", "value": "1e9" });
    let tried = dry_run(serde_json::Value::Null, &json!([on("LOWPASS_MOD"), wild, on("SIGGEN_MOD")]));
    assert!(tried["refused"].as_str().unwrap().contains("100000"), "{tried}");
    assert_eq!(names(&tried), ["LOWPASS_MOD", "PIDCTRL_MOD"]);
    // Rows replace the scheme before the edits.
    let close = json!([{ "edit": "close", "module": "PIDCTRL_MOD" }]);
    assert_eq!(names(&dry_run(rows.clone(), &json!([]))), ["PIDCTRL_MOD"]);
    assert_eq!(names(&dry_run(rows, &close)), [""; 0]);
    let overview = served.device().overview().unwrap();
    assert!(!overview.status.is_in_transaction && overview.modules.len() == 1, "{overview}");
}

/// Rows for as many signals as fit in a Data Base: a loop, eight receivers without a sender, and generators.
fn wide_scheme() -> String {
    let mut rows = String::new();
    for number in 1..=8 {
        let of = |name: &str| if number == 1 { name.to_owned() } else { format!("{name}.{number}") };
        let module = of("COMM_RXMOD");
        let _ = writeln!(
            rows,
            "all {module} CRX_ADD_DATA {}\nall {module} CRX_LINK {}",
            of("DES_VELOCITY"),
            number - 1
        );
        for port in ["AGE", "LOST", "ROUND_TRIP", "REFUSED", "STATE", "JITTER"] {
            let _ = writeln!(rows, "all {module} PORT_{port} {}", of(&format!("LINK_{port}")));
        }
        let _ = writeln!(rows, "all MOD_ENG MOD_ON {module}");
    }
    for number in 1..6 {
        let of = |name: &str| if number == 1 { name.to_owned() } else { format!("{name}.{number}") };
        let module = of("SIGGEN_MOD");
        let _ = writeln!(
            rows,
            "all {module} FORM SINE\nall {module} AMPLITUDE 1\nall {module} PORT_SIGNAL_OUT {}\nall MOD_ENG MOD_ON {module}",
            of("SIGNAL_OUT")
        );
    }
    rows + "all PIDCTRL_MOD K_PARAM 10\nall MOD_ENG MOD_ON PIDCTRL_MOD\nall MOD_ENG MATCHING_CHECK\n"
}

#[test]
fn every_tick_of_64_types_reaches_eight_pages() {
    let folder = tempfile::tempdir().unwrap();
    let scheme = folder.path().join("wide.scheme");
    std::fs::write(&scheme, wide_scheme()).unwrap();
    let rig = format!(
        "duration_s = 1.0\n[[device]]\nname = \"joint\"\nmeasures = [\"POSITION\", \"DES_POSITION\"]\n\
         [[device.axis]]\nplant.load.inertia = 0.02\n[[controller]]\ndevice = \"joint\"\nscheme = {scheme:?}\n\
         [[experiment.move]]\ndevice = \"joint\"\non = \"DES_POSITION\"\nstep = {{ at_s = 0.1, amplitude = 0.1 }}\n"
    );
    let served = Served::start("wide", &rig);
    let listen = |mut browser: Browser| {
        let layout =
            browser.news("layout", |layout| layout["signals"].as_array().is_some_and(|all| all.len() == 64));
        let (mut ticks, mut missed) = (Vec::new(), 0);
        browser.wait(|message| {
            if let Message::Binary(bytes) = message {
                let width = usize::from(u16::from_le_bytes([bytes[2], bytes[3]]));
                assert_eq!(width, 64);
                for row in bytes[8..].chunks(4 + 4 * width) {
                    ticks.push(u32::from_le_bytes(row[..4].try_into().unwrap()));
                    assert!(
                        row[4..]
                            .chunks(4)
                            .all(|value| f32::from_le_bytes(value.try_into().unwrap()).is_finite())
                    );
                }
            } else if let Ok(text) = message.to_text() {
                missed += usize::from(text.contains("\"missed\""));
            }
            (ticks.len() >= 1000).then_some(())
        });
        assert_eq!(missed, 0);
        assert!(ticks.windows(2).all(|pair| pair[1] == pair[0] + 1), "a tick is missing");
        layout
    };
    let browsers: Vec<_> = (0..8).map(|_| served.browser()).collect();
    let listening: Vec<_> =
        browsers.into_iter().map(|browser| thread::spawn(move || listen(browser))).collect();
    for one in listening {
        one.join().unwrap();
    }
}
