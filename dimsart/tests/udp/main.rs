//! Both sides as separate processes over real UDP sockets in real time.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "a failed unwrap is a failed test")]

mod keys;
mod network;

use std::io::{BufRead, BufReader, Read};
use std::process::Command;

use network::{Network, address, figures, held, start, start_at, text};

/// Returns the largest value of a column of a side's signals.
fn largest(signals: &str, name: &str) -> f64 {
    let column = signals.lines().next().unwrap().split(',').position(|found| found == name).unwrap();
    let values =
        signals.lines().skip(1).map(|row| row.split(',').nth(column).unwrap().parse::<f64>().unwrap());
    values.fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn two_processes_run_the_experiment_over_udp() {
    let folder = tempfile::tempdir().unwrap();
    let duration = ["--set", "duration_s=2"];
    let outputs = Network::carry(|[to_slave, to_master]| {
        let slave = start("slave", to_master, folder.path(), &duration);
        let master = start("master", to_slave, folder.path(), &duration);
        [("master", master), ("slave", slave)]
            .map(|(side, process)| (side, process.wait_with_output().unwrap()))
    });
    for (side, output) in outputs {
        let figures = figures(&output);
        assert_eq!(figures["stable"], true, "{figures}");
        assert_eq!(figures["ticks"], 2000);
        let wall_s = figures["wall_s"].as_f64().unwrap();
        assert!(wall_s >= 1.999, "ran ahead of the clock: {wall_s} s for 2 s");
        // 20 ticks of the time-delay modules, and at least one on the link.
        let round_trip_ticks = figures["round_trip_ticks"].as_u64().unwrap();
        assert!(round_trip_ticks >= 21, "{round_trip_ticks} ticks");
        let real_time = &figures["real_time"];
        assert_eq!(real_time["side"], side);
        assert!(real_time["worst_lateness_s"].as_f64().unwrap() > 0.0, "{real_time}");
        assert!(figures["energy_min_j"].is_null(), "one side alone does not know the channel's energy");
        let out = text(&output.stderr);
        assert!(
            out.contains(&format!("unknown on the {side}: requires the wave variables of both sides")),
            "{out}"
        );
        // The hand's motion reaches the slave, so packets are transferred.
        let signals = std::fs::read_to_string(folder.path().join(side).join("signals.csv")).unwrap();
        assert_eq!(signals.lines().count(), 2001);
        let reached_m = largest(&signals, &format!("world.{side}.position[0] (m)"));
        assert!(reached_m > 1e-3, "the {side} moved {reached_m} m");
        assert!(folder.path().join(side).join("report.html").exists());
    }
}

#[test]
fn a_side_that_is_left_alone_runs_to_its_own_end() {
    let folder = tempfile::tempdir().unwrap();
    // 0.5 s of the master, then the second after which the slave reports a lost link.
    let [master, slave] = Network::carry(|[to_slave, to_master]| {
        let run = |side, peer, options: &[&str]| start(side, peer, folder.path(), options);
        let slave = run("slave", to_master, &["--no-report", "--set", "duration_s=2"]);
        // Figures of both sides are unknown without the other side's scheme.
        let unknown = ["--no-report", "--set", "duration_s=0.5", "--set", "slave.scheme=not/here.scheme"];
        let master = run("master", to_slave, &unknown);
        [master, slave].map(|process| figures(&process.wait_with_output().unwrap()))
    });
    assert_eq!((&master["ticks"], &slave["ticks"]), (&500.into(), &2000.into()));
    assert_eq!(slave["stable"], true, "{slave}");
    assert!(master["round_trip_ticks"].is_null() && slave["round_trip_ticks"].is_u64());
    let faults = slave["faults"].to_string();
    for fault in ["no packet from the master in the last ", "slave lost link 0: no packet for"] {
        assert!(faults.contains(fault), "{faults}");
    }
}

/// Returns the counters of a side's only receiver, in JSON and table.
fn assert_counted_once(output: &std::process::Output) {
    let figures = figures(output);
    assert_eq!(figures["received"].as_array().unwrap().len(), 1, "{figures}");
    let received = &figures["received"][0];
    for (one, all) in
        [("lost", "lost_packets"), ("superseded", "superseded_packets"), ("refused", "refused_packets")]
    {
        assert_eq!(received[one], figures[all], "{figures}");
    }
    let expected = format!("{} lost, {} refused", received["lost"], received["refused"]);
    let table = text(&output.stderr);
    let is_clean = ["lost", "superseded", "refused"].iter().all(|count| received[*count] == 0);
    assert!(table.contains(&expected) || is_clean && table.contains("0 packets lost or refused"), "{table}");
}

#[test]
fn a_peer_that_is_restarted_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let master = Network::carry(|[to_slave, to_master]| {
        let run =
            |side, peer, duration| start(side, peer, folder.path(), &["--no-report", "--set", duration]);
        let master = run("master", to_slave, "duration_s=1e6");
        // Each ends when it has exchanged packets with the master for this time.
        for _ in 0..2 {
            let slave = run("slave", to_master, "duration_s=0.5").wait_with_output().unwrap();
            assert!(figures(&slave)["received"].is_array(), "{slave:?}");
        }
        let kill =
            std::process::Command::new("kill").args(["-INT", &master.id().to_string()]).status().unwrap();
        assert!(kill.success());
        master.wait_with_output().unwrap()
    });
    let warnings = figures(&master)["warnings"].to_string();
    assert!(warnings.contains("the slave restarted at "), "{warnings}");
    assert_counted_once(&master);
}

