//! Replays of recordings: the same bits, or the tick, module and signal of the first difference.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use dimsart::connect::{Device, Timeouts};
use dimsart::replay::{Divergence, Replay, ReplayError, replay};
use dimsart::report::{RunMetadata, SignalsFile, SignalsFormat};
use hil_sim::pipe::Pipe;
use hil_sim::response::LiveRig;
use hil_sim::rig_file::RigFile;
use hil_sim::schemes::SchemeText;
use mcap::records::Record;
use tempfile::TempDir;
use test_requirements::TEST_TIMEOUT;

const PATIENCE: Timeouts = Timeouts { timeout: Duration::from_secs(20), tries: 3 };
const FILE: &str = "signals.mcap";

/// Returns exit status and standard output or error.
fn dimsart(folder: &Path, arguments: &[&str]) -> (i32, String) {
    let output =
        Command::new(env!("CARGO_BIN_EXE_dimsart")).current_dir(folder).args(arguments).output().unwrap();
    let text = if output.stdout.is_empty() { output.stderr } else { output.stdout };
    (output.status.code().unwrap(), String::from_utf8(text).unwrap())
}

/// A folder with the recording of a run.
fn recorded(arguments: &[&str]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let arguments = [&["run", "--signals", "mcap", "--out", "."], arguments].concat();
    let (status, printed) = dimsart(folder.path(), &arguments);
    assert_eq!(status, 0, "{printed}");
    folder
}

fn replayed(folder: &TempDir) -> Replay {
    replay(&folder.path().join(FILE), dimsart_modules::ALL, |_| ()).unwrap()
}

#[test]
fn every_kind_of_run_is_the_same_again() {
    let [short, lossy] = ["duration_s=0.3", "link.loss=0.2"];
    let no_margins = "experiment.margins=false";
    let [jitter, on_can] = ["link.jitter_ticks=3", "link.carrier='can_fd'"];
    let cases: [(&[&str], usize); 6] = [
        (&["joint", "--set", short, "--set", "experiment.move.0.step.at_s=0.1"], 1),
        (&["three", "--set", short, "--set", no_margins], 3),
        (&["arm_bus", "--set", short, "--set", no_margins], 7),
        (&["--set", "duration_s=1", "--set", lossy, "--set", jitter], 2),
        (&["--set", "duration_s=1", "--set", on_can], 2),
        (&["--set", "duration_s=1", "--set", "wave.form=printed", "--set", "record.every_ticks=7"], 2),
    ];

    for (arguments, controllers) in cases {
        let replay = replayed(&recorded(arguments));
        assert_eq!(replay.controllers.len(), controllers, "{arguments:?}");
        assert!(!replay.diverges() && !replay.is_cut, "{arguments:?}: {replay:?}");
        assert!(replay.controllers.iter().all(|of| of.ticks >= 300 && of.words > 300), "{replay:?}");
    }
}

/// A recorded joint in real time, and its line.
struct Live {
    folder: TempDir,
    stop: Arc<AtomicBool>,
    running: thread::JoinHandle<()>,
    recording: SignalsFile,
}

impl Live {
    fn start() -> (Self, Device<Pipe>) {
        // A lease lasts a second of the computer's time.
        hil_sim::clock::set_speed(0.2);
        let text = RigFile::shipped("joint").unwrap();
        let file = RigFile::read(text, "joint", PathBuf::new(), &[]).unwrap();
        let (mut live, mut lines) = LiveRig::new(&file).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let facts = RunMetadata::new(file.to_toml(), live.rig_mut()).in_real_time();
        let (recording, listener) =
            SignalsFile::create(folder.path(), &[], SignalsFormat::Mcap(facts)).unwrap();
        live.add_listener(listener).unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stop);
        let running = thread::spawn(move || live.run(&flag, |_| ()));
        let (_, line) = lines.remove(0);
        (
            Self { folder, stop, running, recording },
            Device::identify(line, PATIENCE, dimsart_modules::ALL).unwrap(),
        )
    }

    fn end(self) -> TempDir {
        self.stop.store(true, Ordering::Relaxed);
        self.running.join().unwrap();
        self.recording.finish().unwrap();
        self.folder
    }
}

