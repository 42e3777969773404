//! Names used by scripts: keys of `--set` and fields of `--json`. Names may be added, but not removed.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use std::path::PathBuf;

use hil_sim::experiment::run;
use hil_sim::rig_file::RigFile;
use serde_json::Value;

/// Keys of the bilateral scenario.
const KEYS: &[&str] = &[
    "seed",
    "duration_s",
    "sample_period_s",
    "dof",
    "environment",
    "link.carrier",
    "link.forward_delay_ticks",
    "link.backward_delay_ticks",
    "link.jitter_ticks",
    "link.loss",
    "link.duplication",
    "link.reordering",
    "link.stale",
    "link.playout_ticks",
    "link.timeout_ticks",
    "link.every_ticks",
    "link.key_file",
    "link.master_address",
    "link.slave_address",
    "uart.bits_per_s",
    "uart.bit_error_rate",
    "uart.byte_drop",
    "uart.byte_insert",
    "uart.queue_bytes",
    "can.bits_per_s",
    "can.data_bits_per_s",
    "can.bit_error_rate",
    "can.other_nodes",
    "can.rejoins",
    "can.queue_frames",
    "udp.forward_bits_per_s",
    "udp.backward_bits_per_s",
    "udp.header_bytes",
    "udp.queue_bytes",
    "udp.delay",
    "udp.delay_s",
    "udp.spread_s",
    "udp.gamma_shape",
    "udp.delays_file",
    "udp.burst_entry_probability",
    "udp.burst_exit_probability",
    "udp.burst_loss",
    "udp.overtaking",
    "wave.impedance_n_s_per_m",
    "wave.form",
    "master.scheme",
    "master.stiffness_n_per_m",
    "master.damping_n_s_per_m",
    "master.time_delay_ticks",
    "master.device.mass_kg",
    "master.device.damping_n_s_per_m",
    "master.device.coulomb_friction_n",
    "master.device.encoder_step_m",
    "master.device.start_position_m",
    "master.motor.resistance_ohm",
    "master.motor.inductance_h",
    "master.motor.torque_constant_nm_per_a",
    "master.motor.rotor_inertia_kg_m2",
    "master.motor.transmission_rad_per_m",
    "master.motor.current_bandwidth_rad_per_s",
    "master.motor.voltage_limit_v",
    "slave.scheme",
    "slave.stiffness_n_per_m",
    "slave.damping_n_s_per_m",
    "slave.time_delay_ticks",
    "slave.device.mass_kg",
    "slave.device.damping_n_s_per_m",
    "slave.device.coulomb_friction_n",
    "slave.device.encoder_step_m",
    "slave.device.start_position_m",
    "slave.motor.resistance_ohm",
    "slave.motor.inductance_h",
    "slave.motor.torque_constant_nm_per_a",
    "slave.motor.rotor_inertia_kg_m2",
    "slave.motor.transmission_rad_per_m",
    "slave.motor.current_bandwidth_rad_per_s",
    "slave.motor.voltage_limit_v",
    "hand.mass_kg",
    "hand.damping_n_s_per_m",
    "hand.stiffness_n_per_m",
    "hand.path_amplitude_m",
    "hand.contact_force_n",
    "wall.position_m",
    "wall.stiffness_n_per_m",
    "wall.damping_n_s_per_m",
    "wall.solid",
    "spring.rest_position_m",
    "spring.stiffness_n_per_m",
    "spring.damping_n_s_per_m",
    "limits.position_m",
    "limits.force_n",
    "limits.wave",
    "record.every_ticks",
    "record.signals",
];

/// Fields of both a scenario's and a rig's run.
const OF_BOTH: &[&str] = &[
    "stable",
    "ticks",
    "simulated_s",
    "wall_s",
    "realtime_factor",
    "energy_ports_min_j",
    "limit_cycles",
    "axes",
    "media",
    "received",
    "lost_packets",
    "superseded_packets",
    "refused_packets",
    "faults",
];
const OF_SCENARIO: &[&str] = &[
    "energy_min_j",
    "loops",
    "rounding_creep_m_per_h",
    "round_trip_ticks",
    "k_perceived_n_per_m",
    "k_predicted_n_per_m",
    "warnings",
    "real_time",
];
const OF_RIG: &[&str] = &["perceived", "saturated", "undecided"];
const OF_FOLLOWING: &[&str] = &[
    "device",
    "axis",
    "reference",
    "unit",
    "rise_time_s",
    "overshoot",
    "settling_time_s",
    "rms_error",
    "peak_error",
    "growth_per_tick",
    "phase_margin_deg",
    "crossover_hz",
    "gain_margin",
    "bandwidth_hz",
    "contact_growth_per_tick",
];

