//! Loops that are stable in free motion and oscillate in contact.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use std::sync::atomic::AtomicBool;

use hil_sim::experiment::Experiment;
use hil_sim::outcome::Outcome;
use hil_sim::response::LoopCondition;

use crate::loops::bilateral;

fn outcome(settings: &str) -> Outcome {
    let experiment = Experiment::new(&bilateral(settings)).unwrap();
    experiment.without_recording().run(&AtomicBool::new(false), |_| ()).outcome
}

/// A light slave with little damping at a hard undamped wall: the sampled controller with delay does not damp
/// its natural frequency on the wall, `sqrt(k/m)/2π = 225 Hz` for 0.05 kg.
const WEAK: &str = "dof=1 master.time_delay_ticks=0 slave.time_delay_ticks=0 hand.damping_n_s_per_m=0.5 \
                    slave.device.damping_n_s_per_m=2 wall.stiffness_n_per_m=1e5 wall.damping_n_s_per_m=0";

#[test]
fn a_slave_that_hammers_on_the_wall_is_not_stable() {
    for (mass_kg, forward, backward, hz) in
        [(0.05, 13, 12, 220.0), (0.05, 1, 1, 233.0), (0.05, 30, 30, 225.0), (0.1, 5, 5, 163.0)]
    {
        let delays = format!("link.forward_delay_ticks={forward} link.backward_delay_ticks={backward}");
        let outcome = outcome(&format!("{WEAK} {delays} slave.device.mass_kg={mass_kg}"));
        assert!(!outcome.stable, "{mass_kg} kg, {delays}");
        let slave = outcome.limit_cycles.iter().find(|cycle| cycle.device == "slave").unwrap();
        assert!((slave.hz - hz).abs() < 3.0 && slave.amplitude > 1e-5, "{slave:?}");
        assert!(outcome.faults.iter().any(|fault| fault.contains("making and breaking contact")));
    }
}

/// Too slow to be visible in the run; detected by its eigenvalue.
#[test]
fn a_loop_that_has_hardly_begun_to_grow_is_not_stable() {
    let slow = "wave.form=implicit hand.damping_n_s_per_m=0.5 slave.device.damping_n_s_per_m=2 \
    link.forward_delay_ticks=50 \
                link.backward_delay_ticks=49 master.time_delay_ticks=0 slave.time_delay_ticks=0 duration_s=0.5";
    let outcome = outcome(slow);
    assert!(!outcome.stable && outcome.limit_cycles.is_empty());
    let free = outcome.loops.iter().find(|one| one.held == LoopCondition::Free).unwrap();
    assert!((free.growth_per_tick.unwrap() - 1.000_283).abs() < 1e-5, "{free:?}");
    let says = |part: &str| outcome.faults.iter().any(|fault| fault.contains(part));
    assert!(
        says("the loop (free) is unstable: disturbances grow by a factor of 1.0002")
            && says(
                "double in \
    2.4"
            ),
        "{:?}",
        outcome.faults
    );
}

/// The same loops with a damped wall or a more damped hand come to rest; so does the shipped loop.
#[test]
fn a_contact_that_comes_to_rest_is_stable_and_has_no_limit_cycle() {
    for settings in [
        "dof=1",
        &WEAK.replace("wall.damping_n_s_per_m=0", "wall.damping_n_s_per_m=20"),
        "dof=1 environment=spring",
    ] {
        let outcome = outcome(settings);
        assert!(outcome.stable && outcome.limit_cycles.is_empty(), "{settings}: {:?}", outcome.limit_cycles);
    }
}

/// In the shipped scenario, controllers and line are passive. With little damping and a delay they are
/// active, although the line's own account stays at 0 by definition.
#[test]
fn the_energy_at_the_robots_tells_an_active_loop_from_a_passive_one() {
    let passive = outcome("dof=1");
    assert!(passive.energy_ports_min_j.unwrap() >= 0.0);
    let active = outcome(&format!(
        "{WEAK} link.forward_delay_ticks=13 link.backward_delay_ticks=12 slave.device.mass_kg=0.05"
    ));
    assert!(active.energy_ports_min_j.unwrap() < -1e-3, "{:?}", active.energy_ports_min_j);
    assert!(active.energy_min_j.unwrap() >= 0.0);
}