/// Holds the lease until the joint has moved.
fn move_it(device: &mut Device<Pipe>) {
    let position = |device: &mut Device<Pipe>| {
        device.signals(&["POSITION".to_owned()]).unwrap().remove(0).values.remove(0).to_string()
    };
    device.hold_lease().unwrap();
    let (before, deadline) = (position(device), Instant::now() + TEST_TIMEOUT);
    while position(device) == before {
        assert!(Instant::now() < deadline, "the joint stays at {before}");
    }
}

#[test]
fn what_is_changed_while_it_moves_is_changed_again() {
    let (live, mut device) = Live::start();
    move_it(&mut device);
    device.set("PIDCTRL_MOD", "K_PARAM", "140").unwrap();
    let more = "\
        all SIGGEN_MOD FORM SINE\nall SIGGEN_MOD AMPLITUDE 0.5\nall SIGGEN_MOD PORT_SIGNAL_OUT SIGNAL.2\n\
        all MOD_ENG MOD_ON SIGGEN_MOD\nall MOD_ENG MATCHING_CHECK\n";
    let scheme = SchemeText { name: "more".to_owned(), text: more.to_owned() };
    device.send_scheme(&scheme, "joint").unwrap();
    move_it(&mut device);
    device.begin().unwrap();
    device.set("PIDCTRL_MOD", "I_PARAM", "0").unwrap();
    device.abort().unwrap();
    device.stop().unwrap();
    device.reset(None).unwrap();
    device.unplug("SIGGEN_MOD").unwrap();
    assert!(device.set("PIDCTRL_MOD", "K_PARAM", "-1").is_err());
    device
        .send_scheme(
            &SchemeText { name: "".to_owned(), text: "all MOD_ENG MATCHING_CHECK".to_owned() },
            "joint",
        )
        .unwrap();
    move_it(&mut device);
    let folder = live.end();
    let replay = replayed(&folder);
    let [joint] = replay.controllers.as_slice() else { panic!("{replay:?}") };
    assert!(joint.divergence.is_none(), "{}", joint.divergence.as_ref().unwrap());
    assert!(joint.commands >= 12 && joint.words > 3 * joint.ticks, "{joint:?}");
    let topics = fs::read(folder.path().join(FILE)).unwrap();
    let topics: Vec<String> =
        mcap::Summary::read(&topics).unwrap().unwrap().channels.values().map(|of| of.topic.clone()).collect();
    assert!(topics.contains(&"/joint/2".to_owned()), "{topics:?}");
}

/// Copies the file with other attachments and messages.
fn doctored(
    folder: &TempDir,
    attachment: impl Fn(&str, String) -> String,
    mut message: impl FnMut(&str, &mut Vec<u8>),
) {
    let path = folder.path().join(FILE);
    let bytes = fs::read(&path).unwrap();
    let mut out = mcap::Writer::new(File::create(&path).unwrap()).unwrap();
    for record in mcap::read::LinearReader::new(&bytes).unwrap().map(Result::unwrap) {
        if let Record::Attachment { header, data, .. } = record {
            let text = attachment(&header.name, String::from_utf8(data.into_owned()).unwrap());
            out.attach(&mcap::Attachment {
                log_time: 0,
                create_time: 0,
                name: header.name,
                media_type: header.media_type,
                data: text.into_bytes().into(),
            })
            .unwrap();
        }
    }
    for found in mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap) {
        let mut data = found.data.to_vec();
        message(&found.channel.topic, &mut data);
        out.write(&mcap::Message { data: data.into(), ..found }).unwrap();
    }
    out.finish().unwrap();
}

fn joint() -> TempDir {
    recorded(&["joint", "--set", "duration_s=0.3", "--set", "experiment.move.0.step.at_s=0.1"])
}

fn first_divergence(folder: &TempDir) -> Divergence {
    replayed(folder).controllers.remove(0).divergence.unwrap()
}

