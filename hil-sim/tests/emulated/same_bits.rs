//! The firmware computes the bits that the host computes.

use std::collections::BTreeSet;

use dimsart_core::modules::Standard;
use dimsart_core::{ModuleList, Tick};
use hil_sim::experiment::{Experiment, Side};
use hil_sim::rig::{Rig, Station};
use hil_sim::scenario::Scenario;

use crate::common::image;

const TICKS: u64 = 100_000;
const EVERY_MODULE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/emulated/every_module.scheme");

#[test]
fn table_1_on_both_sides() {
    // Packets that are late and lost keep every signal moving to the end.
    compare(["link.jitter_ticks=2", "link.loss=0.02"]);
}

#[test]
fn every_module_on_both_sides() {
    let [master, slave] = ["master", "slave"].map(|side| format!("{side}.scheme={EVERY_MODULE}"));
    let rig = compare([&master, &slave, "link.loss=0.02"]);
    for station in rig.iter().flat_map(Rig::stations) {
        let kinds: BTreeSet<u8> = station.dimsart.engine().steps().map(|step| step.module.kind).collect();
        assert_eq!(kinds.len(), Standard::KINDS.len());
    }
}

/// Steps a rig whose controllers run here and one whose controllers run on boards; gives the latter one.
fn compare<const COUNT: usize>(settings: [&str; COUNT]) -> Option<Rig> {
    let image = image()?;
    let scenario = Scenario::load(None, &settings.map(str::to_owned)).unwrap();
    let [mut here, mut there] = [(); 2].map(|()| Experiment::new(&scenario).unwrap());
    for side in [Side::Master, Side::Slave] {
        there.emulate(side, &image, None).unwrap();
    }
    let (here, mut there) = (here.rig_mut(), std::mem::replace(there.rig_mut(), Rig::new(1.0)));
    let (mut changed_ticks, mut last) = ([0; 2], [Vec::new(), Vec::new()]);
    for tick in 0..TICKS {
        here.tick();
        there.tick();
        if let Some((side, trouble)) = there.trouble() {
            panic!("{side} in tick {tick}: {trouble}");
        }
        for (side, (here, there)) in here.stations().iter().zip(there.stations()).enumerate() {
            assert_eq!(there.last_tick, Tick::Ran);
            let [expected, found] = [here, there].map(signals);
            if expected != found {
                let differing = expected.iter().zip(&found).filter(|(one, other)| one != other);
                panic!("{} in tick {tick}: {:x?}", here.name, differing.collect::<Vec<_>>());
            }
            changed_ticks[side] += u64::from(found != last[side]);
            last[side] = found;
        }
        here.advance();
        there.advance();
    }
    assert!(changed_ticks.iter().all(|ticks| *ticks > TICKS / 2), "signals stood still: {changed_ticks:?}");
    Some(there)
}

/// Every word of the Data Base, with the name of its signal.
fn signals(station: &Station) -> Vec<(u16, u8, u32)> {
    let data_base = station.dimsart.engine().data_base();
    let named = data_base.signals().flat_map(|(slot, entry)| {
        data_base.words(slot).iter().map(move |word| (entry.signal.id, entry.signal.number, *word))
    });
    named.collect()
}