fn has(value: &Value, names: &[&str]) {
    let found = value.as_object().unwrap();
    let missing: Vec<_> = names.iter().filter(|name| !found.contains_key(**name)).collect();
    assert!(missing.is_empty(), "{missing:?} not in {value}");
}

fn rig(name: &str, sets: &[&str]) -> Value {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    let file = RigFile::read(RigFile::shipped(name).unwrap(), name, PathBuf::new(), &sets).unwrap();
    serde_json::to_value(run(&file).unwrap().outcome).unwrap()
}

#[test]
fn every_key_of_the_bilateral_scenario_keeps_its_name() {
    let file = RigFile::from_shipped("bilateral", &[]).unwrap();
    let text = RigFile::shipped("bilateral").unwrap();
    let of_file =
        |key: &&&str| key.split('.').next_back().is_some_and(|last| text.contains(&format!("{last} = ")));
    let has = |key: &&&str| file.parameter(key).is_some() || of_file(key);
    let missing: Vec<_> = KEYS.iter().filter(|key| !has(key)).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn old_names_of_keys_are_accepted_with_a_warning() {
    for (old, new) in [
        ("hand.damping_ns_per_m=0.5", "hand.damping_n_s_per_m=0.5"),
        ("wave.impedance_ns_per_m=12", "wave.impedance_n_s_per_m=12"),
        ("udp.burst_end=0.5", "udp.burst_exit_probability=0.5"),
        ("device.slave.axis.0.wall.damping=2", "device.slave.axis.0.wall.damping=2"),
    ] {
        let [old_file, new_file] =
            [old, new].map(|set| RigFile::from_shipped("bilateral", &[set.to_owned()]).unwrap());
        assert_eq!(old_file.renamed_keys.len(), usize::from(old != new), "{old}");
        assert_eq!(RigFile { renamed_keys: Vec::new(), ..old_file }, new_file, "{old}");
    }
    let text = RigFile::shipped("joint").unwrap();
    let old = text.replace("amplitude = ", "size = ");
    let [old, new] = [&old, text].map(|text| RigFile::read(text, "joint", PathBuf::new(), &[]).unwrap());
    assert!(old.renamed_keys.iter().any(|key| key.old == "size") && new.renamed_keys.is_empty());
    let outcome = run(&old).unwrap().outcome;
    assert!(outcome.warnings.iter().any(|warning| warning.contains("`size` is now `amplitude`")));
    assert_eq!(RigFile { renamed_keys: Vec::new(), ..old }, new);
}

#[test]
fn every_figure_of_a_scenario_keeps_its_name() {
    let outcome =
        serde_json::to_value(run(&RigFile::from_shipped("bilateral", &[]).unwrap()).unwrap().outcome)
            .unwrap();
    has(&outcome, OF_BOTH);
    has(&outcome, OF_SCENARIO);
    has(&outcome["axes"][0], &["axis", "k_perceived_n_per_m", "k_predicted_n_per_m"]);
    has(&outcome["loops"][0], &["held", "growth_per_tick"]);
    has(&outcome["received"][0], &["station", "lost", "superseded", "refused"]);
}

#[test]
fn every_figure_of_a_rig_keeps_its_name() {
    let outcome = rig("joint", &[]);
    has(&outcome, OF_BOTH);
    has(&outcome, OF_RIG);
    has(&outcome["axes"][0], OF_FOLLOWING);
    let telerobot = rig("telerobot", &["experiment.margins=false"]);
    has(&telerobot["perceived"][0], &["device", "axis", "met_by", "unit", "stiffness", "unsettled"]);
    has(&telerobot["theory"], &["needed_damping", "damping"]);
}
