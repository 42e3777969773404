//! Firmware with authentication: setting a key, and the behaviour of the board and its links with a key.

use std::fs;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};

use dimsart::connect::Device;
use dimsart_core::{LinkState, TickResult, types};
use dimsart_link::auth::{Key, KeyDomain, Profile, SecureChannel};
use dimsart_link::protocol::{KeyRefusal, LeaseStatus, Receiver, Refusal, Response, decode_response};
use hil_sim::emulated::Image;
use hil_sim::experiment::{Experiment, Run};
use hil_sim::link::Stream;
use hil_sim::rig::{Probe, Rig};
use hil_sim::rig_file::RigFile;
use tempfile::TempDir;

use crate::common::{key_image, timer_key_image};
use crate::firmware::{Firmware, greet};

const LOCKED: &str = "the board is locked: pass its key file (--key-file FILE)";
/// Timeout of a command, far above the time on a loaded machine.
const TIMEOUT_S: &str = "600";
const OPEN: &str = "no key is set: the device accepts every client without authentication";
/// Offset of the key in the firmware's flash file.
const KEY_PLACE: usize = 8192;

fn key_file(folder: &TempDir, digit: &str) -> PathBuf {
    let path = folder.path().join(format!("{digit}.key"));
    fs::write(&path, digit.repeat(32)).unwrap();
    path
}

/// A board without a host that simulates its device, and key files.
struct Setup {
    firmware: Firmware,
    key: String,
    other: String,
    _folder: TempDir,
}

impl Setup {
    fn start() -> Option<Self> {
        let firmware = Firmware::start_image(timer_key_image()?, false);
        let folder = tempfile::tempdir().unwrap();
        let [key, other] = ["a", "b"].map(|digit| key_file(&folder, digit).display().to_string());
        Some(Self { firmware, key, other, _folder: folder })
    }

    fn run(&self, arguments: &[&str], timeout_s: &str) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_dimsart"));
        command
            .args(["connect", &self.firmware.port(), "--timeout-s", timeout_s])
            .args(arguments)
            .output()
            .unwrap()
    }

    #[track_caller]
    fn does(&self, arguments: &[&str], expected: &str) {
        let output = self.run(arguments, TIMEOUT_S);
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(
            output.status.success() && text.contains(expected),
            "{arguments:?}: {text} {:?}",
            output.stderr
        );
    }

    #[track_caller]
    fn refuses(&self, arguments: &[&str], expected: &str) {
        self.refuses_within(arguments, TIMEOUT_S, expected);
    }

    /// A client waits a tenth of its timeout for a valid challenge after each rejection of its key.
    #[track_caller]
    fn rejects_key(&self, arguments: &[&str]) {
        self.refuses_within(arguments, "20", "the board's key differs from the key in the file");
    }

    #[track_caller]
    fn refuses_within(&self, arguments: &[&str], timeout_s: &str, expected: &str) {
        let output = self.run(arguments, timeout_s);
        let text = String::from_utf8(output.stderr).unwrap();
        assert!(!output.status.success() && text.contains(expected), "{arguments:?}: {text}");
    }
}

#[test]
fn a_board_is_given_a_key_at_rest_and_from_then_on_takes_what_moves_it_from_who_has_it() {
    let Some(mut board) = Setup::start() else { return };
    let (key, other) = (board.key.clone(), board.other.clone());
    board.does(&["show"], OPEN);
    board.refuses(&["key", "set", &key], "the key can only be changed at rest");
    board.does(&["stop"], "stopped");
    board.does(&["key", "set", &key], "a key is set");
    for _ in 0..2 {
        for arguments in
            [["check"].as_slice(), &["arm"], &["save"], &["key", "set", &other], &["key", "clear"]]
        {
            board.refuses(arguments, LOCKED);
        }
        board.does(&["show"], "a key is set");
        board.does(&["stop"], "stopped");
        board.rejects_key(&["check", "--key-file", &other]);
        board.does(&["check", "--key-file", &key], "");
        board.does(&["set", "PDCTRL_MOD", "K_PARAM", "20", "--key-file", &key], "K_PARAM is 20");
        board.does(&["stop"], "stopped");
        board.firmware.restart();
        board.does(&["stop"], "stopped");
    }
    board.does(&["key", "set", &other, "--key-file", &key], "a key is set");
    board.rejects_key(&["key", "clear", "--key-file", &key]);
    board.does(&["key", "clear", "--key-file", &other], OPEN);
    board.does(&["check"], "");
}

