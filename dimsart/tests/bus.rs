//! Packets over simulated buses: whole runs, and `dimsart bus`.
#![expect(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use std::process::{Command, Output};
use std::sync::atomic::AtomicBool;

use hil_sim::experiment::{Experiment, Run};
use hil_sim::rig_file::RigFile;

fn run(settings: &[&str]) -> Run {
    let settings: Vec<String> = settings.iter().map(ToString::to_string).collect();
    let scenario = RigFile::from_shipped("bilateral", &settings).unwrap();
    Experiment::new(&scenario).unwrap().run(&AtomicBool::new(false), |_| {})
}

const NO_DELAY: [&str; 2] = ["link.forward_delay_ticks=0", "link.backward_delay_ticks=0"];

/// Perceived stiffness as predicted for the measured round trip, within `1e-4`, and a passive channel.
fn assert_perceived(run: &Run) {
    assert!(run.outcome.stable && run.outcome.faults.is_empty(), "{:?}", run.outcome.faults);
    assert!(run.outcome.energy_min_j.unwrap() >= 0.0);
    for axis in run.outcome.axes.iter().take(2) {
        let ratio = axis.contact.unwrap().k_perceived_n_per_m.unwrap()
            / axis.contact.unwrap().k_predicted_n_per_m.unwrap();
        assert!((ratio - 1.0).abs() < 1e-4, "{ratio}");
    }
}

#[test]
fn a_clean_medium_costs_a_tick_each_way_and_what_is_perceived_is_as_predicted() {
    for sets in [
        &["link.carrier=uart"][..],
        &["link.carrier=can_fd"],
        // Two nodes with nine frames of 1 ms each per tick: more than CAN can send.
        &["link.carrier=can", "can.bits_per_s=4000000"],
        &["link.carrier=udp"],
    ] {
        let run = run(&[sets, &NO_DELAY].concat());
        assert_perceived(&run);
        assert_eq!(run.outcome.round_trip_ticks, Some(2 + 20), "{sets:?}");
        for traffic in &run.outcome.media {
            assert!(traffic.load > 0.0 && traffic.load < 1.0 && traffic.dropped == 0, "{traffic:?}");
        }
    }
}

#[test]
fn the_links_delay_comes_on_top_of_the_mediums() {
    let sets = ["link.carrier=udp", "udp.delay_s=0.0045", "link.forward_delay_ticks=3"];
    let run = run(&[&sets[..], &NO_DELAY[1..]].concat());
    assert_perceived(&run);
    assert_eq!(run.outcome.round_trip_ticks, Some(5 + 3 + 5 + 20));
}

/// Nine words at 115 200 baud need 4.3 ms, more than a tick.
#[test]
fn a_line_that_is_too_slow_is_a_fault() {
    let run = run(&["link.carrier=uart", "uart.bits_per_s=115200", "duration_s=1"]);
    assert!(run.outcome.media.iter().all(|traffic| traffic.load > 0.99 && traffic.dropped > 500));
    assert!(run.outcome.faults.iter().any(|fault| fault.contains("queue full")), "{:?}", run.outcome.faults);
}

/// The master's packets have priority: the superseded ones are the slave's.
#[test]
fn what_a_full_bus_does_not_take_is_told_of_both_sides() {
    let slow = ["link.carrier=can_fd", "can.bits_per_s=480000", "can.data_bits_per_s=960000", "duration_s=3"];
    let outcome = run(&slow).outcome;
    assert_eq!(outcome.received.len(), 2);
    let [traffic] = &outcome.media[..] else { panic!("{:?}", outcome.media) };
    assert!(traffic.packets == 6000 && traffic.dropped > 100, "{traffic:?}");
    let is_told = |what: &str| outcome.faults.iter().any(|fault| fault.contains(what));
    assert!(is_told("of the slave's 3000 packets dropped, send queue full"), "{:?}", outcome.faults);
    assert!(!is_told("of the master's"), "{:?}", outcome.faults);
}

#[test]
fn a_node_that_is_off_the_bus_is_not_called_a_full_line() {
    let outcome = run(&["link.carrier=can_fd", "can.bit_error_rate=0.01", "duration_s=1"]).outcome;
    let is_told = |what: &str| outcome.faults.iter().any(|fault| fault.contains(what));
    for side in ["master", "slave"] {
        assert!(is_told(&format!("the {side} went bus-off 4 times")), "{:?}", outcome.faults);
        assert!(is_told(&format!("of the {side}'s 1000 packets lost while bus-off")), "{:?}", outcome.faults);
    }
    assert!(!is_told("queue full"), "{:?}", outcome.faults);
    assert!(outcome.media[0].dropped > 1000, "{:?}", outcome.media);
}

