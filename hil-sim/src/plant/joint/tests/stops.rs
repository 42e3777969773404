//! Rebound from a stop.

use super::*;

/// Velocity (per that of impact) with which a mass leaves a stop that cannot pull, at damping ratio `ζ`: where its
/// acceleration is 0 again.
fn rebound(damping_ratio: f64) -> f64 {
    let damped = (1.0 - damping_ratio * damping_ratio).sqrt();
    let angle = libm::atan2(2.0 * damping_ratio * damped, 2.0 * damping_ratio * damping_ratio - 1.0);
    let angle = if damping_ratio > 0.0 { angle } else { core::f64::consts::PI };
    libm::exp(-damping_ratio / damped * angle)
        * (libm::cos(angle) - damping_ratio / damped * libm::sin(angle))
}

#[test]
fn a_load_leaves_a_stop_as_fast_as_its_damping_lets_it() {
    let (inertia, stiffness) = (0.5_f64, 5e4_f64);
    for damping_ratio in [0.0, 0.1, 0.5, 0.9] {
        for direction in [1.0, -1.0] {
            let damping = 2.0 * damping_ratio * (inertia * stiffness).sqrt();
            let stops = StopsParameters { min: -0.1, max: 0.1, stiffness, damping };
            let mut joint = JointParameters { stops: Some(stops), ..JointParameters::of_inertia(inertia) }
                .build()
                .unwrap();
            hold(&mut joint, 100, direction, |_, _| {});
            let before = joint.state().velocity;
            let mut previous = before;
            hold(&mut joint, 700, 0.0, |_, state| {
                let gained = (state.velocity - previous) * direction;
                assert!(gained <= 1e-12, "the stop pulls: {state:?}");
                previous = state.velocity;
            });
            let share = joint.state().velocity / before;
            println!(
                "stop, ζ {damping_ratio}: {share:.8}, off by {:.1e}",
                (share - rebound(damping_ratio)).abs()
            );
            close(share, rebound(damping_ratio), 1e-5);
        }
    }
}

/// Throws 0.5 kg at 0.1 m/s against a stop at 0.05 m; the largest force of it, and the speed afterwards.
fn bounce(stiffness: f64, damping: f64) -> (f64, f64) {
    let stops = StopsParameters { max: 0.05, stiffness, damping, ..StopsParameters::default() };
    let mut joint =
        JointParameters { stops: Some(stops.clone()), ..JointParameters::of_inertia(0.5) }.build().unwrap();
    hold(&mut joint, 100, 0.5, |_, _| {});
    close(joint.state().velocity, 0.1, 1e-14);
    let mut largest: f64 = 0.0;
    hold(&mut joint, 2000, 0.0, |_, JointState { position, velocity, .. }| {
        let force = stops.force(stops.contact(position, velocity), position, velocity);
        assert!(force <= 0.0, "a stop does not pull");
        largest = largest.max(-force);
    });
    assert!(!joint.is_at_stop() && joint.position() < 0.05, "it came back");
    (largest, joint.state().velocity)
}

/// An undamped stop gives back all energy, whether it is soft or rigid; in between it stores it.
#[test]
fn an_undamped_stop_gives_back_what_it_takes() {
    for (stiffness, tolerance) in [(1e3, 1e-7), (1e4, 1e-7), (1e6, 1e-6), (1e9, 1e-5)] {
        let (largest, speed) = bounce(stiffness, 0.0);
        close(speed, -0.1, 0.1 * tolerance);
        if stiffness <= 1e4 {
            close(largest, 0.1 * (0.5 * stiffness).sqrt(), 0.01 * largest);
        }
    }
}

/// A damped stop keeps `∫ B v²`: the mass leaves where its acceleration is zero, at the closed form's speed there.
#[test]
fn a_damped_stop_keeps_what_it_dissipates() {
    for (stiffness, damping) in [(1e4, 10.0), (1e4, 80.0), (1e6, 200.0)] {
        let (_, speed) = bounce(stiffness, damping);
        let (natural, rate) = ((stiffness / 0.5_f64).sqrt(), damping);
        let damped = (natural * natural - rate * rate).sqrt();
        let angle = libm::atan2(2.0 * rate * damped, rate * rate - damped * damped);
        let decay = libm::exp(-rate * angle / damped);
        let exact = 0.1 * decay * (libm::cos(angle) - rate / damped * libm::sin(angle));
        // The damper jumps in at the surface, which is found within 49 ns.
        close(speed, exact, damping * 0.1 / 0.5 * 49e-9);
    }
}

#[test]
fn a_push_on_a_rigid_stop_settles() {
    let stops = StopsParameters { max: 0.001, stiffness: 1e9, ..StopsParameters::default() };
    let mut parameters = JointParameters { stops: Some(stops), ..JointParameters::of_inertia(0.5) };
    parameters.load.damping = 8.0;
    let mut joint = parameters.build().unwrap();
    hold(&mut joint, 6000, 2.0, |_, _| {});
    close(joint.position(), 0.001 + 2e-9, 1e-14);
    assert!(joint.is_at_stop());
}
