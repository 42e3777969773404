//! What comes back from a stop.

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
