//! The firmware and the host compute the same bits.

use std::collections::BTreeSet;

use boards::BOARDS;
use dimsart_core::{KindId, TickResult, types};
use dimsart_modules::{ALL, group_of};
use hil_sim::emulated::BOARD;
use hil_sim::experiment::Experiment;
use hil_sim::rig::{Rig, Station};
use hil_sim::rig_file::RigFile;

use crate::common::image;
use test_requirements::length;

/// Full length of the longest comparison.
const TICKS: u64 = 100_000;
const EVERY_MODULE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/emulated/every_module.scheme");

#[test]
fn table_1_on_both_sides() {
    // Late and lost packets keep every signal changing to the end.
    compare(length(TICKS / 5, TICKS), ["link.jitter_ticks=2", "link.loss=0.02"]);
}

#[test]
fn packets_that_come_in_heaps() {
    let heaps =
        ["link.jitter_ticks=40", "link.duplication=0.8", "link.reordering=0.2", "link.timeout_ticks=100"];
    let ticks = length(TICKS / 20, TICKS / 5);
    let Some(rig) = compare(ticks, heaps) else { return };
    let replaced = |station: &Station| {
        let data_base = station.dimsart.engine().data_base();
        let counter = data_base.signals().find(|(_, entry)| entry.signal.id == types::LINK_REFUSED.id);
        data_base.words(counter.unwrap().0)[0]
    };
    // Of 1.8 packets per tick, all but the newest of each tick are superseded.
    assert!(
        rig.stations().iter().map(replaced).all(|count| u64::from(count) > ticks),
        "few packets arrived in \
    the same tick"
    );
}

#[test]
fn more_packets_than_a_tick_takes_are_an_error_that_says_so() {
    let Some(image) = image() else { return };
    let scenario = RigFile::from_shipped("bilateral", &["link.jitter_ticks=1000".to_owned()]).unwrap();
    let mut experiment = Experiment::new(&scenario).unwrap();
    experiment.emulate("slave", &image, None).unwrap();
    let rig = experiment.rig_mut();
    let trouble = (0..TICKS).find_map(|_| {
        rig.step();
        rig.take_board_error()
    });
    let message = trouble.unwrap().1.to_string();
    assert!(message.contains("packets in one tick") && message.contains("jitter_ticks"), "{message}");
}

#[test]
fn every_module_on_both_sides() {
    let [master, slave] = ["master", "slave"].map(|side| format!("{side}.scheme={EVERY_MODULE}"));
    let rig = compare(length(TICKS / 5, TICKS), [&master, &slave, "link.loss=0.02"]);
    for station in rig.iter().flat_map(Rig::stations) {
        let kinds: BTreeSet<KindId> = station.dimsart.engine().steps().map(|step| step.module.kind).collect();
        let board = BOARDS.iter().find(|board| board.name == BOARD).unwrap();
        let there =
            ALL.list().iter().filter(|kind| group_of(kind.id).is_some_and(|group| board.has_group(group)));
        assert_eq!(kinds.len(), there.count());
    }
}

/// Steps a rig with controllers here and a rig with controllers on boards; returns the latter.
fn compare<const COUNT: usize>(ticks: u64, settings: [&str; COUNT]) -> Option<Rig> {
    let image = image()?;
    let scenario = RigFile::from_shipped("bilateral", &settings.map(str::to_owned)).unwrap();
    let [mut here, mut there] = [(); 2].map(|()| Experiment::new(&scenario).unwrap());
    for side in ["master", "slave"] {
        there.emulate(side, &image, None).unwrap();
    }
    let (here, mut there) = (here.rig_mut(), std::mem::replace(there.rig_mut(), Rig::new(1.0)));
    let (mut changed_ticks, mut last) = ([0; 2], [Vec::new(), Vec::new()]);
    for tick in 0..ticks {
        here.tick();
        there.tick();
        if let Some((side, trouble)) = there.take_board_error() {
            panic!("{side} in tick {tick}: {trouble}");
        }
        for (side, (here, there)) in here.stations().iter().zip(there.stations()).enumerate() {
            assert_eq!(there.last_tick, TickResult::Ran);
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
    assert!(
        changed_ticks.iter().all(|changed| *changed > ticks / 2),
        "signals without change: {changed_ticks:?}"
    );
    Some(there)
}

/// Returns every word of the Data Base with the name of its signal.
pub(crate) fn signals(station: &Station) -> Vec<(u16, u8, u32)> {
    let data_base = station.dimsart.engine().data_base();
    let named = data_base.signals().flat_map(|(slot, entry)| {
        data_base.words(slot).iter().map(move |word| (entry.signal.id, entry.signal.number, *word))
    });
    named.collect()
}
