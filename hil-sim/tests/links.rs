//! Table 1 over every carrier: what is felt is what is predicted for the measured round trip, and nothing makes energy.

#[path = "../examples/link_figures/cases.rs"]
mod cases;

use cases::{CASES, errors, off};

#[test]
fn every_carrier_is_perceived_as_predicted_and_passive() {
    for case in CASES {
        let name = format!("{}, {}", case.carrier, case.policy);
        let outcome = case.run().expect("sound cases");
        assert!(outcome.stable && outcome.faults.is_empty(), "{name}: {:?}", outcome.faults);
        assert_eq!(errors(&outcome) > 0, case.has_errors, "{name}: {:?}", outcome.media);
        let energy_j = outcome.energy_min_j.expect("waves");
        assert!(energy_j >= 0.0, "{name}: {energy_j} J");
        // Where motion gets lost the hand creeps, which is told, and there is no stiffness to predict.
        let creeps = outcome.warnings.iter().any(|warning| warning.contains("the hand creeps"));
        assert_eq!(creeps, !case.is_perceived, "{name}: {:?}", outcome.warnings);
        match off(&outcome) {
            Some(off) => assert!(case.is_perceived && off.abs() < 0.01, "{name}: {off}"),
            None => assert!(!case.is_perceived, "{name}: no contact"),
        }
    }
}