#[test]
fn a_link_that_carries_nothing_is_a_fault_for_each_who_listens() {
    for set in ["link.loss=1", "udp.burst_entry_probability=1"] {
        let faults =
            run(&["link.carrier=udp", "udp.burst_exit_probability=0", set, "duration_s=0.5"]).outcome.faults;
        let silent =
            |name| format!("the link to COMM_RXMOD of the {name} never came up: no packet received; ");
        assert_eq!(faults.len(), 2, "{faults:?}");
        assert!(
            faults[0].starts_with(&silent("master")) && faults[1].starts_with(&silent("slave")),
            "{faults:?}"
        );
    }
}

/// Losses are recorded equally in both directions, so both sides lose the link in the same tick.
#[test]
fn a_link_that_both_sides_lose_at_once_is_told_of_both() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("delays.csv");
    std::fs::write(&path, "0\n".repeat(50) + &"lost\n".repeat(1000)).unwrap();
    let recorded = format!("udp.delays_file={}", path.display());
    let sets = ["link.carrier=udp", "udp.delay=recorded", &recorded, "duration_s=0.5"];
    let faults = run(&[&sets[..], &NO_DELAY].concat()).outcome.faults;
    let [master, slave] = &faults[..] else { panic!("{faults:?}") };
    assert!(master.starts_with("master lost link 0: "), "{master}");
    assert_eq!(master.replace("master", "slave"), *slave);
}

/// After a lost link, the results of the slave's controller do not move the slave.
#[test]
fn forces_that_no_device_gets_have_no_range() {
    let bursts = [
        "link.carrier=udp",
        "udp.burst_entry_probability=0.01",
        "udp.burst_exit_probability=0.2",
        "duration_s=5",
    ];
    let outcome = run(&bursts).outcome;
    let is_told = |what: &str| outcome.faults.iter().any(|fault| fault.contains(what));
    assert!(is_told("slave lost link 0") && is_told("master lost link 0"), "{:?}", outcome.faults);
    assert!(!is_told("force of axis"), "{:?}", outcome.faults);
}

#[test]
fn the_same_seed_gives_the_same_bits_over_a_bad_medium() {
    for sets in [
        ["link.carrier=uart", "uart.bit_error_rate=1e-4", "uart.byte_drop=1e-3"],
        ["link.carrier=can_fd", "can.bit_error_rate=1e-4", "can.other_nodes=2"],
        ["link.carrier=udp", "udp.delay=gamma", "udp.spread_s=0.003"],
    ] {
        let settings = [&sets[..], &["duration_s=2", "seed=4"]].concat();
        let bits = |run: Run| {
            let columns = 0..run.recording.columns().len();
            columns
                .flat_map(|index| run.recording.column(index).map(f64::to_bits).collect::<Vec<_>>())
                .collect::<Vec<_>>()
        };
        let [one, two] = [0, 1].map(|_| run(&settings));
        assert_eq!(one.outcome.media, two.outcome.media, "{sets:?}");
        assert!(
            one.outcome.media.iter().any(|traffic| traffic.errors > 0) || sets[1].contains("gamma"),
            "{sets:?}"
        );
        assert_eq!(bits(one), bits(two), "{sets:?}");
    }
}

