//! A fleet over Zenoh: `dimsart bridge` and a router as separate processes, and a commander here.
//!
//! `cargo xtask step bridge` runs it; the build takes minutes.
#![cfg(unix)]
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

use std::io::{BufRead as _, BufReader, Read as _};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use dimsart::broker::{self, SharedPort};
use dimsart::connect::{Device, Timeouts};
use hil_sim::link::Stream;
use hil_sim::response::LiveRig;
use hil_sim::rig_file::RigFile;
use serde_json::{Value, json};
use test_requirements::TEST_TIMEOUT;
use zenoh::handlers::FifoChannelHandler;
use zenoh::pubsub::Subscriber;
use zenoh::sample::Sample;
use zenoh::{Config, Session, Wait as _};

const PATIENCE: Timeouts = Timeouts { timeout: Duration::from_secs(20), tries: 3 };
/// Environment variable with the address of a router process, which the test below then becomes.
const ROUTER: &str = "DIMSART_TEST_ROUTER";

const RIG: &str = r#"
duration_s = 1.0

[[device]]
name = "axis"
measures = ["POSITION"]
takes = ["DES_FORCE"]

[[device.axis]]
unit = "rad"
sensor.POSITION = { counts_per_unit = 1e5 }
plant.load = { inertia = 0.05, damping = 0.02 }

[[controller]]
device = "axis"
scheme = "reference.scheme"

[[experiment.move]]
device = "axis"
on = "load"
step = { at_s = 0.5, amplitude = 0.01 }
"#;

/// The reference is a generator's offset.
const SCHEME: &str = "\
all  SIGGEN_MOD   PORT_SIGNAL_OUT  DES_POSITION
all  PIDCTRL_MOD  K_PARAM          20
all  PIDCTRL_MOD  D_PARAM          2
all  MOD_ENG      MOD_ON           SIGGEN_MOD
all  MOD_ENG      MOD_ON           PIDCTRL_MOD
all  MOD_ENG      MATCHING_CHECK
";

/// A simulated axis in real time behind a port.
struct Served {
    port: String,
    stop: Arc<AtomicBool>,
    running: Option<JoinHandle<()>>,
    shared: Option<SharedPort>,
}

impl Served {
    fn start(name: &str, folder: &Path) -> Self {
        std::fs::write(folder.join("reference.scheme"), SCHEME).unwrap();
        let file = RigFile::read(RIG, "axis", folder.to_owned(), &[]).unwrap();
        let (live, mut lines) = LiveRig::new(&file).unwrap();
        let port = format!("sim:bridge-{name}-{}", std::process::id());
        let shared = SharedPort::new(&port, Box::new(lines.remove(0).1)).unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stop);
        let running = Some(thread::spawn(move || live.run(&flag, |_| ())));
        Self { port, stop, running, shared: Some(shared) }
    }

    fn device(&self) -> Device<Box<dyn Stream>> {
        Device::identify(broker::open(&self.port, 0).unwrap(), PATIENCE, dimsart_modules::ALL).unwrap()
    }

    fn end(&mut self) {
        drop(self.shared.take());
        self.stop.store(true, Ordering::Relaxed);
        let _ = self.running.take().map(JoinHandle::join);
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.end();
    }
}

/// A process that ends with the test.
struct Process(Child);

