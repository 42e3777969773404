//! Both sides as processes of their own, talking over real UDP sockets in real time.
#![expect(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use std::net::UdpSocket;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Addresses of this computer that nobody uses.
fn free_addresses() -> [String; 2] {
    let sockets = [(); 2].map(|()| UdpSocket::bind("127.0.0.1:0").unwrap());
    sockets.map(|socket| socket.local_addr().unwrap().to_string())
}

fn start(side: &str, [master, slave]: &[String; 2], duration_s: f64, folder: &Path, more: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_dimsart"))
        .args(["run", "--json", "--side", side])
        .args(["--set", &format!("link.master_address={master}")])
        .args(["--set", &format!("link.slave_address={slave}")])
        .args(["--set", &format!("duration_s={duration_s:?}")])
        .arg("--out")
        .arg(folder.join(side))
        .args(more)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

fn figures(output: &Output) -> serde_json::Value {
    assert!(output.status.success(), "{}", text(&output.stderr));
    serde_json::from_str(text(&output.stdout).lines().last().unwrap()).unwrap()
}

/// Largest value of a column in a side's signals.
fn largest(signals: &str, name: &str) -> f64 {
    let column = signals.lines().next().unwrap().split(',').position(|found| found == name).unwrap();
    let values =
        signals.lines().skip(1).map(|row| row.split(',').nth(column).unwrap().parse::<f64>().unwrap());
    values.fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn two_processes_run_the_experiment_over_udp() {
    let folder = tempfile::tempdir().unwrap();
    let addresses = free_addresses();
    let slave = start("slave", &addresses, 2.0, folder.path(), &[]);
    let master = start("master", &addresses, 2.0, folder.path(), &[]);
    for (side, process) in [("master", master), ("slave", slave)] {
        let output = process.wait_with_output().unwrap();
        let figures = figures(&output);
        assert_eq!(figures["stable"], true, "{figures}");
        assert_eq!(figures["ticks"], 2000);
        // In step with the clock to the end, however often a tick was late.
        let wall_s = figures["wall_s"].as_f64().unwrap();
        assert!((1.99..2.5).contains(&wall_s), "{wall_s} s for 2 s");
        // 20 ticks of the time-delay modules, and at least one on the link.
        let round_trip_ticks = figures["round_trip_ticks"].as_u64().unwrap();
        assert!((21..60).contains(&round_trip_ticks), "{round_trip_ticks} ticks");
        let real_time = &figures["real_time"];
        assert_eq!(real_time["side"], side);
        assert!(real_time["packets_lost"].as_u64().unwrap() < 400, "{real_time}");
        assert!(real_time["worst_lateness_s"].as_f64().unwrap() > 0.0, "{real_time}");
        assert!(figures["energy_min_j"].is_null(), "one side cannot know the channel's energy");
        let out = text(&output.stdout);
        assert!(out.contains(&format!("not known on the {side}: it takes the waves of both sides")), "{out}");
        // The hand's motion reaches the slave, so packets really flow.
        let signals = std::fs::read_to_string(folder.path().join(side).join("signals.csv")).unwrap();
        assert_eq!(signals.lines().count(), 2001);
        let reached_m = largest(&signals, &format!("world.{side}.position[0] (m)"));
        assert!(reached_m > 0.01, "the {side} moved {reached_m} m");
        assert!(folder.path().join(side).join("report.html").exists());
    }
}

#[test]
fn a_side_that_is_left_alone_runs_to_its_own_end() {
    let folder = tempfile::tempdir().unwrap();
    let addresses = free_addresses();
    let slave = start("slave", &addresses, 1.5, folder.path(), &["--no-report"]);
    // Its figures of both sides are not known where the other side's scheme is not at hand.
    let unknown = ["--no-report", "--set", "slave.scheme=not/here.scheme"];
    let master = start("master", &addresses, 0.5, folder.path(), &unknown);
    let started = Instant::now();
    let master = figures(&master.wait_with_output().unwrap());
    let slave = figures(&slave.wait_with_output().unwrap());
    assert!(started.elapsed() < Duration::from_secs(30));
    assert_eq!((&master["ticks"], &slave["ticks"]), (&500.into(), &1500.into()));
    assert_eq!(slave["stable"], true, "{slave}");
    assert!(master["round_trip_ticks"].is_null() && slave["round_trip_ticks"].is_u64());
    let fault = "nothing came from the master in the last ";
    assert!(slave["faults"].to_string().contains(fault), "{slave}");
}

#[test]
fn a_peer_that_never_comes_is_named_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let addresses = free_addresses();
    let master = start("master", &addresses, 1.0, folder.path(), &["--wait-s", "0.3"]);
    let output = master.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let message = text(&output.stderr);
    let expected = format!(
        "dimsart: nothing came from the slave at {} in 0.3 s; start it with `dimsart run --side slave` and the same \
         scenario, or wait longer with --wait-s",
        addresses[1]
    );
    assert!(message.contains(&expected), "{message}");
}

#[test]
fn a_peer_with_another_scenario_is_told_from_a_missing_one() {
    let folder = tempfile::tempdir().unwrap();
    let addresses = free_addresses();
    let slave = start("slave", &addresses, 1.0, folder.path(), &["--wait-s", "4", "--set", "dof=2"]);
    let master = start("master", &addresses, 1.0, folder.path(), &["--wait-s", "2"]);
    let output = master.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let message = text(&output.stderr);
    assert!(message.contains("give both sides the same scenario (dof, schemes)"), "{message}");
    assert_eq!(slave.wait_with_output().unwrap().status.code(), Some(1));
}

#[test]
fn an_address_in_use_is_named_with_the_key_that_changes_it() {
    let folder = tempfile::tempdir().unwrap();
    let taken = UdpSocket::bind("127.0.0.1:0").unwrap();
    let addresses = [taken.local_addr().unwrap().to_string(), free_addresses()[1].clone()];
    let output = start("master", &addresses, 1.0, folder.path(), &[]).wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let message = text(&output.stderr);
    assert!(message.contains(&format!("cannot listen on UDP address {}", addresses[0])), "{message}");
    assert!(message.contains("--set link.master_address=IP:PORT"), "{message}");
}

#[cfg(unix)]
#[test]
fn ctrl_c_while_waiting_ends_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let master = start("master", &free_addresses(), 1.0, folder.path(), &[]);
    std::thread::sleep(Duration::from_secs(1));
    assert!(Command::new("kill").args(["-INT", &master.id().to_string()]).status().unwrap().success());
    let output = master.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let message = text(&output.stderr);
    assert!(message.contains("stopped while waiting for the slave; nothing was run"), "{message}");
}
