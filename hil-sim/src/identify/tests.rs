//! Identification against what was put in, and against experiments that cannot say.

use super::*;

const PERIOD_S: f64 = 1e-3;

/// A joint in fine steps under a force that is held for a tick each, and a spring that keeps it in place.
fn joint(seconds: u32, drive: impl Fn(f64) -> f64, truth: [f64; 6]) -> (Vec<f64>, Vec<f64>) {
    let [inertia, viscous, coulomb, sine, cosine, constant] = truth;
    let (mut q, mut v) = (0.0_f64, 0.0_f64);
    let (mut positions, mut forces) = (Vec::new(), Vec::new());
    for tick in 0..seconds * 1000 {
        let force = drive(f64::from(tick) * PERIOD_S) - 20.0 * q;
        positions.push(q);
        forces.push(force);
        for _ in 0..100 {
            let known = force - viscous * v - sine * q.sin() - cosine * q.cos() - constant;
            let rub = if v.abs() > 1e-6 { coulomb * v.signum() } else { known.clamp(-coulomb, coulomb) };
            v += (known - rub) / inertia * PERIOD_S / 100.0;
            q += v * PERIOD_S / 100.0;
        }
    }
    (positions, forces)
}

fn chirp(amplitude: f64) -> impl Fn(f64) -> f64 {
    move |t| amplitude * (std::f64::consts::TAU * (0.3 * t + 0.06 * t * t)).sin()
}

fn held<'a>(position: &'a [f64], force: &'a [f64]) -> Experiment<'a> {
    let force_timing = ForceTiming::Held { delay_ticks: 0.0 };
    Experiment { period_s: PERIOD_S, position, force, force_timing, turns: true, others: &[] }
}

#[test]
fn what_was_put_in_is_found_within_two_percent_and_inside_its_interval() {
    let truth = [0.08, 0.3, 0.4, 2.0, 0.7, 0.2];
    let (position, force) = joint(20, chirp(12.0), truth);
    let found = identify(&held(&position, &force)).unwrap();
    for (estimate, truth) in found.estimates.iter().zip(truth) {
        let (value, half_width) = estimate.value.unwrap();
        assert!((value - truth).abs() < 0.02 * truth, "{estimate:?} instead of {truth}");
        assert!(half_width < 0.05 * truth, "{estimate:?}");
    }
}

#[test]
fn a_joint_that_hardly_turns_does_not_say_how_it_hangs() {
    let truth = [0.08, 0.3, 0.02, 0.0, 0.7, 0.2];
    let (position, force) = joint(20, chirp(0.3), truth);
    let found = identify(&held(&position, &force)).unwrap();
    assert!(
        found.of(Quantity::WeightCosine).is_none() && found.of(Quantity::Constant).is_none(),
        "{found:?}"
    );
    let (inertia, _) = found.of(Quantity::Inertia).unwrap();
    assert!((inertia / 0.08 - 1.0).abs() < 0.02, "{inertia}");
}

#[test]
fn a_joint_that_turns_one_way_does_not_tell_coulomb_friction_from_a_constant_force() {
    let [inertia, viscous, coulomb, constant] = [0.08, 0.3, 0.4, 0.2];
    // At 3 rad/s, and faster and slower around that from 0.3 to 2.7 Hz.
    let phase = |t: f64| std::f64::consts::TAU * (0.3 * t + 0.06 * t * t);
    let rate = |t: f64| std::f64::consts::TAU * (0.3 + 0.12 * t);
    let times: Vec<f64> = (0..20_000).map(|tick| f64::from(tick) * PERIOD_S).collect();
    let speed = |t: f64| 3.0 + phase(t).sin();
    let mut position = vec![0.0];
    for pair in times.windows(2) {
        // Simpson's rule.
        let [begin, end] = [pair[0], pair[1]];
        let moved = (speed(begin) + 4.0 * speed(0.5 * (begin + end)) + speed(end)) * PERIOD_S / 6.0;
        position.push(position.last().unwrap() + moved);
    }
    let force_at = |t: &f64| inertia * phase(*t).cos() * rate(*t) + viscous * speed(*t) + coulomb + constant;
    let force: Vec<f64> = times.iter().map(force_at).collect();
    let found =
        identify(&Experiment { force_timing: ForceTiming::Measured, ..held(&position, &force) }).unwrap();
    assert_eq!([Quantity::Coulomb, Quantity::Constant].map(|quantity| found.of(quantity)), [None; 2]);
    for (quantity, truth) in [(Quantity::Inertia, inertia), (Quantity::Viscous, viscous)] {
        let (value, half_width) = found.of(quantity).unwrap();
        assert!((value - truth).abs() < 0.01 * truth && half_width < 0.01 * truth, "{found:?}");
    }
}

#[test]
fn experiments_that_cannot_say_are_refused() {
    let still = vec![0.3; 5000];
    let (position, force) = joint(20, chirp(12.0), [0.08, 0.3, 0.4, 2.0, 0.7, 0.2]);
    assert_eq!(identify(&held(&still, &force)), Err(IdentifyError::NotExcited));
    assert_eq!(identify(&held(&position, &still)), Err(IdentifyError::NotExcited));
    let short = identify(&held(&position[..800], &force[..800]));
    assert!(matches!(short, Err(IdentifyError::TooShort { needed: 35, .. })), "{short:?}");
    let mut damaged = position.clone();
    damaged[77] = f64::NAN;
    assert_eq!(identify(&held(&damaged, &force)), Err(IdentifyError::NotFinite { tick: 77 }));
    // The force of another joint.
    let (_, other) = joint(20, |t| 12.0 * (3.0 * t).sin(), [0.08, 0.3, 0.4, 2.0, 0.7, 0.2]);
    let wrong = identify(&held(&position, &other));
    assert!(
        matches!(wrong, Err(IdentifyError::Unexplained { unexplained }) if unexplained > 0.1),
        "{wrong:?}"
    );
}

#[test]
fn the_response_of_a_filter_is_its_own() {
    // A maximum-length sequence through y += 0.1 (u - y).
    let (mut register, mut y) = (1_u32, 0.0);
    let (mut input, mut output) = (Vec::new(), Vec::new());
    for _ in 0..32_768 {
        register = (register << 1 | (register >> 14 ^ register >> 13) & 1) & 0x7FFF;
        let u = if register & 1 == 1 { 1.0 } else { -1.0 };
        y += 0.1 * (u - y);
        input.push(u);
        output.push(y);
    }
    let found = frequency_response(PERIOD_S, &input, &output, 2048, 40).unwrap();
    for point in found.iter().filter(|point| point.frequency_hz > 2.0) {
        let angle = std::f64::consts::TAU * point.frequency_hz * PERIOD_S;
        // 0.1 / (1 - 0.9 e^-jw)
        let (real, imaginary) = (1.0 - 0.9 * angle.cos(), 0.9 * angle.sin());
        let gain = 0.1 / real.hypot(imaginary);
        assert!((point.gain / gain - 1.0).abs() < 0.02, "{point:?} instead of {gain}");
        assert!((point.phase_rad + imaginary.atan2(real)).abs() < 0.02, "{point:?}");
        assert!(point.coherence > 0.99, "{point:?}");
    }
    assert!(frequency_response(PERIOD_S, &input[..4000], &output[..4000], 2048, 40).is_err());
}
