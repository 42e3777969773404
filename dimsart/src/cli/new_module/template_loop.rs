//! Template: compares the law, and the step response of its loop, with closed forms.

use hil_sim::experiment::{self, Run};
use hil_sim::rig_file::RigFile;

/// Values of schemes/template.scheme and scenarios/template.toml.
const STIFFNESS: f64 = 50.0;
const INERTIA: f64 = 0.02;
const DAMPING: f64 = 1.0;
const PERIOD_S: f64 = 1e-3;

fn run() -> Run {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios/template.toml");
    let mut rig = RigFile::load(path.as_ref(), &[]).unwrap();
    rig.kinds = dimsart_core::join_kinds![dimsart_modules::ALL, laws::modules::OWN];
    let run = experiment::run(&rig).unwrap();
    assert!(run.outcome.stable, "{:?}", run.outcome.faults);
    run
}

#[test]
fn the_force_is_that_of_the_law() {
    let run = run();
    let recorded = |signal| {
        let column = run.recording.find("joint", signal, Some(0)).unwrap();
        run.recording.column(column).collect::<Vec<f64>>()
    };
    let (force, desired, position) = (recorded("DES_FORCE"), recorded("DES_POSITION"), recorded("POSITION"));
    for tick in 0..force.len() {
        let expected = STIFFNESS * (desired[tick] - position[tick]);
        assert!((force[tick] - expected).abs() < 1e-4, "{} instead of {expected} N m", force[tick]);
    }
}

/// `J x'' + B x' + K x = K x_d`. Holding the force for a tick delays it by half a tick, which reduces the damping by `K h/2`.
#[test]
fn a_step_overshoots_as_one_of_second_order() {
    let damping = DAMPING - 0.5 * STIFFNESS * PERIOD_S;
    let ratio = 0.5 * damping / (STIFFNESS * INERTIA).sqrt();
    let expected = (-std::f64::consts::PI * ratio / (1.0 - ratio * ratio).sqrt()).exp();
    let overshoot = run().outcome.axes[0].following.unwrap().overshoot.unwrap();
    assert!((overshoot - expected).abs() < 1e-3, "{overshoot} instead of {expected}");
}
