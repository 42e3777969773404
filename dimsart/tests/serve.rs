//! A port that many clients share, and simulated controllers.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use dimsart::broker::{self, SharedPort};
use dimsart::connect::{Capture, ConnectError, Device, DisplayValue, SignalPoll, Subscription, Timeouts};
use hil_sim::clock;
use hil_sim::link::{PortError, Stream};
use hil_sim::response::LiveRig;
use hil_sim::rig_file::RigFile;
use hil_sim::schemes::SchemeText;
use test_requirements::TEST_TIMEOUT;

const PATIENCE: Timeouts = Timeouts { timeout: Duration::from_secs(20), tries: 3 };
/// Time scale for a busy machine: a lease lasts one second of the computer's time.
const SPEED: f64 = 0.2;

/// The shipped joint in real time, behind a port of this name.
struct Served {
    port: String,
    _shared: SharedPort,
    stop: Arc<AtomicBool>,
    running: Option<JoinHandle<Vec<String>>>,
}

impl Served {
    fn start(name: &str, sets: &[&str]) -> Self {
        clock::set_speed(SPEED);
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        let text = RigFile::shipped("joint").unwrap();
        let file = RigFile::read(text, "joint", PathBuf::new(), &sets).unwrap();
        let (live, mut lines) = LiveRig::new(&file).unwrap();
        // Distinct for concurrent test runs.
        let port = format!("sim:{name}-{}", std::process::id());
        let (_, line) = lines.remove(0);
        let shared = SharedPort::new(&port, Box::new(line)).unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stop);
        let running = thread::spawn(move || {
            let mut news = Vec::new();
            live.run(&flag, |text| news.push(text));
            news
        });
        Self { port, _shared: shared, stop, running: Some(running) }
    }

    fn connect(&self) -> Device<Box<dyn Stream>> {
        Device::identify(broker::open(&self.port, 0).unwrap(), PATIENCE, dimsart_modules::ALL).unwrap()
    }

    /// Messages to the user so far.
    fn end(mut self) -> Vec<String> {
        self.stop.store(true, Ordering::Relaxed);
        self.running.take().unwrap().join().unwrap()
    }
}

/// Waits for a heartbeat of a device.
fn wait_for(device: &mut Device<Box<dyn Stream>>, text: &str) {
    let deadline = Instant::now() + TEST_TIMEOUT;
    while !device.state().unwrap().contains(text) {
        assert!(Instant::now() < deadline, "{}", device.state().unwrap());
    }
}

#[test]
fn many_clients_ask_at_once_and_everyone_gets_his_own_answers() {
    let served = Served::start("many", &[]);
    thread::scope(|scope| {
        for client in 0..8 {
            let mut device = served.connect();
            scope.spawn(move || {
                for _ in 0..20 {
                    let (module, parameter) = ("PIDCTRL_MOD", ["K_PARAM", "D_PARAM"][client % 2]);
                    let report = device.get(module, parameter).unwrap();
                    assert_eq!(report.values.first().unwrap().to_string(), ["150", "6"][client % 2]);
                }
            });
        }
    });
}

#[test]
fn one_client_moves_a_device_and_anybody_stops_it() {
    let served = Served::start("stopped", &[]);
    let (mut operator, mut other) = (served.connect(), served.connect());
    operator.hold_lease().unwrap();
    wait_for(&mut operator, "commands the device");
    assert!(matches!(other.set("PIDCTRL_MOD", "K_PARAM", "80"), Err(ConnectError::Refused(_))));
    assert!(matches!(other.take_lease(), Err(ConnectError::Refused(_))));
    operator.set("PIDCTRL_MOD", "K_PARAM", "80").unwrap();
    assert!(!other.stop().unwrap().is_commanded);
    // STOP has released the lease: starting again moves nothing.
    assert!(other.check().unwrap().state.contains("no client holds the lease"));
    assert!(
        matches!(operator.renew_lease(), Err(ConnectError::Refused(_))),
        "a renewal does not restore the lease"
    );
    operator.hold_lease().unwrap();
    wait_for(&mut operator, "commands the device");
}