/// 41 bytes at 500 Hz are 164 of the uplink's 245 kbit/s.
#[test]
fn the_packets_of_the_space_link_fit_its_link_at_500_hz_and_not_at_1_khz() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/space_link.toml");
    let load = |sets: &[&str]| {
        let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
        let scenario = RigFile::load(&path, &sets).unwrap();
        Experiment::new(&scenario).unwrap().run(&AtomicBool::new(false), |_| {}).outcome
    };
    let outcome = load(&[]);
    assert!(outcome.stable && outcome.faults.is_empty(), "{:?}", outcome.faults);
    // 0.1 % of 500 per second, each way; a packet superseded within a tick is neither lost nor refused.
    for received in &outcome.received {
        assert!((1..20).contains(&received.lost) && received.refused == 0, "{received:?}");
        assert!(received.superseded > 1000, "{received:?}");
    }
    assert_eq!(
        outcome.superseded_packets,
        outcome.received.iter().map(|each| u64::from(each.superseded)).sum::<u64>()
    );
    let without_loss = load(&["link.loss=0"]);
    assert_eq!(
        (without_loss.lost_packets, without_loss.refused_packets),
        (0, 0),
        "{:?}",
        without_loss.received
    );
    let [up, down] = &outcome.media[..] else { panic!("two ways") };
    assert!(up.load < 0.75 && up.dropped == 0 && down.load < 0.06 && up.longest_s < 0.015, "{up:?} {down:?}");
    // The wave takes 2 more ticks where packets are rarer than ticks, plus the ticks of the play-out.
    let fastest_ticks = outcome.round_trip_ticks.unwrap() - 2 - 2 * 5;
    let slowest_s = up.longest_s + down.longest_s;
    assert!(
        fastest_ticks >= 20 && (0.025..0.030).contains(&slowest_s),
        "{fastest_ticks} ticks, {slowest_s} s"
    );
    assert!(outcome.energy_min_j.unwrap() >= 0.0, "{outcome:?}");
    for axis in &outcome.axes {
        let ratio = axis.contact.unwrap().k_perceived_n_per_m.unwrap()
            / axis.contact.unwrap().k_predicted_n_per_m.unwrap();
        assert!((ratio - 1.0).abs() < 1e-4, "{ratio}");
    }
    // Jitter without play-out: the line acts as a damper, and only the drift is felt.
    let worn = load(&["link.playout_ticks=0"]);
    let predicted_n_per_m = outcome.k_predicted_n_per_m[0].unwrap();
    assert!(worn.k_perceived_n_per_m[0].unwrap() < 0.5 * predicted_n_per_m, "{worn:?}");
    assert_eq!(worn.k_predicted_n_per_m[0], None, "no prediction where displacement is lost");
    let creeps =
        |warning: &String| warning.contains("STALE LIMITED") && warning.contains("link.playout_ticks");
    assert!(worn.warnings.iter().any(creeps) && !outcome.warnings.iter().any(creeps), "{:?}", worn.warnings);
    let full = load(&["link.every_ticks=1", "duration_s=10"]);
    assert!(
        full.media[0].load > 0.99 && full.faults.iter().any(|fault| fault.contains("queue full")),
        "{full:?}"
    );
}

#[test]
fn packets_in_every_few_ticks_over_a_bus_are_perceived_as_predicted() {
    let run = run(&[&["link.carrier=can_fd", "link.every_ticks=2"], &NO_DELAY[..]].concat());
    assert_perceived(&run);
    assert_eq!(run.outcome.round_trip_ticks, Some(2 + 20 + 2));
}

#[test]
fn who_feels_too_little_is_told_why() {
    let bad = ["udp.delay=uniform", "udp.spread_s=0.004", "link.carrier=udp", "link.stale=limited"];
    let said = |more: &[&str]| {
        let sets = [&bad[..], more].concat();
        let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", *set]).collect();
        let output = dimsart(&[&["run", "--no-report"], &sets[..]].concat());
        String::from_utf8(output.stdout).unwrap().contains("link.playout_ticks")
    };
    assert!(said(&[]) && !said(&["link.playout_ticks=5"]));
}

fn dimsart(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_dimsart")).args(arguments).output().unwrap()
}

#[test]
fn a_full_bus_is_a_no_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let output =
        dimsart(&["bus", "--joints", "6", "--rate-hz", "1000", "--carrier", "can", "--out", out, "--json"]);
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("does NOT fit") && text.contains("  - send at most"), "{text}");
    let figures: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        (&figures["fits"], figures["packets"].as_array().unwrap().len()),
        (&serde_json::json!(false), 12)
    );
    assert!(figures["worst_load"].as_f64().unwrap() > 1.0);
    assert!(folder.path().join("bus.svg").metadata().unwrap().len() > 1000);
}

#[test]
fn a_bus_with_room_is_a_yes() {
    let sets = ["--set", "can.data_bits_per_s=8000000", "--no-picture"];
    let output = dimsart(&[&["bus"], &sets[..]].concat());
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success() && text.contains(": fits"), "{text}");
    let output = dimsart(&["bus", "--rate-hz", "0"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8(output.stderr).unwrap().contains("1 to 100000"));
}

#[test]
fn a_rig_is_told_which_commands_take_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("my.toml");
    let shipped = hil_sim::rig_file::RigFile::shipped("arm_bus").unwrap();
    std::fs::write(&path, shipped).unwrap();
    for rig in [path.to_str().unwrap(), "arm_bus"] {
        let output = Command::new(env!("CARGO_BIN_EXE_dimsart")).args(["bus", rig]).output().unwrap();
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{message}");
        let expected = [format!("{rig} has no [experiment.press]"), format!("`dimsart run {rig}`")];
        assert!(
            expected.iter().all(|part| message.contains(part)) && !message.contains("unknown key"),
            "{message}"
        );
    }
}
