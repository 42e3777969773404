//! How soon faults are noticed in the shipped scheme: the table of docs/fault-latency.md, and what it must say.
use std::sync::LazyLock;

use crate::fault_table::{Row, TRIES, forces_without_a_fault, markdown, rows};
use dimsart_core::types;
use hil_sim::experiment::Experiment;
use hil_sim::rig::Probe;
use hil_sim::rig_file::RigFile;

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/fault-latency.md");
/// When set in the environment, the page's table is written instead of compared.
const WRITE: &str = "DIMSART_WRITE_FAULTS";

static ROWS: LazyLock<Vec<Row>> = LazyLock::new(|| rows().unwrap());

/// The rows whose fault begins so; there are some.
fn those(name: &str) -> Vec<&'static Row> {
    let found: Vec<_> = ROWS.iter().filter(|row| row.fault.starts_with(name)).collect();
    assert!(!found.is_empty(), "{name}");
    found
}

/// Every try of a fault was noticed by this number, within these ticks.
fn assert_noticed(name: &str, number: u8, [least, most]: [u32; 2], ended_by: &str) {
    for row in those(name) {
        let is_in_time = |after: &Option<u32>| after.is_some_and(|after| (least..=most).contains(&after));
        assert!(row.noticed.0.iter().all(is_in_time), "{}: {}", row.fault, row.noticed);
        assert_eq!(row.reasons.iter().collect::<Vec<_>>(), [&number], "{}", row.fault);
        assert_eq!(row.ended_by.iter().collect::<Vec<_>>(), [&ended_by], "{}", row.fault);
        let (held_back, noticed) = (&row.held_back, &row.noticed);
        assert!(number == 131 && *held_back == never() || held_back == noticed, "{}: {held_back}", row.fault);
    }
}

fn never() -> crate::fault_table::After {
    crate::fault_table::After(vec![None; TRIES as usize])
}

#[test]
fn the_page_has_the_table_as_it_is() {
    let page = std::fs::read_to_string(PAGE).unwrap();
    let (text, table) = page.split_at(page.find("| Fault |").unwrap());
    let found = markdown(&ROWS);
    if std::env::var_os(WRITE).is_some() {
        std::fs::write(PAGE, text.to_owned() + &found).unwrap();
        return;
    }
    let missing: Vec<_> = found.lines().filter(|row| !table.lines().any(|line| line == *row)).collect();
    assert!(missing.is_empty(), "{PAGE} lacks rows, write it with {WRITE}=1:\n{}", missing.join("\n"));
    assert_eq!(table.lines().count(), found.lines().count(), "{PAGE} has a row for an unknown fault");
}

#[test]
fn what_must_be_noticed_is_noticed_in_time_and_told_by_its_number() {
    assert_noticed("a sensor outputs NaN", 32, [0, 0], "reset and lease");
    assert_noticed("a sensor outputs infinity", 32, [0, 0], "reset and lease");
    assert_noticed("the sensor frame", 32, [0, 0], "reset and lease");
    assert_noticed("a sensor outputs 1", 32, [0, 0], "reset and lease");
    assert_noticed("a sensor jumps by 10 mm", 32, [0, 0], "reset and lease");
    assert_noticed("a sensor jumps by 1000 mm", 32, [0, 0], "reset and lease");
    assert_noticed("a module upstream of the device writes", 40, [0, 0], "reset and lease");
    assert_noticed("a module without effect on the device writes", 131, [0, 0], "reset");
    for percent in [30, 50, 100, 500] {
        let takes = format!("exceeds its cost by {percent} %");
        assert_noticed(&format!("a module upstream of the device {takes}"), 40, [0, 0], "reset and lease");
        assert_noticed(&format!("a module without effect on the device {takes}"), 131, [0, 0], "reset");
    }
    for line in [
        "the link is silent for 20 ticks",
        "the link is permanently silent",
        "every packet is damaged",
        "the same packet arrives repeatedly",
    ] {
        assert_noticed(line, 48, [19, 19], "reset and lease");
    }
    // The lease lasts 200 ticks, and is renewed in every 50th.
    assert_noticed("the lease is not renewed", 16, [150, 199], "lease");
}

#[test]
fn what_nobody_can_know_is_said_to_be_never_noticed() {
    for name in
        ["no fault", "a sensor jumps by 1 mm", "a sensor is stuck", "a sensor drifts", "an actuator is stuck"]
    {
        those(name).into_iter().for_each(|row| assert_eq!(row.noticed, never(), "{}", row.fault));
    }
    // Within a quarter of its cost, as long as a link may be silent, and sound packets between damaged ones.
    for name in [
        "a module upstream of the device exceeds its cost by 10 %",
        "a module without effect on the device exceeds its cost by 10 %",
    ] {
        those(name).into_iter().for_each(|row| assert_eq!(row.noticed, never(), "{}", row.fault));
    }
    for name in ["the link is silent for 19 ticks", "every other packet is damaged"] {
        those(name).into_iter().for_each(|row| assert_eq!(row.noticed, never(), "{}", row.fault));
    }
}

/// Whoever sends nothing more is missed by the other side as a silent line is: 20 ticks and its delay of one, by the
/// order of the two within a tick.
#[test]
fn the_other_side_holds_back_when_nothing_comes_from_this_one() {
    let mut sent_nothing = 0;
    for row in ROWS.iter() {
        let stops_sending = row.reasons.iter().any(|number| [32, 40, 131].contains(number));
        sent_nothing += u32::from(stops_sending);
        let is_in_time = |after: &Option<u32>| after.is_some_and(|after| (19..=21).contains(&after));
        if stops_sending {
            assert!(row.other_held_back.0.iter().all(is_in_time), "{}: {}", row.fault, row.other_held_back);
        } else {
            assert_eq!(row.other_held_back, never(), "{}", row.fault);
        }
    }
    assert!(sent_nothing > 15, "{sent_nothing}");
}

#[test]
fn the_module_or_sensor_that_was_wrong_is_named() {
    for row in ROWS.iter() {
        assert_eq!(row.misnamed, 0, "{}: {:?}", row.fault, row.named);
        assert_eq!(row.noticed.0.len(), TRIES as usize);
    }
    assert_eq!(ROWS.iter().filter(|row| row.named.iter().any(|name| name.contains("MOD"))).count(), 16);
}

/// What can fail changes no bit of the shipped experiment while it does not.
#[test]
fn without_a_fault_the_forces_are_those_of_the_shipped_experiment_bit_for_bit() {
    let mut experiment = Experiment::new(&RigFile::from_shipped("bilateral", &[]).unwrap()).unwrap();
    let mut probe = Probe::new(types::DES_FORCE.first());
    for (tick, forces) in forces_without_a_fault(5_000).unwrap().iter().enumerate() {
        experiment.rig_mut().step();
        for (station, force_n) in experiment.rig_mut().stations().iter().zip(forces) {
            let bits: Vec<u32> = force_n.iter().map(|force_n| force_n.to_bits()).collect();
            assert_eq!(probe.words(station), bits, "tick {tick}, {}", station.name);
        }
    }
}
