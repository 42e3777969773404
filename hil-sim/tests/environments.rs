//! Environments of a scenario's slave.
#![expect(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use std::sync::atomic::AtomicBool;

use hil_sim::experiment::{Experiment, Run};
use hil_sim::rig_file::RigFile;

fn run(settings: &[&str]) -> Run {
    let settings: Vec<String> = settings.iter().map(ToString::to_string).collect();
    let scenario = RigFile::from_shipped("bilateral", &settings).unwrap();
    let run = Experiment::new(&scenario).unwrap().run(&AtomicBool::new(false), |_| {});
    assert!(run.outcome.stable, "{:?}", run.outcome.faults);
    run
}

/// A column of the world's truth on axis 0.
fn column(run: &Run, signal: &str) -> Vec<f64> {
    let index = run.recording.find("world", signal, Some(0)).unwrap();
    run.recording.column(index).collect()
}

#[test]
fn a_spring_is_perceived_both_ways_and_in_series_with_the_chain() {
    for stiffness_n_per_m in [200.0, 100.0] {
        let spring = format!("spring.stiffness_n_per_m={stiffness_n_per_m}");
        let run = run(&["environment=spring", &spring, "hand.contact_force_n=[0.5, -0.5]"]);
        let expected = 1.0 / (1.0 / 3000.0 + 0.022 / 20.0 + 1.0 / 5000.0 + 1.0 / stiffness_n_per_m);
        for axis in &run.outcome.axes[..2] {
            for found in
                [axis.contact.unwrap().k_perceived_n_per_m, axis.contact.unwrap().k_predicted_n_per_m]
            {
                assert!((found.unwrap() / expected - 1.0).abs() < 1e-4, "{found:?}, not {expected}");
            }
        }
        assert_eq!(
            run.outcome.axes[2].contact.unwrap().k_perceived_n_per_m,
            None,
            "nobody pushes the third axis"
        );
    }
}

#[test]
fn nothing_to_meet_is_free_motion_to_the_end() {
    let run = run(&["environment=nothing"]);
    assert!(run.outcome.axes.iter().all(|axis| axis.contact.unwrap().k_perceived_n_per_m.is_none()));
    assert!(run.outcome.axes.iter().all(|axis| axis.contact.unwrap().k_predicted_n_per_m.is_none()));
    assert!(column(&run, "slave.wall_force").iter().all(|force_n| force_n.abs() < 1e-12));
    let furthest_m = column(&run, "slave.position").into_iter().fold(0.0, f64::max);
    assert!((0.025..0.04).contains(&furthest_m), "the slave went {furthest_m} m");
}

/// A damper alone never comes to rest: there is no stiffness to feel.
#[test]
fn a_spring_without_stiffness_has_none_to_feel() {
    let run = run(&["environment=spring", "spring.stiffness_n_per_m=0"]);
    assert_eq!(run.outcome.k_perceived_n_per_m, [None; 3]);
    assert_eq!(run.outcome.k_predicted_n_per_m, [None; 3]);
}

#[test]
fn a_wall_can_stand_on_the_other_side() {
    let run =
        run(&["wall.solid=below", "wall.position_m=-0.05", "hand.contact_force_n=[-2.0, 0.0]", "dof=2"]);
    let expected = 1.0 / (1.0 / 3000.0 + 0.022 / 20.0 + 1.0 / 5000.0 + 1.0 / 1e4);
    let perceived = run.outcome.axes[0].contact.unwrap().k_perceived_n_per_m.unwrap();
    assert!((perceived / expected - 1.0).abs() < 1e-4, "{perceived}, not {expected}");
    assert_eq!(run.outcome.axes[1].contact.unwrap().k_perceived_n_per_m, None);
}
