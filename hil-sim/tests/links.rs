//! Table 1 over every carrier: what is felt is what is predicted for the measured round trip, and nothing makes energy.

#[path = "../examples/link_figures/cases.rs"]
mod cases;

use std::sync::atomic::AtomicBool;

use cases::{CASES, errors, off};
use hil_sim::experiment::Experiment;
use hil_sim::rig_file::RigFile;

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

/// Of a line with every fault: what was sent was used, lost or superseded, and what the signals count is what the report has.
#[test]
fn used_lost_superseded_and_refused_packets_add_up_to_the_signals_and_to_all_that_were_sent() {
    let settings = [
        "duration_s=3",
        "link.jitter_ticks=4",
        "link.loss=0.05",
        "link.duplication=0.05",
        "link.reordering=0.05",
        "record.signals=['master', 'slave']",
    ];
    let scenario = RigFile::from_shipped("bilateral", &settings.map(str::to_owned)).expect("sound settings");
    let run = Experiment::new(&scenario).expect("sound").run(&AtomicBool::new(false), |_| ());
    let outcome = &run.outcome;
    for received in &outcome.received {
        let column = |signal: &str| {
            let place = run.recording.find(&received.station, signal, None).expect("recorded");
            run.recording.column(place).collect::<Vec<f64>>()
        };
        let last = |signal: &str| column(signal).last().copied().expect("rows");
        let [lost, superseded, refused] =
            [received.lost, received.superseded, received.refused].map(f64::from);
        assert_eq!(last("LINK_LOST").to_bits(), (lost + superseded).to_bits(), "{received:?}");
        assert_eq!(last("LINK_REFUSED").to_bits(), (refused + superseded).to_bits(), "{received:?}");
        let used: f64 = column("LINK_AGE").iter().map(|age| f64::from(*age == 0.0)).sum();
        // Those on the way at the end, and lost ones behind the last that came, are not known to the receiver.
        let sent = 3000.0;
        let missing = sent - (used + lost + superseded);
        assert!(
            (0.0..30.0).contains(&missing),
            "{missing} of {sent} packets are not accounted for: {received:?}"
        );
        assert!(lost > 50.0 && superseded > 50.0 && refused > 50.0, "{received:?}");
    }
    let sums = outcome.received.iter().fold([0; 3], |[a, b, c], each| {
        [a + u64::from(each.lost), b + u64::from(each.superseded), c + u64::from(each.refused)]
    });
    assert_eq!([outcome.lost_packets, outcome.superseded_packets, outcome.refused_packets], sums);
}