#[test]
fn a_key_that_cannot_be_read_locks_for_good() {
    let Some(mut board) = Setup::start() else { return };
    let key = board.key.clone();
    board.does(&["stop"], "");
    board.does(&["key", "set", &key], "a key is set");
    board.firmware.end();
    let path = board.firmware.folder().join("flash");
    let mut flash = fs::read(&path).unwrap();
    flash[KEY_PLACE] ^= 1;
    fs::write(path, flash).unwrap();
    board.firmware.restart();
    board.does(&["show"], "the device CANNOT READ ITS KEY");
    for arguments in [["check"].as_slice(), &["arm"], &["key", "set", &key], &["key", "clear"]] {
        board.refuses(arguments, "the key stored in the board is corrupt");
        board.refuses(&[arguments, &["--key-file", &key]].concat(), "the key stored in the board is corrupt");
    }
}

#[test]
fn an_image_without_authentication_says_so() {
    let Some(firmware) = Firmware::start(false) else { return };
    let mut device = greet(firmware.uart());
    let refused = device.set_key(&[1; 16]).unwrap_err().to_string();
    assert!(refused.contains("this image has no authentication; flash the `auth` variant"), "{refused}");
    assert!(!device.overview().unwrap().to_string().contains(" key"));
}

/// Records the sent bytes.
#[derive(Debug)]
struct Wiretap(Box<dyn Stream>, Arc<Mutex<Vec<u8>>>);

impl Read for Wiretap {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.0.read(bytes)
    }
}