#[test]
fn sides_with_different_sample_periods_are_told_so() {
    let folder = tempfile::tempdir().unwrap();
    let outputs = Network::carry(|[to_slave, to_master]| {
        let run = |side, peer, period| {
            let settings = ["--no-report", "--set", "duration_s=2", "--set", period];
            start(side, peer, folder.path(), &settings)
        };
        let slave = run("slave", to_master, "sample_period_s=0.002");
        let master = run("master", to_slave, "sample_period_s=0.001");
        [("master", 500, slave), ("slave", 1000, master)]
            .map(|(other, hz, process)| (other, hz, process.wait_with_output().unwrap()))
    });
    for (own, hz, output) in outputs {
        let warnings = figures(&output)["warnings"].to_string();
        assert!(warnings.contains(&format!("the {own} sends ")), "{warnings}");
        assert!(warnings.contains(&format!("expected {hz}")), "{warnings}");
        assert_counted_once(&output);
    }
}

#[test]
fn a_peer_that_never_comes_is_named_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let silent = held();
    let master = start("master", address(&silent), folder.path(), &["--wait-s", "0.3"]);
    let output = master.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let message = text(&output.stderr);
    let expected = format!(
        "dimsart: no packet from the slave at {} within 0.3 s; start the peer with `dimsart run --side slave` and the \
        same scenario, or increase --wait-s",
        address(&silent)
    );
    assert!(message.contains(&expected), "{message}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "a run that did not start left files");
}

#[test]
fn a_peer_with_another_scenario_is_told_from_a_missing_one() {
    let folder = tempfile::tempdir().unwrap();
    let outputs = Network::carry(|[to_slave, to_master]| {
        let more = ["--wait-s", "4", "--set", "dof=2"];
        let slave = start("slave", to_master, folder.path(), &more);
        let master = start("master", to_slave, folder.path(), &more[..2]);
        [master, slave].map(|process| process.wait_with_output().unwrap())
    });
    for output in outputs {
        assert_eq!(output.status.code(), Some(1));
        let message = text(&output.stderr);
        assert!(message.contains("use the same scenario (dof, schemes) on both sides"), "{message}");
    }
}

#[test]
fn an_address_in_use_is_named_with_the_key_that_changes_it() {
    let folder = tempfile::tempdir().unwrap();
    let (taken, peer) = (held(), held());
    let master = start_at(Some(address(&taken)), "master", address(&peer), folder.path(), &[]);
    let output = master.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let message = text(&output.stderr);
    assert!(message.contains(&format!("cannot listen on UDP address {}", address(&taken))), "{message}");
    assert!(message.contains("--set link.master_address=IP:PORT"), "{message}");
}

#[cfg(unix)]
#[test]
fn ctrl_c_while_waiting_ends_at_once_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let silent = held();
    let mut master = start("master", address(&silent), folder.path(), &[]);
    let mut messages = BufReader::new(master.stderr.take().unwrap());
    let mut message = String::new();
    messages.read_line(&mut message).unwrap();
    assert!(message.contains("waiting up to 60 s for the slave"), "{message}");
    assert!(Command::new("kill").args(["-INT", &master.id().to_string()]).status().unwrap().success());
    messages.read_to_string(&mut message).unwrap();
    assert_eq!(master.wait().unwrap().code(), Some(1));
    assert!(message.contains("stopped by the user while waiting for the slave, before the run"), "{message}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "a run that did not start left files");
}
