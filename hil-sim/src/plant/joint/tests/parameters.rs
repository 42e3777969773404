//! Valid and invalid joint parameters.

use super::*;

#[test]
fn impossible_joints_are_refused_by_their_first_parameter() {
    let motor = "load.inertia = 1.0\n[motor]\nkind = 'brushed'\n";
    let phases = "load.inertia = 1.0\n[motor]\nkind = 'three_phase'\n";
    for (file, path) in [
        ("load.inertia = 0.0", "load.inertia"),
        ("load.inertia = nan", "load.inertia"),
        ("load = { inertia = 1.0, damping = -1.0 }", "load.damping"),
        (&format!("{motor}resistance_ohm = 0.0"), "motor.resistance_ohm"),
        (&format!("{motor}thermal.capacity_j_per_k = 0.0"), "motor.thermal.capacity_j_per_k"),
        (&format!("{phases}pole_pairs = 0"), "motor.pole_pairs"),
        (&format!("{phases}dead_time_share = 0.3"), "motor.dead_time_share"),
        (&format!("{phases}supply_v = inf\ndead_time_share = 0.01"), "motor.dead_time_share"),
        ("load.inertia = 1.0\ngear.efficiency = 0.0", "gear.efficiency"),
        ("load.inertia = 1.0\ngear.backlash = 0.01", "gear.backlash"),
        ("load.inertia = 1.0\nflexible.stiffness = 1e4", "gear.inertia_kg_m2"),
        ("load.inertia = 1.0\nfriction = { coulomb = 2.0, breakaway = 1.0 }", "friction.breakaway"),
        ("load.inertia = 1.0\nfriction.presliding_stiffness = 1e4", "friction.coulomb"),
        ("load.inertia = 1.0\nstops = { min = 1.0, max = 0.0 }", "stops.max"),
        // Natural frequency 1e6 rad/s.
        ("load.inertia = 1e-6\nstops.stiffness = 1e6", "stops.stiffness"),
    ] {
        let parameters: JointParameters = toml::from_str(file).unwrap();
        let error = parameters.check().unwrap_err();
        assert_eq!(error.path, path, "{file}: {error}");
    }
    let too_fast: JointParameters = toml::from_str("load.inertia = 1e-6\nstops.stiffness = 1e6").unwrap();
    assert_eq!(
        too_fast.build().unwrap_err().to_string(),
        "parameter `stops.stiffness` is 1000000, must be small enough for 5000 sub-steps per ms (needs 10000)"
    );
}

#[test]
fn unknown_keys_are_refused_in_every_section() {
    for file in [
        "load.inertia = 1.0\nlod = 1.0",
        "load = { inertia = 1.0, mass = 1.0 }",
        "load.inertia = 1.0\nmotor = { kind = 'brushed', ohm = 1.0 }",
        "load.inertia = 1.0\nmotor = { kind = 'three_phase', inductance_h = 1.0 }",
        "load.inertia = 1.0\nmotor = { kind = 'ideal', ohm = 1.0 }",
        "load.inertia = 1.0\nmotor = { kind = 'steam' }",
        "load.inertia = 1.0\ngear.teeth = 3",
        "gear.ratio = 3.0",
    ] {
        assert!(toml::from_str::<JointParameters>(file).is_err(), "{file}");
    }
}

#[test]
fn a_joint_reads_back_as_it_was_written() {
    let file = "load.inertia = 1.0\nstops.max = 2.0\nflexible.damping = 1.0\n\
                motor = { kind = 'three_phase', pole_pairs = 7, thermal.ambient_c = 30.0 }";
    let parameters: JointParameters = toml::from_str(file).unwrap();
    let written = toml::to_string(&parameters).unwrap();
    assert_eq!(toml::from_str::<JointParameters>(&written).unwrap(), parameters, "{written}");
}