#[test]
fn a_client_that_is_gone_moves_nothing_any_more() {
    let served = Served::start("gone", &[]);
    let (mut operator, mut other) = (served.connect(), served.connect());
    operator.hold_lease().unwrap();
    wait_for(&mut operator, "commands the device");
    drop(operator);
    wait_for(&mut other, "no client holds the lease");
}

#[test]
fn what_an_experiment_moves_is_moved_again_and_again() {
    let served = Served::start("again", &["duration_s=0.2", "experiment.move.0.step.at_s=0.1"]);
    let mut device = served.connect();
    device.hold_lease().unwrap();
    let (mut live, mut changes, mut last) =
        (SignalPoll::new(&["DES_POSITION".to_owned()], Duration::from_millis(10)), 0, String::new());
    let deadline = Instant::now() + TEST_TIMEOUT;
    while changes < 6 && Instant::now() < deadline {
        let seen = device.read_signals(&mut live).unwrap().remove(0).values.remove(0).to_string();
        changes += usize::from(seen != last);
        last = seen;
        device.listen(Duration::from_millis(5)).unwrap();
    }
    assert_eq!(changes, 6);
}

#[test]
fn a_rig_that_has_left_its_range_is_put_back_and_motion_ends() {
    let served = Served::start("range", &["device.joint.position_limit=0.2"]);
    let mut device = served.connect();
    let deadline = Instant::now() + TEST_TIMEOUT;
    device.hold_lease().unwrap();
    // The withdrawal of the lease is detected.
    while device.state().is_ok() && device.renew_if_due().is_ok() {
        assert!(Instant::now() < deadline, "the joint never left its range");
    }
    wait_for(&mut device, "no client holds the lease");
    drop(device);
    let news = served.end();
    assert!(news.iter().any(|text| text.contains("joint was out of range at")), "{news:?}");
}

#[test]
fn a_port_that_nobody_serves_and_one_that_somebody_does_are_told_apart() {
    let served = Served::start("twice", &[]);
    let [_, spare] = hil_sim::pipe::pair([Duration::from_millis(1); 2]);
    let refused = SharedPort::new(&served.port, Box::new(spare));
    assert!(matches!(refused, Err(PortError::Served { .. })), "{refused:?}");
    let nobody = broker::open("sim:nobody-at-all", 0);
    assert!(matches!(nobody, Err(PortError::ServerNotFound { .. })), "{nobody:?}");
}

/// The first client opened the port: when it ends, another client takes its place.
#[test]
fn clients_go_on_when_the_one_that_had_the_port_ends() {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp:{}", listener.local_addr().unwrap());
    let text = RigFile::shipped("joint").unwrap();
    let file = RigFile::read(text, "joint", PathBuf::new(), &[]).unwrap();
    let (live, mut lines) = LiveRig::new(&file).unwrap();
    let broker = broker::Broker::new(Box::new(lines.remove(0).1));
    let running = thread::spawn(move || live.run(&AtomicBool::new(false), |_| ()));
    // A board behind a socket that accepts one program at a time, like an emulator.
    thread::spawn(move || {
        for stream in listener.incoming().map_while(Result::ok) {
            let mut line = broker.join().unwrap();
            let (mut from, mut to) = (stream.try_clone().unwrap(), stream);
            let mut writer = line.writer.clone();
            let reading = thread::spawn(move || std::io::copy(&mut from, &mut writer));
            let mut buffer = [0; 1024];
            while !reading.is_finished() {
                if let Ok(count @ 1..) = std::io::Read::read(&mut line, &mut buffer) {
                    let _ = std::io::Write::write_all(&mut to, buffer.get(..count).unwrap_or_default());
                }
            }
        }
    });
    // Requests to the ending client are lost, and soon repeated.
    let patience = Timeouts { timeout: Duration::from_millis(500), tries: 100 };
    let greet = || Device::identify(broker::open(&port, 0).unwrap(), patience, dimsart_modules::ALL).unwrap();
    let (first, mut second, mut third) = (greet(), greet(), greet());
    drop(first);
    for device in [&mut second, &mut third] {
        assert_eq!(device.overview().unwrap().identity.device, "joint");
    }
    drop(second);
    assert_eq!(third.overview().unwrap().identity.device, "joint");
    assert!(!running.is_finished());
}

