//! Both sides with keys, and an intermediary.

use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::Mutex;
use std::time::Duration;

use super::network::{Network, figures, start, text};

const DURATION: [&str; 3] = ["--no-report", "--set", "duration_s=1"];

fn key_file(folder: &Path, name: &str, digit: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, digit.repeat(32)).unwrap();
    path
}

fn setting(key: &Path) -> String {
    format!("link.key_file='{}'", key.display())
}

/// Runs both sides with these keys, slave first; the slave times out after a few seconds.
fn run(keys: [Option<&Path>; 2], meddle: impl Fn(usize, &[u8]) -> Vec<Vec<u8>> + Sync) -> [Output; 2] {
    let folder = tempfile::tempdir().unwrap();
    Network::tamper(meddle, |[to_slave, to_master]| {
        let side = |name, peer, key: Option<&Path>| {
            let setting = key.map(setting);
            let mut more = [&DURATION[..], &["--wait-s", "4"]].concat();
            more.extend(setting.iter().flat_map(|setting| ["--set", setting]));
            start(name, peer, folder.path(), &more)
        };
        let slave = side("slave", to_master, keys[1]);
        let master = side("master", to_slave, keys[0]);
        [slave, master].map(|process| process.wait_with_output().unwrap())
    })
}

fn pass_on(_: usize, packet: &[u8]) -> Vec<Vec<u8>> {
    vec![packet.to_vec()]
}

/// Checks the message about an untrusted peer; no run was made.
fn refusal(output: &Output) -> String {
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(output.stdout.is_empty(), "{}", text(&output.stdout));
    assert!(message.contains("were refused: ") && message.contains("the same link.key_file"), "{message}");
    message
}

#[test]
fn two_processes_with_the_same_key_run_and_refuse_what_somebody_repeats() {
    let folder = tempfile::tempdir().unwrap();
    let key = key_file(folder.path(), "link.key", "a");
    let key = Some(key.as_path());
    // Every packet is 12 bytes longer than without a key, and is repeated 50 packets later.
    let sent = Mutex::new([Vec::new(), Vec::new()]);
    let repeat = |end: usize, packet: &[u8]| {
        let mut sent = sent.lock().unwrap();
        sent[end].push(packet.to_vec());
        let old = sent[end].len().checked_sub(50).and_then(|place| sent[end].get(place).cloned());
        [packet.to_vec()].into_iter().chain(old).collect()
    };
    for output in run([key, key], repeat) {
        let figures = figures(&output);
        assert_eq!((&figures["stable"], &figures["ticks"]), (&true.into(), &1000.into()), "{figures}");
        let refused = figures["refused_packets"].as_u64().unwrap();
        assert!(refused >= 800, "{refused} of about 1000 repeated packets were refused");
        assert!(figures["round_trip_ticks"].as_u64().unwrap() >= 21, "{figures}");
    }
    let longest = sent.into_inner().unwrap().iter().flatten().map(Vec::len).max();
    assert_eq!(longest, Some(47 + 12));
}

#[test]
fn a_side_with_another_key_or_none_is_refused_and_nothing_moves() {
    let folder = tempfile::tempdir().unwrap();
    let (key, other) = (key_file(folder.path(), "link.key", "a"), key_file(folder.path(), "other.key", "b"));
    for output in run([Some(&key), Some(&other)], pass_on) {
        let message = refusal(&output);
        assert!(message.contains("the two sides have different keys"), "{message}");
    }
    let [slave, master] = run([None, Some(&key)], pass_on);
    assert!(refusal(&slave).contains("not authenticated: the peer has no key"));
    assert!(refusal(&master).contains("the packet is authenticated, but this controller has no key"));
}

/// All packets of a master, replayed to a restarted slave with the same key.
#[test]
fn a_recorded_master_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let key = key_file(folder.path(), "link.key", "a");
    let recorded = Mutex::new(Vec::new());
    let record = |end: usize, packet: &[u8]| {
        if end == 0 {
            recorded.lock().unwrap().push(packet.to_vec());
        }
        vec![packet.to_vec()]
    };
    for output in run([Some(&key), Some(&key)], record) {
        assert_eq!(figures(&output)["stable"], true);
    }
    let recorded = recorded.into_inner().unwrap();
    assert!(recorded.len() > 1000);
    Network::carry(|[to_slave, to_master]| {
        let setting = setting(&key);
        let more = [&DURATION[..], &["--wait-s", "3", "--set", &setting]].concat();
        let slave = start("slave", to_master, folder.path(), &more);
        let player = std::net::UdpSocket::bind("127.0.0.1:0").unwrap();
        for packet in recorded.iter().cycle().take(2500) {
            player.send_to(packet, to_slave).unwrap();
            std::thread::sleep(Duration::from_millis(1));
        }
        let message = refusal(&slave.wait_with_output().unwrap());
        assert!(message.contains("forged"), "{message}");
    });
}

#[test]
fn a_key_that_cannot_be_used_is_told_before_anything_runs() {
    let folder = tempfile::tempdir().unwrap();
    let short = folder.path().join("short.key");
    std::fs::write(&short, "abc").unwrap();
    for output in run([Some(&short), Some(&folder.path().join("none.key"))], pass_on) {
        let message = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1));
        assert!(message.contains("openssl rand -hex 16"), "{message}");
    }
}
