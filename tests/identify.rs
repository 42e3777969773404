//! Identification compared with other implementations: scipy's frequency response (`welch`, `csd`,
//! `coherence`), and a joint with a closed-form motion.
//!
//! `cargo xtask test` writes the case (`tests/oracle/identify.py`) and sets `DIMSART_ORACLE` to its folder.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use hil_sim::identify::{Experiment, ForceTiming, frequency_response, identify};
use serde::Deserialize;

#[derive(Deserialize)]
struct Reference {
    tick_s: f64,
    response: Response,
    joint: Joint,
}

#[derive(Deserialize)]
struct Response {
    segment: usize,
    input: Vec<f64>,
    output: Vec<f64>,
    frequency_hz: Vec<f64>,
    real: Vec<f64>,
    imaginary: Vec<f64>,
    coherence: Vec<f64>,
}

#[derive(Deserialize)]
struct Joint {
    position: Vec<f64>,
    force: Vec<f64>,
    truth: Vec<f64>,
}

fn reference() -> Option<Reference> {
    let folder = test_requirements::reference_runs("scipy")?;
    let text = std::fs::read_to_string(folder.join("identify.json")).unwrap();
    Some(serde_json::from_str(&text).unwrap())
}

#[test]
fn the_frequency_response_is_the_one_that_scipy_finds() {
    let Some(Reference { tick_s, response, .. }) = reference() else { return };
    let Response { segment, input, output, frequency_hz, real, imaginary, coherence } = response;
    let found = frequency_response(tick_s, &input, &output, segment, 200).unwrap();
    assert!(found.len() > 100);
    for point in found {
        let bin = frequency_hz.iter().position(|known| (known - point.frequency_hz).abs() < 1e-6).unwrap();
        let expected = real[bin].hypot(imaginary[bin]);
        assert!((point.gain / expected - 1.0).abs() < 1e-9, "{point:?} instead of {expected}");
        // Distance of two complex numbers of the same magnitude.
        let apart = (point.gain * point.phase_rad.cos() - real[bin])
            .hypot(point.gain * point.phase_rad.sin() - imaginary[bin]);
        assert!(apart < 1e-9 * expected.max(1e-6), "{point:?}");
        assert!((point.coherence - coherence[bin]).abs() < 1e-9, "{point:?} instead of {}", coherence[bin]);
    }
}

#[test]
fn a_joint_in_closed_form_has_what_was_put_in() {
    let Some(Reference { tick_s, joint, .. }) = reference() else { return };
    let Joint { position, force, truth } = &joint;
    let force_timing = ForceTiming::Measured;
    let experiment = Experiment { period_s: tick_s, position, force, force_timing, turns: true, others: &[] };
    let found = identify(&experiment).unwrap();
    for (estimate, truth) in found.estimates.iter().zip(truth) {
        let (value, _) = estimate.value.unwrap();
        assert!((value / truth - 1.0).abs() < 1e-5, "{estimate:?} instead of {truth}");
    }
}