/// Two clients at a time, each with its own stream: a controller on a host has several.
#[test]
fn every_tick_reaches_all_who_listen() {
    let served = Served::start("tap", &[]);
    let listen = |mut device: Device<Box<dyn Stream>>| {
        let (mut tap, mut rows) = (Subscription::new(1), Vec::new());
        let deadline = Instant::now() + TEST_TIMEOUT;
        while rows.len() < 1000 && Instant::now() < deadline {
            rows.extend(device.receive_rows(&mut tap, Duration::from_millis(20)).unwrap());
        }
        assert!(tap.signals().iter().any(|signal| signal.name == "POSITION" && signal.unit == "rad"));
        assert_eq!(tap.lost_samples(), 0);
        rows
    };
    let clients = [served.connect(), served.connect()].map(|device| thread::spawn(move || listen(device)));
    for rows in clients.map(|client| client.join().unwrap()) {
        assert!(rows.len() >= 1000);
        assert!(rows.windows(2).all(|pair| pair[1].tick == pair[0].tick + 1), "a tick is missing");
        assert!(rows.iter().flat_map(|row| &row.values).all(|value| value.is_finite()));
    }
}

/// More signals than one stream carries, not in every tick: all signals of a row are from the same tick.
#[test]
fn rows_of_every_tenth_tick_are_whole() {
    let served = Served::start("tenth", &[]);
    let mut device = served.connect();
    let rows: String = (2..8)
        .map(|number| {
            let module = format!("SIGGEN_MOD.{number}");
            format!("all {module} PORT_SIGNAL_OUT SIGNAL_OUT.{number}\nall MOD_ENG MOD_ON {module}\n")
        })
        .collect();
    let scheme = SchemeText { name: "more".to_owned(), text: rows + "all MOD_ENG MATCHING_CHECK" };
    device.send_scheme(&scheme, "joint").unwrap();
    let (mut tap, mut rows) = (Subscription::new(10), Vec::new());
    let deadline = Instant::now() + TEST_TIMEOUT;
    while rows.len() < 50 {
        assert!(Instant::now() < deadline, "{} rows", rows.len());
        rows.extend(device.receive_rows(&mut tap, Duration::from_millis(20)).unwrap());
    }
    assert!(tap.signals().len() > 4, "{:?}", tap.signals());
    assert!(rows.iter().all(|row| row.tick.is_multiple_of(10)));
    assert!(rows.windows(2).all(|pair| pair[1].tick == pair[0].tick + 10));
    assert!(rows.iter().flat_map(|row| &row.values).all(|value| value.is_finite()));
    // Streams that it no longer needs are free for another client immediately.
    device.close_telemetry(&mut tap).unwrap();
}