impl Process {
    /// Starts a process, and waits for its first output.
    fn start(mut command: Command, text: &str) -> Self {
        let mut process = Self(command.stdout(Stdio::piped()).spawn().unwrap());
        let mut lines = BufReader::new(process.0.stdout.take().unwrap()).lines();
        assert!(
            lines.any(|line| line.unwrap().contains(text)),
            "the process ended without printing '{text}'"
        );
        thread::spawn(move || lines.for_each(drop));
        process
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A router at a free port of this computer, or at its previous port.
struct Router {
    endpoint: String,
    process: Option<Process>,
}

impl Router {
    fn start() -> Self {
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let mut router = Self { endpoint: format!("tcp/127.0.0.1:{port}"), process: None };
        router.run();
        router
    }

    fn run(&mut self) {
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args(["--exact", "a_router", "--nocapture"]).env(ROUTER, &self.endpoint);
        self.process = Some(Process::start(command, "listens"));
    }

    fn kill(&mut self) {
        self.process = None;
    }

    fn session(&self) -> Session {
        let mut config = Config::default();
        config.insert_json5("mode", "\"client\"").unwrap();
        config.insert_json5("connect/endpoints", &json!([self.endpoint]).to_string()).unwrap();
        config.insert_json5("scouting/multicast/enabled", "false").unwrap();
        zenoh::open(config).wait().unwrap()
    }

    fn bridge(&self, ports: &[String]) -> Process {
        Process::start(bridge(ports, &self.endpoint), "until Ctrl-C")
    }
}

/// Started by other tests as a process: runs a router until it is killed. Otherwise does nothing.
#[test]
fn a_router() {
    let Ok(endpoint) = std::env::var(ROUTER) else { return };
    let mut config = Config::default();
    config.insert_json5("mode", "\"router\"").unwrap();
    config.insert_json5("listen/endpoints", &json!([endpoint]).to_string()).unwrap();
    config.insert_json5("scouting/multicast/enabled", "false").unwrap();
    let _router = zenoh::open(config).wait().unwrap();
    println!("listens");
    loop {
        thread::park();
    }
}

fn bridge(ports: &[String], router: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dimsart"));
    command.arg("bridge").args(ports).args(["--prefix", "fleet", "--router", router]);
    command
}

/// Sends a request; returns its result or the reason of its refusal; `None` without an answer.
fn ask(session: &Session, key: &str, payload: &str) -> Option<Result<Value, String>> {
    let replies = session.get(key).payload(payload).timeout(Duration::from_secs(5)).wait().unwrap();
    let reply = replies.recv().ok()?;
    Some(match reply.result() {
        Ok(sample) => Ok(serde_json::from_slice(&sample.payload().to_bytes()).unwrap()),
        Err(error) => {
            let bytes = error.payload().to_bytes();
            let refused: Value = serde_json::from_slice(&bytes).map_err(|_| error.to_string()).ok()?;
            Err(refused["refused"].as_str().unwrap().to_owned())
        }
    })
}

fn command(session: &Session, device: &str, what: &Value) -> Result<Value, String> {
    let key = format!("fleet/{device}/command");
    ask(session, &key, &what.to_string()).unwrap().map(|answer| answer["done"].clone())
}

/// Waits for a condition.
fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    let deadline = Instant::now() + TEST_TIMEOUT;
    while !is_so() {
        assert!(Instant::now() < deadline, "never: {what}");
        thread::sleep(Duration::from_millis(10));
    }
}

/// A commander that reports its presence while this value exists.
struct Renewing(Arc<AtomicBool>, Option<JoinHandle<()>>);

impl Renewing {
    fn start(session: &Session, device: &str) -> Self {
        let over = Arc::new(AtomicBool::new(false));
        let (flag, session, device) = (Arc::clone(&over), session.clone(), device.to_owned());
        let thread = thread::spawn(move || {
            let key = format!("fleet/{device}/command");
            while !flag.load(Ordering::Relaxed) {
                ask(&session, &key, &json!({"client": "planner", "do": "renew"}).to_string());
                thread::sleep(Duration::from_millis(50));
            }
        });
        Self(over, Some(thread))
    }
}

impl Drop for Renewing {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
        let _ = self.1.take().map(JoinHandle::join);
    }
}

/// Rows of messages: layout, tick, values.
type Rows = Vec<(u32, u32, Vec<f64>)>;

fn rows_of(mut bytes: &[u8]) -> Rows {
    let mut rows = Rows::new();
    let word = |bytes: &mut &[u8]| {
        let (word, rest) = bytes.split_first_chunk().unwrap();
        *bytes = rest;
        u32::from_le_bytes(*word)
    };
    while !bytes.is_empty() {
        let [layout, count, width] = [(); 3].map(|()| word(&mut bytes));
        for _ in 0..count {
            let tick = word(&mut bytes);
            let (values, rest) = bytes.split_at(8 * width as usize);
            bytes = rest;
            let values = values.chunks(8).map(|value| f64::from_le_bytes(value.try_into().unwrap()));
            rows.push((layout, tick, values.collect()));
        }
    }
    rows
}

fn subscribe(session: &Session, key: &str) -> Subscriber<FifoChannelHandler<Sample>> {
    session.declare_subscriber(key).with(zenoh::handlers::FifoChannel::new(100_000)).wait().unwrap()
}

/// Reads rows until they satisfy the condition.
fn take_rows(
    signals: &Subscriber<FifoChannelHandler<Sample>>,
    rows: &mut Rows,
    is_so: impl Fn(&Rows) -> bool,
) {
    wait_until("the expected rows", || {
        while let Ok(Some(sample)) = signals.try_recv() {
            rows.extend(rows_of(&sample.payload().to_bytes()));
        }
        is_so(rows)
    });
}