impl Write for Wiretap {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.0.write(bytes)?;
        self.1.lock().unwrap().extend_from_slice(&bytes[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

#[test]
fn a_lease_is_sealed_and_whoever_repeats_it_is_refused() {
    let Some(board) = Setup::start() else { return };
    let heard = Arc::default();
    let key = [7; 16];
    let is_given_back = {
        let tapped: Box<dyn Stream> = Box::new(Wiretap(board.firmware.uart(), Arc::clone(&heard)));
        let mut device: Device<_> = greet(tapped);
        device.stop().unwrap();
        device.set_key(&key).unwrap();
        heard.lock().unwrap().clear();
        device.take_lease().unwrap();
        // On a busy computer the lease expires before these arrive; they are authenticated anyway.
        let _ = device.renew_lease();
        device.release_lease().is_ok()
    };
    let repeated = heard.lock().unwrap().clone();
    let mut uart = board.firmware.uart();
    uart.write_all(&repeated).unwrap();
    let (mut receiver, mut answers, mut buffer) = (Receiver::new(), Vec::new(), [0; 256]);
    while answers.len() < 4 {
        let count = uart.read(&mut buffer).unwrap_or_default();
        receiver.push_all(&buffer[..count], |content| {
            answers.extend(decode_response(content).ok().map(|(_, response)| format!("{response:?}")));
        });
    }
    let refused = Response::Refused(Refusal::Key(KeyRefusal::NotAccepted));
    // The lease status needs no key: a client reads it before it takes the lease.
    let (looked, repeated) = answers.split_first().unwrap();
    assert!(looked.starts_with("Lease("), "{looked}");
    assert!(
        !is_given_back || *looked == format!("{:?}", Response::Lease(LeaseStatus::default())),
        "{looked}"
    );
    assert!(
        repeated.len() >= 3 && repeated.iter().all(|answer| *answer == format!("{refused:?}")),
        "{repeated:?}"
    );
}

fn scenario(key: Option<&Path>) -> RigFile {
    let setting = key.map(|key| format!("link.key_file='{}'", key.display()));
    RigFile::from_shipped("bilateral", &setting.into_iter().collect::<Vec<_>>()).unwrap()
}

#[test]
fn what_is_perceived_over_an_authenticated_link_of_a_board_is_what_is_perceived_without() {
    let Some(image) = key_image() else { return };
    let folder = tempfile::tempdir().unwrap();
    let key = key_file(&folder, "a");
    let run = |mut experiment: Experiment, sides: &[&str]| -> Run {
        for side in sides {
            experiment.emulate(side, &image, None).unwrap();
        }
        let run = experiment.without_recording().run(&AtomicBool::new(false), |_| {});
        assert_eq!(run.outcome.faults, Vec::<String>::new(), "{sides:?}");
        run
    };
    let perceived = |run: &Run| run.outcome.axes[0].contact.unwrap().k_perceived_n_per_m.unwrap();
    let expected = perceived(&run(Experiment::new(&scenario(None)).unwrap(), &[]));
    for sides in [["slave"].as_slice(), &["master", "slave"]] {
        let found = perceived(&run(Experiment::new(&scenario(Some(&key))).unwrap(), sides));
        assert!((found / expected - 1.0).abs() < 1e-4, "{found} N/m, {expected} N/m without, {sides:?}");
    }
}

/// The slave as a board with a key, the master here.
fn with_slave(scenario: &RigFile, image: &Image) -> Experiment {
    let mut experiment = Experiment::new(scenario).unwrap();
    experiment.emulate("slave", image, None).unwrap();
    experiment
}

/// Returns the state of the slave's link for each of these ticks.
fn states(rig: &mut Rig, ticks: usize) -> Vec<u32> {
    let mut probe = Probe::new(types::LINK_STATE.first());
    let mut found = Vec::new();
    for _ in 0..ticks {
        rig.step();
        assert!(rig.take_board_error().is_none());
        found.extend(probe.words(&rig.stations()[1]).first().copied());
    }
    found
}

#[test]
fn a_board_does_not_follow_who_has_another_key() {
    let Some(image) = key_image() else { return };
    let folder = tempfile::tempdir().unwrap();
    let key = key_file(&folder, "a");
    let mut experiment = Experiment::new(&scenario(Some(&key))).unwrap();
    fs::write(&key, "b".repeat(32)).unwrap();
    experiment.emulate("slave", &image, None).unwrap();
    let rig = experiment.rig_mut();
    let found = states(rig, 1000);
    let ok = [LinkState::Ok, LinkState::OkSomeLost].map(|state| state as u32);
    assert!(!found.iter().any(|state| ok.contains(state)), "{found:?}");
    assert!(found.iter().filter(|state| **state == LinkState::Error as u32).count() > 900, "{found:?}");
    let (master, slave) = (rig.stations()[0].position(), rig.stations()[1].position());
    assert!(master[0].abs() > 0.01 && slave[0].abs() < 1e-9, "{master:?} {slave:?}");
}

#[test]
fn a_link_whose_other_side_changes_its_key_is_lost_and_the_device_gets_no_force() {
    let Some(image) = key_image() else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut experiment = with_slave(&scenario(Some(&key_file(&folder, "a"))), &image);
    let rig = experiment.rig_mut();
    assert_eq!(states(rig, 200).last(), Some(&(LinkState::Ok as u32)));
    assert_eq!(rig.stations()[1].last_tick, TickResult::Ran);
    let stranger = SecureChannel::new(&Key::new(&[0xBB; 16]), KeyDomain::Link(0), Profile::Full, 9);
    rig.stations_mut()[0].enable_authentication(0, stranger, 1e-3);
    let found = states(rig, 100);
    assert!(found.contains(&(LinkState::Error as u32)), "{found:?}");
    assert_eq!(found.last(), Some(&(LinkState::Timeout as u32)), "{found:?}");
    assert_eq!(rig.stations()[1].last_tick, TickResult::LinkLost { link: 0 });
}

/// Firmware cost of a tick of one side, with and without a key.
#[test]
fn a_key_costs_the_tick_nothing_and_leaves_half_of_the_processor() {
    let Some(image) = key_image() else { return };
    let folder = tempfile::tempdir().unwrap();
    let key = key_file(&folder, "a");
    let [without, with] = [None, Some(key.as_path())].map(|key| {
        let mut experiment = with_slave(&scenario(key), &image);
        let rig = experiment.rig_mut();
        states(rig, 500);
        let mut sums = [0, 0];
        for _ in 0..500 {
            rig.step();
            let board = rig.stations_mut()[1].board_mut().unwrap();
            sums[0] += board.instructions().unwrap();
            sums[1] += board.instructions_of_all().unwrap();
        }
        sums.map(|sum| sum / 500)
    });
    println!("instructions of a tick and in total: {without:?}, with a key {with:?}");
    assert!(with[0].abs_diff(without[0]) < 10, "{with:?} {without:?}");
    // An STM32G4 has 168 000 cycles per tick.
    assert!(with[1] - without[1] < 84_000, "{with:?} {without:?}");
}