/// A signal steps in one tick, at a time unknown to the client.
#[test]
fn an_edge_is_caught_on_the_device() {
    let served = Served::start("edge", &[]);
    let (mut device, mut other) = (served.connect(), served.connect());
    let rows = "all SIGGEN_MOD FORM SQUARE\nall SIGGEN_MOD AMPLITUDE 0.5\nall SIGGEN_MOD FREQUENCY 5\n\
        all MOD_ENG MOD_ON SIGGEN_MOD\nall MOD_ENG MATCHING_CHECK";
    device.send_scheme(&SchemeText { name: "edges".to_owned(), text: rows.to_owned() }, "joint").unwrap();
    let before = device.scheme_rows(None).unwrap();
    let rising = Capture {
        signal: "SIGNAL_OUT".to_owned(),
        word: 0,
        level: 0.25,
        is_falling: false,
        rows_before: 20,
        rows_after: 5,
        every_ticks: 1,
    };
    // Two clients at a time, each with its own recorder.
    let falling = Capture { is_falling: true, rows_before: 3, ..rising.clone() };
    let deadline = Instant::now() + TEST_TIMEOUT;
    let is_over = || Instant::now() > deadline;
    let (risen, fallen) = thread::scope(|scope| {
        let fallen = scope.spawn(|| {
            loop {
                match other.capture(&falling, is_over) {
                    // The other client's transaction is open.
                    Err(ConnectError::Command(_)) if !is_over() => {}
                    captured => return captured.unwrap(),
                }
            }
        });
        let risen = loop {
            match device.capture(&rising, is_over) {
                Err(ConnectError::Command(_)) if !is_over() => {}
                captured => break captured.unwrap(),
            }
        };
        (risen, fallen.join().unwrap())
    });
    for (captured, rows_before, is_beyond) in
        [(risen, 20, (|value| value > 0.25) as fn(f32) -> bool), (fallen, 3, |value| value < 0.25)]
    {
        let recorded = captured.recorded.unwrap();
        let caught = recorded.caught.unwrap();
        // Fewer rows if the edge came immediately.
        let before = rows_before.min(caught);
        assert_eq!((recorded.rows.len(), recorded.overwritten), (before as usize + 6, 0), "{recorded:?}");
        for row in &recorded.rows {
            let DisplayValue::Real(value) = row.values[0] else { panic!("{row:?}") };
            assert_eq!(is_beyond(value), row.number >= caught, "{caught}: {recorded:?}");
        }
        assert_eq!(recorded.rows.last().unwrap().number, caught + 5);
        if let Some(stays) = captured.stays {
            let name = stays.split_whitespace().next().unwrap();
            device.unplug(name).unwrap();
            device.delete_module(Some(name)).unwrap();
        }
    }
    assert_eq!(device.scheme_rows(None).unwrap(), before, "the scheme is unchanged");
    let wrong = Capture { word: 1, ..rising.clone() };
    assert!(device.capture(&wrong, || true).unwrap_err().to_string().contains("has no word 1"));
    let never = Capture { level: 1e6, ..rising };
    assert_eq!(device.capture(&never, || true).unwrap().recorded, None);
    assert_eq!(device.scheme_rows(None).unwrap(), before);
}