fn gain(device: &mut Device<Box<dyn Stream>>) -> String {
    device.get("PIDCTRL_MOD", "K_PARAM").unwrap().values.first().unwrap().to_string()
}

fn has_no_gap(rows: &Rows) -> bool {
    rows.windows(2).all(|pair| pair[1].0 == pair[0].0 && pair[1].1 == pair[0].1 + 1)
}

#[test]
fn a_fleet_is_seen_and_moved_and_the_loss_of_the_router_ends_motion_and_loses_no_record() {
    let folder = tempfile::tempdir().unwrap();
    let (mut router, served) = (Router::start(), Served::start("one", folder.path()));
    let _bridge = router.bridge(std::slice::from_ref(&served.port));
    let (session, mut onlooker) = (router.session(), served.device());
    let signals = subscribe(&session, "fleet/axis/signals");
    let states = subscribe(&session, "0/fleet/axis/joint_states/**");

    // Signals of every tick, and their layout.
    let mut rows = Rows::new();
    take_rows(&signals, &mut rows, |rows| rows.len() > 300);
    assert!(has_no_gap(&rows), "a tick is missing");
    let layout = ask(&session, "fleet/axis/layout", "").unwrap().unwrap();
    assert_eq!(layout["number"], rows[0].0);
    let position = layout["signals"][0].clone();
    assert_eq!(position, json!({"name": "POSITION", "unit": "rad", "words": 1}));

    // The lease belongs to one client.
    let planner = |what: &Value| {
        let mut what = what.clone();
        what["client"] = "planner".into();
        command(&session, "axis", &what)
    };
    let set = |offset: &str| json!({"do": "edit", "edit": "set", "module": "SIGGEN_MOD", "parameter": "OFFSET", "value": offset});
    assert!(planner(&json!({"do": "renew"})).unwrap_err().contains("lease expired: `arm` again"));
    planner(&json!({"do": "arm"})).unwrap();
    let renewing = Renewing::start(&session, "axis");
    wait_until("motion", || onlooker.state().unwrap().contains("commands the device"));
    for what in [json!({"do": "arm"}), set("1"), json!({"do": "scheme", "rows": SCHEME})] {
        let mut what = what;
        what["client"] = "another".into();
        let refused = command(&session, "axis", &what).unwrap_err();
        assert!(refused.contains("another client holds the lease"), "{refused}");
    }

    // A reference, and its motion.
    planner(&set("0.4")).unwrap();
    take_rows(&signals, &mut rows, |rows| rows.last().is_some_and(|row| row.2[0] > 0.3));
    assert!(has_no_gap(&rows), "a tick is missing");
    joint_state_is_as_ros_has_it(&states, &session);

    // Transactions.
    let done =
        planner(&json!({"do": "scheme", "rows": "all PIDCTRL_MOD K_PARAM 25\nall PIDCTRL_MOD D_PARAM 2.5"}));
    assert_eq!(done.unwrap()["rows"], 2);
    assert_eq!(gain(&mut onlooker), "25");
    let refused = planner(
        &json!({"do": "scheme", "rows": "all PIDCTRL_MOD K_PARAM 30\nall SIGGEN_MOD PORT_SIGNAL_OUT SPEED"}),
    );
    assert!(refused.unwrap_err().contains("2:"), "the row is named");
    let refused = planner(
        &json!({"do": "scheme", "rows": "all PIDCTRL_MOD K_PARAM 30\nall MOD_ENG MOD_OFF SIGGEN_MOD"}),
    );
    let refused = refused.unwrap_err();
    assert!(refused.contains("DES_POSITION"), "{refused}");
    assert_eq!(gain(&mut onlooker), "25", "the transaction is atomic");

    // Invalid commands.
    for (payload, reason) in [
        ("arm", "expected JSON such as"),
        (r#"{"do": "arm"}"#, r#"missing key "client""#),
        (r#"{"client": "planner", "do": "jump"}"#, "invalid command"),
    ] {
        let refused = ask(&session, "fleet/axis/command", payload).unwrap().unwrap_err();
        assert!(refused.contains(reason), "{refused}");
    }
    let refused = ask(&session, "fleet/axis/signals?tick=1", "").unwrap().unwrap_err();
    assert!(refused.contains("signals?layout=1;tick=1000"), "{refused}");
    assert!(onlooker.state().unwrap().contains("commands the device"), "none of these requests ends motion");

    // The router ends during a recording.
    let record = folder.path().join("record");
    let mut recording = Command::new(env!("CARGO_BIN_EXE_dimsart"));
    recording.args(["record", &served.port, "--duration-s", "4", "--signals", "csv", "--out"]).arg(&record);
    let recording = recording.stdout(Stdio::piped()).spawn().unwrap();
    let mut recording = Process(recording);
    wait_until("a record", || record.join("signals.csv").exists());
    router.kill();
    let killed = Instant::now();
    wait_until("rest", || onlooker.state().unwrap().contains("no client holds the lease"));
    eprintln!("at rest {} ms after the router went", killed.elapsed().as_millis());
    drop(renewing);
    assert!(recording.0.wait().unwrap().success());
    let mut said = String::new();
    recording.0.stdout.take().unwrap().read_to_string(&mut said).unwrap();
    assert!(said.contains("0 samples lost"), "{said}");
    let text = std::fs::read_to_string(record.join("signals.csv")).unwrap();
    let times = text.lines().skip(1).map(|line| line.split(',').next().unwrap().parse::<f64>().unwrap());
    let ticks: Vec<f64> = times.map(|time_s| (1e3 * time_s).round()).collect();
    assert!(ticks.len() > 1000, "{}", ticks.len());
    assert!(ticks.windows(2).all(|pair| (pair[1] - pair[0] - 1.0).abs() < 1e-9), "a tick is missing");

    // The router restarts: rows continue, missed rows can be requested, and nothing moves by itself.
    let (layout, last, ..) = rows.last().cloned().unwrap();
    router.run();
    take_rows(&signals, &mut rows, |rows| rows.last().is_some_and(|row| row.1 > last + 500));
    let missed = rows.windows(2).find(|pair| pair[1].1 != pair[0].1 + 1).map(|pair| pair[0].1);
    let missed = missed.expect("missed rows");
    let asked = session.get(format!("fleet/axis/signals?layout={layout};tick={missed}")).wait().unwrap();
    let kept = asked.recv().unwrap();
    let kept = rows_of(&kept.result().unwrap().payload().to_bytes());
    assert!(has_no_gap(&kept));
    let before: Rows = rows.iter().take_while(|row| row.1 <= missed).cloned().collect();
    let all: Rows = before.into_iter().chain(kept.into_iter().filter(|row| row.1 > missed)).collect();
    assert!(has_no_gap(&all) && all.last().unwrap().1 > last + 500, "every tick is available afterwards");
    assert!(planner(&json!({"do": "renew"})).unwrap_err().contains("lease expired: `arm` again"));
    assert!(onlooker.state().unwrap().contains("no client holds the lease"));
    planner(&json!({"do": "arm"})).unwrap();
    assert!(command(&session, "axis", &json!({"do": "stop"})).unwrap().to_string().contains("stopped"));
}

/// The last joint state as CDR, with the additional data of `rmw_zenoh_cpp`, and its liveliness tokens.
fn joint_state_is_as_ros_has_it(states: &Subscriber<FifoChannelHandler<Sample>>, session: &Session) {
    let mut last = None;
    while let Ok(Some(sample)) = states.try_recv() {
        last = Some(sample);
    }
    let sample = last.unwrap();
    let key = sample.key_expr().as_str();
    assert!(
        key.starts_with("0/fleet/axis/joint_states/sensor_msgs::msg::dds_::JointState_/RIHS01_"),
        "{key}"
    );
    let attachment = sample.attachment().unwrap().to_bytes();
    assert_eq!((attachment.len(), attachment[16]), (8 + 8 + 1 + 16, 16));
    let bytes = sample.payload().to_bytes();
    // Header, stamp, empty frame; a name "axis"; a position at a multiple of 8 bytes; no velocity, no effort.
    assert_eq!(bytes[..4], [0, 1, 0, 0]);
    assert_eq!(bytes[12..17], [1, 0, 0, 0, 0]);
    assert_eq!(bytes[20..33], *b"\x01\0\0\0\x05\0\0\0axis\0");
    let position = f64::from_le_bytes(bytes[44..52].try_into().unwrap());
    assert!((0.0..1.0).contains(&position), "{position}: {bytes:?}");
    let tokens = session.liveliness().get("@ros2_lv/0/**").wait().unwrap();
    let tokens: Vec<String> =
        tokens.iter().map(|token| token.result().unwrap().key_expr().to_string()).collect();
    let is_there = |kind: &str, end: &str| {
        tokens.iter().any(|token| token.contains(&format!("/{kind}/%/%/fleet_bridge")) && token.contains(end))
    };
    assert!(is_there("NN", "fleet_bridge"), "{tokens:?}");
    assert!(is_there("MP", "/%fleet%axis%joint_states/sensor_msgs"), "{tokens:?}");
    assert!(is_there("MP", "/%diagnostics/diagnostic_msgs"), "{tokens:?}");
}

#[test]
fn one_of_a_fleet_comes_to_rest_when_its_commander_is_silent_and_another_one_may_go() {
    let folder = tempfile::tempdir().unwrap();
    let (router, left) = (Router::start(), Served::start("left", folder.path()));
    let mut right = Served::start("right", folder.path());
    let _bridge = router.bridge(&[format!("left={}", left.port), format!("right={}", right.port)]);
    let session = router.session();
    let diagnostics = subscribe(&session, "0/diagnostics/**");
    let state = |device: &str| ask(&session, &format!("fleet/{device}/state"), "").and_then(Result::ok);
    wait_until("both states", || ["left", "right"].into_iter().all(|device| state(device).is_some()));
    let lost = session.declare_subscriber("fleet/left/lost").wait().unwrap();
    command(&session, "left", &json!({"client": "planner", "do": "arm"})).unwrap();
    // Observed on its own line, as the motion may end before it is published.
    let mut onlooker = left.device();
    wait_until("rest", || onlooker.state().unwrap().contains("no client holds the lease"));
    let lost = lost.recv_timeout(TEST_TIMEOUT).unwrap().expect("the reason is published");
    let lost: Value = serde_json::from_slice(&lost.payload().to_bytes()).unwrap();
    assert!(lost["reason"].as_str().unwrap().contains("client silent for 0.5 s"), "{lost}");
    right.end();
    wait_until("that the device is gone", || {
        ask(&session, "fleet/right/gone", "").is_some_and(|gone| gone.is_ok_and(|gone| gone.is_string()))
    });
    let stale = b"right\0";
    wait_until("a stale one", || {
        diagnostics.try_recv().is_ok_and(|sample| {
            let bytes = sample.map(|sample| sample.payload().to_bytes().into_owned()).unwrap_or_default();
            bytes.get(24) == Some(&3) && bytes.windows(stale.len()).any(|found| found == stale)
        })
    });
    assert!(command(&session, "right", &json!({"client": "planner", "do": "arm"})).is_err());
    command(&session, "left", &json!({"client": "planner", "do": "arm"})).unwrap();
}

/// Nothing is closed: the silence of the commander alone ends motion.
#[test]
fn a_router_that_hangs_ends_motion_too() {
    let folder = tempfile::tempdir().unwrap();
    let (mut router, served) = (Router::start(), Served::start("hangs", folder.path()));
    let _bridge = router.bridge(std::slice::from_ref(&served.port));
    let (session, mut onlooker) = (router.session(), served.device());
    command(&session, "axis", &json!({"client": "planner", "do": "arm"})).unwrap();
    let renewing = Renewing::start(&session, "axis");
    wait_until("motion", || onlooker.state().unwrap().contains("commands the device"));
    // Longer than the timeout.
    let start = Instant::now();
    wait_until("a second of motion", || {
        assert!(onlooker.state().unwrap().contains("commands the device"), "it is renewed");
        start.elapsed() > Duration::from_secs(1)
    });
    let process = &router.process.as_ref().unwrap().0;
    let process = rustix::process::Pid::from_raw(i32::try_from(process.id()).unwrap()).unwrap();
    rustix::process::kill_process(process, rustix::process::Signal::STOP).unwrap();
    wait_until("rest", || onlooker.state().unwrap().contains("no client holds the lease"));
    router.kill();
    drop(renewing);
}

#[test]
fn what_is_wrong_is_said_with_what_to_do_next() {
    let folder = tempfile::tempdir().unwrap();
    let served = Served::start("wrong", folder.path());
    let router = Router::start();
    let nowhere = "tcp/127.0.0.1:1";
    let ports =
        |ports: &[&str]| ports.iter().map(|port| port.replace("PORT", &served.port)).collect::<Vec<_>>();
    for (ports, router, reason) in [
        (ports(&["PORT"]), nowhere, "no Zenoh router at tcp/127.0.0.1:1"),
        (ports(&["PORT"]), "127.0.0.1", "no Zenoh router at 127.0.0.1"),
        (ports(&["sim:nobody-at-all"]), nowhere, "sim:nobody-at-all"),
        (ports(&["PORT", "PORT"]), &router.endpoint, "duplicate station name axis"),
        (ports(&["a/b=PORT"]), &router.endpoint, "invalid station name or key prefix 'a/b'"),
    ] {
        let output = bridge(&ports, router).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains(reason), "{said}");
    }
    let output = bridge(&[], nowhere).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
}