#[test]
fn another_parameter_is_found_in_the_first_tick_that_it_changes() {
    let folder = joint();
    let other_limit = |name: &str, text: String| match name {
        "joint.scheme" => {
            let row = |row: &str| {
                if row.contains("LIMIT") { row.replace("20", "20.000002") } else { row.to_owned() }
            };
            text.lines().map(|line| row(line) + "\n").collect()
        }
        _ => text,
    };
    doctored(&folder, other_limit, |_, _| ());
    let found = first_divergence(&folder);
    // At rest no limit acts.
    assert_eq!((found.tick, found.time_s, found.recorded), (100, 0.1, 20.0), "{found}");
    assert_eq!(found.replayed.to_bits(), f64::from(20.000_002_f32).to_bits());
    assert_eq!((found.module.as_deref(), found.signal.as_str()), (Some("PIDCTRL_MOD"), "DES_FORCE"));
    let (status, printed) = dimsart(folder.path(), &["replay", FILE]);
    assert_eq!(status, 3, "{printed}");
    assert!(printed.contains("tick 100 (0.1 s): DES_FORCE[0] of PIDCTRL_MOD was recorded as"), "{printed}");
    let (status, printed) = dimsart(folder.path(), &["replay", FILE, "--json"]);
    let json: serde_json::Value = serde_json::from_str(&printed).unwrap();
    assert_eq!((status, json["controllers"][0]["divergence"]["tick"].as_u64()), (3, Some(100)));
}

#[test]
fn one_bit_of_one_word_is_found() {
    let folder = joint();
    let mut position_bits = 0;
    doctored(
        &folder,
        |_, text| text,
        |topic, data| {
            if (topic, u64::from_le_bytes(data[4..12].try_into().unwrap())) == ("/joint", 150) {
                data[20] ^= 1;
                position_bits = u32::from_le_bytes(data[20..24].try_into().unwrap());
            }
        },
    );
    let replay = replayed(&folder);
    let joint = &replay.controllers[0];
    let found = joint.divergence.clone().unwrap();
    assert_eq!((joint.differing_rows, found.tick, found.word, found.module.as_deref()), (1, 150, 0, None));
    assert_eq!(found.recorded.to_bits(), f64::from(f32::from_bits(position_bits)).to_bits());
    assert!((found.replayed - found.recorded).abs() < 1e-6, "{found:?}");
}

/// A recording written by another process, and its length in seconds at the start.
struct Writing {
    folder: TempDir,
    process: Child,
}

impl Writing {
    /// Starts `dimsart` with these arguments; its output folder is `out` in its working folder.
    fn start(arguments: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_dimsart"));
        command.current_dir(folder.path()).args(arguments).stdout(Stdio::null()).stderr(Stdio::null());
        Self { process: command.spawn().unwrap(), folder }
    }

    fn path(&self) -> PathBuf {
        self.folder.path().join("out").join(FILE)
    }