#[test]
fn a_record_has_every_tick_and_the_scheme() {
    let served = Served::start("record", &[]);
    let folder = tempfile::tempdir().unwrap();
    let record_of = |kind: &str, signals: &[&str]| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_dimsart"));
        command
            .args(["record", &served.port])
            .args(signals)
            .args(["--duration-s", "5", "--signals", kind, "--out"])
            .arg(folder.path());
        let output = command.output().unwrap();
        let errors = String::from_utf8(output.stderr).unwrap();
        if output.status.success() { Ok(String::from_utf8(output.stdout).unwrap()) } else { Err(errors) }
    };
    let record = |kind: &str| record_of(kind, &[]).unwrap();
    // The named signals, in the order of the names.
    assert!(record_of("csv", &["DES_FORCE", "POSITION"]).unwrap().contains("2 signals, 0 samples lost"));
    let text = std::fs::read_to_string(folder.path().join("signals.csv")).unwrap();
    assert!(text.starts_with("time_s (s),joint.DES_FORCE[0] (N·m),joint.POSITION[0] (rad)\n"), "{text:.80}");
    assert!(
        record_of("csv", &["VELOCITY"]).unwrap_err().contains("VELOCITY is not in the Data Base of joint")
    );
    assert!(record_of("csv", &["POSITON"]).unwrap_err().contains("did you mean 'POSITION'?"));
    assert!(record("csv").contains("3 signals, 0 samples lost"));
    let text = std::fs::read_to_string(folder.path().join("signals.csv")).unwrap();
    let mut lines = text.lines();
    assert_eq!(
        lines.next(),
        Some("time_s (s),joint.POSITION[0] (rad),joint.DES_POSITION[0] (rad),joint.DES_FORCE[0] (N·m)")
    );
    let times: Vec<&str> = lines.map(|line| line.split(',').next().unwrap()).collect();
    // No more digits than the milliseconds.
    assert!(
        times.iter().all(|time| time.split_once('.').is_none_or(|(_, digits)| digits.len() <= 3)),
        "{times:?}"
    );
    let ticks: Vec<f64> = times.iter().map(|time| (1e3 * time.parse::<f64>().unwrap()).round()).collect();
    assert!(ticks.len() > 500, "{}", ticks.len());
    assert!(ticks.windows(2).all(|pair| (pair[1] - pair[0] - 1.0).abs() < 1e-9), "a tick is missing");
    record("mcap");
    assert!(!folder.path().join("signals.csv").exists(), "the older recording is removed");
    let bytes = std::fs::read(folder.path().join("signals.mcap")).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    assert!(summary.stats.unwrap().message_count > 500);
    assert_eq!(summary.attachment_indexes.len(), 2, "device and scheme");
    // As `run` and `serve` record it.
    let channel = summary.channels.values().find(|channel| channel.topic == "/joint").unwrap();
    let schema = String::from_utf8_lossy(&channel.schema.as_ref().unwrap().data).into_owned();
    assert!(schema.contains("\nfloat32[1] position # POSITION (rad)\n"), "{schema}");
}

#[test]
fn a_record_that_is_killed_leaves_its_rows() {
    let served = Served::start("killed", &[]);
    let folder = tempfile::tempdir().unwrap();
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_dimsart"));
    let mut record = command.args(["record", &served.port, "--out"]).arg(folder.path()).spawn().unwrap();
    let (path, deadline) = (folder.path().join("signals.mcap"), Instant::now() + TEST_TIMEOUT);
    let messages = || {
        let bytes = std::fs::read(&path).unwrap_or_default();
        mcap::MessageStream::new(&bytes).map_or(0, |messages| messages.map_while(Result::ok).count())
    };
    // Read while it is written, too.
    while messages() < 200 {
        assert!(Instant::now() < deadline, "{} messages", messages());
        thread::sleep(Duration::from_millis(20));
    }
    record.kill().unwrap();
    record.wait().unwrap();
    let bytes = std::fs::read(&path).unwrap();
    assert!(mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).count() >= 200);
}

#[test]
fn a_controller_is_looked_over_and_nothing_of_it_changes() {
    let served = Served::start("doctor", &[]);
    let before = served.connect().scheme_rows(None).unwrap();
    let mut doctor = std::process::Command::new(env!("CARGO_BIN_EXE_dimsart"));
    let output = doctor.args(["doctor", "--json", "--board", &served.port]).output().unwrap();
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let checks = json["checks"].as_array().unwrap();
    let verdict = |name: &str| {
        let check = checks.iter().find(|check| check["name"].as_str().unwrap().starts_with(name));
        check.map_or("missing", |check| check["verdict"].as_str().unwrap())
    };
    let found = ["answers", "protocol", "board", "tick rate", "faults"].map(verdict);
    assert_eq!(found, ["passed", "passed", "passed", "not_run", "passed"], "{json}");
    assert_eq!(output.status.code(), Some(i32::from(json["is_well"] != true)), "{json}");
    let mut device = served.connect();
    assert_eq!(device.scheme_rows(None).unwrap(), before);
    assert_eq!(device.live().unwrap().holder, None);
    served.end();
}
