//! Dry friction sticks and reverses; bristles bend, break away and slide.

use super::*;

const INERTIA: f64 = 0.5;
const COULOMB: f64 = 2.0;

fn rubbing(friction: FrictionParameters) -> Joint {
    JointParameters { friction, ..JointParameters::of_inertia(INERTIA) }.build().unwrap()
}

fn dry() -> FrictionParameters {
    FrictionParameters { coulomb: COULOMB, ..FrictionParameters::default() }
}

/// `v²/(2 Fc/J)` to a stop, and not a step further, whatever pushes less than `Fc`.
#[test]
fn dry_friction_stops_a_load_within_its_stopping_distance_and_holds_it() {
    let mut joint = rubbing(dry());
    hold(&mut joint, 500, 5.0, |_, _| {});
    let start = joint.state();
    close(start.velocity, (5.0 - COULOMB) / INERTIA * 0.5, 1e-11);
    hold(&mut joint, 1000, 0.0, |_, _| {});
    let stopped = joint.state();
    let distance = start.velocity * start.velocity / (2.0 * COULOMB / INERTIA);
    println!("stopping distance: off by {:.1e} rad", (stopped.position - start.position - distance).abs());
    close(stopped.position - start.position, distance, 1e-10);
    for command in [1.99, -1.99, 0.0] {
        hold(&mut joint, 500, command, |_, state| {
            close(state.velocity, 0.0, 0.0);
            close(state.position, stopped.position, 0.0);
        });
    }
    hold(&mut joint, 100, -2.1, |_, _| {});
    close(joint.state().velocity, -0.1 / INERTIA * 0.1, 1e-12);
}

/// Thrown against a force above `Fc` it returns, slower than it left: `(F + Fc)/J` on the way out, `(F - Fc)/J` back.
#[test]
fn dry_friction_reverses_with_the_motion() {
    let mut joint = rubbing(dry());
    hold(&mut joint, 300, 8.0, |_, _| {});
    let start = joint.state();
    let (out, back) = ((5.0 + COULOMB) / INERTIA, (5.0 - COULOMB) / INERTIA);
    let turn_s = start.velocity / out;
    let furthest = start.position + 0.5 * start.velocity * turn_s;
    let mut position = Worst::default();
    hold(&mut joint, 1000, -5.0, |t, state| {
        let expected = if t < turn_s {
            start.position + start.velocity * t - 0.5 * out * t * t
        } else {
            furthest - 0.5 * back * (t - turn_s) * (t - turn_s)
        };
        position.see(state.position, expected);
    });
    position.below("thrown and returned, rad", 1e-6);
}

/// It starts at `Fs` under a growing force, and then feels `Fc`.
#[test]
fn dry_friction_breaks_away_at_its_static_level() {
    let mut joint = rubbing(FrictionParameters { breakaway: 3.0, stribeck_velocity: 1e-4, ..dry() });
    let mut started_s = None;
    for tick in 0..400_u32 {
        let t = f64::from(tick) * PERIOD_S;
        joint.advance(t, PERIOD_S, 0.0, &|t| 10.0 * t);
        if joint.state().velocity > 0.0 && started_s.is_none() {
            started_s = Some(t + PERIOD_S);
        }
    }
    close(started_s.unwrap(), 0.3, 1.01e-3);
    // J v = ∫(10 t - Fc) from 0.3 to 0.4 s, less the dip's share.
    close(joint.state().velocity, (0.5 * 10.0 * (0.16 - 0.09) - 0.1 * COULOMB) / INERTIA, 5e-3);
}

/// `LuGre` of the paper, in `N` and `m`: `σ0 = 1e5`, `σ1 = sqrt(1e5)`, `σ2 = 0.4`, `Fc = 1`, `Fs = 1.5`, `vs = 1e-3`.
fn bristles() -> FrictionParameters {
    FrictionParameters {
        coulomb: 1.0,
        breakaway: 1.5,
        stribeck_velocity: 1e-3,
        viscous: 0.4,
        presliding_stiffness: 1e5,
        presliding_damping: 1e5_f64.sqrt(),
    }
}

/// Pulled slowly, bristles bend by `x = -Fs/σ0 ln(1 - F/Fs)`: from `z' = v (1 - σ0 z/g)`, `F = σ0 z`, `g = Fs`.
#[test]
fn bristles_bend_before_they_slide() {
    let mut joint =
        JointParameters { friction: bristles(), ..JointParameters::of_inertia(1.0) }.build().unwrap();
    let mut bent = Worst::default();
    for tick in 0..2000_u32 {
        let t = f64::from(tick) * PERIOD_S;
        joint.advance(t, PERIOD_S, 0.0, &|t| 0.5 * t);
        let force = 0.5 * (t + PERIOD_S);
        bent.see(joint.state().position, -1.5e-5 * libm::log(1.0 - force / 1.5));
    }
    bent.below("presliding of up to 1.6e-5 m", 1e-7);
}

/// The slower the force grows, the nearer to `Fs` it slides off; steady sliding follows `Fc + σ2 v`.
#[test]
fn bristles_break_away_at_the_static_level_and_slide_on_the_steady_curve() {
    let parameters = JointParameters { friction: bristles(), ..JointParameters::of_inertia(1.0) };
    let breakaway = |growth: f64| {
        let mut joint = parameters.build().unwrap();
        let mut t = 0.0;
        while joint.state().velocity < 1e-3 {
            joint.advance(t, PERIOD_S, 0.0, &|t| growth * t);
            t += PERIOD_S;
        }
        growth * t
    };
    let (fast, medium, slow) = (breakaway(5.0), breakaway(0.5), breakaway(0.05));
    println!("break-away at {fast:.4}, {medium:.4}, {slow:.4} N of 1.5 N");
    assert!(fast < medium && medium < slow, "{fast} {medium} {slow}");
    close(slow, 1.5, 0.015);

    let mut joint = parameters.build().unwrap();
    let mut speed = Worst::default();
    for tick in 0..40_000_u32 {
        joint.advance(f64::from(tick) * PERIOD_S, PERIOD_S, 2.0, &|_| 0.0);
    }
    speed.see(joint.state().velocity, (2.0 - 1.0) / 0.4);
    speed.below("steady sliding, m/s", 1e-5);
}

/// On a spring, each half swing is `2 Fc/K` shorter, until the spring is too weak to break loose.
#[test]
fn dry_friction_shortens_each_swing_by_the_same_amount() {
    let mut parameters = JointParameters::of_inertia(0.1);
    (parameters.load.stiffness, parameters.load.start_position) = (100.0, 0.0525);
    parameters.friction.coulomb = 0.5;
    let mut joint = parameters.build().unwrap();
    let half_swing_s = core::f64::consts::PI * (0.1_f64 / 100.0).sqrt();
    for swing in 1..=10_u32 {
        for _ in 0..100 {
            joint.advance(0.0, half_swing_s / 100.0, 0.0, &|_| 0.0);
        }
        let turning = (0.0525 - 0.01 * f64::from(swing)).abs().max(0.0025);
        if swing <= 5 {
            close(joint.position().abs(), turning, 1e-9);
        }
    }
    let rest = joint.position();
    close(rest, -0.0025, 1e-9);
    hold(&mut joint, 10, 0.0, |_, state| assert_eq!(state.position.to_bits(), rest.to_bits()));
}