    /// Waits until the file is this long; fails if the process ends. Reading the file here could take longer than writing it.
    fn wait_for(&mut self, bytes: u64) {
        while fs::metadata(self.path()).map_or(0, |file| file.len()) < bytes {
            let ended = self.process.try_wait().unwrap();
            assert!(ended.is_none(), "{ended:?} before {bytes} bytes in {}", self.path().display());
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// Ends the process as the system does.
    fn kill(mut self) -> (TempDir, PathBuf) {
        self.process.kill().unwrap();
        self.process.wait().unwrap();
        let path = self.path();
        (self.folder, path)
    }
}

/// Reads a recording with Python's readers; `None` without their packages.
fn read_by_others(path: &Path) -> Option<serde_json::Value> {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/oracle/recording.py");
    let output = Command::new(test_requirements::python()?).args(["-B", script]).arg(path).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(serde_json::from_slice(&output.stdout).unwrap())
}

#[test]
fn a_run_that_is_killed_leaves_a_file_that_everybody_reads() {
    let long = ["run", "joint", "--signals", "mcap", "--out", "out", "--set", "duration_s=100000"];
    let begun_s = since_1970_s();
    let mut writing = Writing::start(&long);
    writing.wait_for(4_000_000);
    let (folder, path) = writing.kill();
    let found = replay(&path, dimsart_modules::ALL, |_| ()).unwrap();
    assert!(found.is_cut && !found.diverges(), "{found:?}");
    let ticks = found.controllers[0].ticks;
    assert!(ticks > 1000, "{found:?}");
    let path = path.to_str().unwrap();
    assert!(dimsart(folder.path(), &["replay", path]).1.contains("incomplete recording"));
    let Some(read) = read_by_others(Path::new(path)) else { return };
    for reader in ["mcap", "rosbags"] {
        let count = |topic: &str| read[reader][topic].as_u64();
        assert_eq!((count("/joint/inputs"), count("/joint")), (Some(ticks), Some(ticks)), "{reader}: {read}");
    }
    let last = &read["last"]["/joint"];
    assert_eq!((last["tick"].as_u64(), last["time_s"].as_f64()), (Some(ticks - 1), Some(found.recorded_s)));
    assert_eq!(last["position"].as_array().map(Vec::len), Some(1), "{last}");
    let start_s = last["log_time"].as_f64().unwrap() * 1e-9 - found.recorded_s;
    assert!((begun_s..since_1970_s()).contains(&start_s), "log_time is wall-clock time: {last}");
}

fn since_1970_s() -> f64 {
    std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap().as_secs_f64()
}

#[test]
fn a_recording_in_real_time_that_is_killed_lacks_half_a_second_at_most() {
    let mut writing = Writing::start(&["serve", "joint", "--no-page", "--record", "out"]);
    // The first chunk.
    writing.wait_for(20_000);
    // From here on the joint runs for three seconds, less the time that a busy computer skips.
    thread::sleep(Duration::from_secs(3));
    let (_folder, path) = writing.kill();
    let found = replay(&path, dimsart_modules::ALL, |_| ()).unwrap();
    assert!(found.is_cut && found.recorded_s > 2.0, "{found:?}");
}

#[test]
fn a_damaged_length_takes_no_memory_and_is_found_where_it_is() {
    let folder = joint();
    let bytes = fs::read(folder.path().join(FILE)).unwrap();
    for place in [9, 12, 14, 16] {
        let mut damaged = bytes.clone();
        damaged[place] = 0xFF;
        fs::write(folder.path().join("damaged.mcap"), damaged).unwrap();
        let command =
            format!("ulimit -v 2000000; exec {} replay damaged.mcap", env!("CARGO_BIN_EXE_dimsart"));
        let output = Command::new("sh").current_dir(folder.path()).args(["-c", &command]).output().unwrap();
        let printed = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "byte {place}: {printed}");
        assert!(printed.contains("is damaged at byte "), "byte {place}: {printed}");
    }
}

#[test]
fn what_cannot_be_replayed_says_why_and_what_can() {
    let folder = joint();
    let refused = |arguments: &[&str], expected: &str| {
        let (status, printed) = dimsart(folder.path(), arguments);
        assert!(status == 1 && printed.contains(expected), "{status}: {printed}");
    };
    fs::write(folder.path().join("text"), "time_s,POSITION\n0,1\n").unwrap();
    refused(&["replay", "nowhere.mcap"], "cannot read nowhere.mcap");
    refused(&["replay", "text"], "text is not an MCAP file");
    refused(&["replay", "."], "cannot read .");
    let rest = |name: &str, text: String| match name {
        "joint.scheme" => text.replace("PIDCTRL_MOD", "NEWER_MOD"),
        _ => text,
    };
    doctored(&folder, rest, |_, _| ());
    refused(&["replay", FILE], "joint.scheme:1:8: 'NEWER_MOD' is not a module");
    let mcap = fs::read(folder.path().join(FILE)).unwrap();
    let mut signals = mcap::Writer::new(File::create(folder.path().join("line.mcap")).unwrap()).unwrap();
    for found in mcap::MessageStream::new(&mcap).unwrap().map(Result::unwrap) {
        if !found.channel.topic.ends_with("/inputs") {
            signals.write(&found).unwrap();
        }
    }
    signals.finish().unwrap();
    refused(&["replay", "line.mcap"], "dimsart serve --record");
    assert!(matches!(
        replay(&folder.path().join("line.mcap"), dimsart_modules::ALL, |_| ()),
        Err(ReplayError::NoInputs { .. })
    ));
}

#[test]
fn a_port_is_recorded_by_another_command() {
    let folder = tempfile::tempdir().unwrap();
    let (status, printed) = dimsart(folder.path(), &["serve", "tcp:localhost:1", "--record", "here"]);
    assert!(status == 2 && printed.contains("dimsart record PORT"), "{status}: {printed}");
}
