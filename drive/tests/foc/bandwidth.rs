//! Current response at standstill against the closed form of a sampled loop. Without dead time, which would change the loop where
//! reference and actual current differ in sign.
//!
//! The voltage of a sample acts in the period after it. With the motor's pole cancelled, each period adds `K = wc T` times the
//! error of the period before: `i[k+1] = i[k] + K (r[k-1] - i[k-1])`.

use core::f64::consts::TAU;

use hil_sim::plant::ThreePhaseParameters;

use crate::bench::{Bench, PERIOD_S, configuration, motor};

/// Loop gain `K`.
const PER_PERIOD: f64 = TAU * 1000.0 * PERIOD_S;

/// Returns the q-axis current in every period after a step of the reference to 1 A, `A`.
fn step_response(mut bench: Bench) -> Vec<f64> {
    let torque_nm = bench.configuration.motor.torque_constant_nm_per_a();
    bench.run(Some(0.0), 100);
    (0..400)
        .map(|_| {
            bench.step(Some(torque_nm));
            bench.motor.state().quadrature_a
        })
        .collect()
}

#[test]
fn a_step_is_followed_as_the_bandwidth_says_with_little_overshoot() {
    // The electrical time constant of the second motor is shorter than a period.
    for inductance_h in [3e-4, 1e-5] {
        follows_as_said(inductance_h);
    }
}

fn follows_as_said(inductance_h: f64) {
    let motor = ThreePhaseParameters {
        dead_time_share: 0.0,
        direct_inductance_h: inductance_h,
        quadrature_inductance_h: inductance_h,
        ..motor()
    };
    let response = step_response(Bench::new(&motor, configuration(&motor)).exact());
    let (mut expected, mut before) = (0.0, None);
    for (period, found) in response.iter().copied().enumerate() {
        let next = expected + before.map_or(0.0, |before: f64| PER_PERIOD * (1.0 - before));
        (before, expected) = (Some(expected), next);
        assert!((found - expected).abs() < 0.02, "period {period}: {found}, {expected} by the formula");
    }
    let most = response.iter().copied().fold(0.0, f64::max);
    assert!(most < 1.05, "{most}");
    let last = response.last().unwrap();
    assert!((last - 1.0).abs() < 1e-3, "{last}");
}

/// Returns the gain of the current loop at a frequency, `Hz`.
fn gain(bench: &mut Bench, frequency_hz: f64) -> f64 {
    let constant = f64::from(bench.configuration.motor.torque_constant_nm_per_a());
    // Whole sine periods in whole PWM periods.
    let periods = 20_000;
    let mut sums = (0.0, 0.0);
    for period in 0..2 * periods {
        let phase = TAU * frequency_hz * f64::from(period) * PERIOD_S;
        bench.step(Some((constant * phase.sin()) as f32));
        if period >= periods {
            let current_a = bench.motor.state().quadrature_a;
            sums = (sums.0 + current_a * phase.sin(), sums.1 + current_a * phase.cos());
        }
    }
    2.0 * sums.0.hypot(sums.1) / f64::from(periods)
}

#[test]
fn the_frequency_response_is_that_of_the_sampled_loop_and_wide_enough() {
    let motor = ThreePhaseParameters { dead_time_share: 0.0, ..motor() };
    let mut bench = Bench::new(&motor, configuration(&motor)).exact();
    for frequency_hz in [100.0, 300.0, 1000.0, 2000.0, 4000.0] {
        // |K / (z² - z + K)|.
        let (sin, cos) = (TAU * frequency_hz * PERIOD_S).sin_cos();
        let (real, imaginary) = (cos * cos - sin * sin - cos + PER_PERIOD, 2.0 * sin * cos - sin);
        let expected = PER_PERIOD / real.hypot(imaginary);
        let found = gain(&mut bench, frequency_hz);
        assert!(
            (found / expected - 1.0).abs() < 0.03,
            "{frequency_hz} Hz: {found}, {expected} by the formula"
        );
        assert!(found > 0.5_f64.sqrt() || frequency_hz > 1000.0, "{frequency_hz} Hz: {found}");
    }
}

#[test]
fn a_motor_that_is_known_to_thirty_percent_is_followed_without_ringing() {
    let motor = motor();
    for (resistance, inductance) in [(0.7, 0.7), (0.7, 1.3), (1.3, 0.7), (1.3, 1.3)] {
        let mut told = configuration(&motor);
        told.motor.resistance_ohm *= resistance;
        told.motor.direct_inductance_h *= inductance;
        told.motor.quadrature_inductance_h *= inductance;
        let response = step_response(Bench::new(&motor, told).exact());
        let most = response.iter().copied().fold(0.0, f64::max);
        assert!(most < 1.3, "R {resistance}, L {inductance}: {most}");
        let settled = response.iter().skip(60).all(|current_a| (current_a - 1.0).abs() < 0.1);
        assert!(settled, "R {resistance}, L {inductance}: {:?}", response.get(60..100));
        assert!((response.last().unwrap() - 1.0).abs() < 5e-3, "R {resistance}, L {inductance}");
    }
}
