//! Collects the steps of one tick of a controller, for the Data Base timeline.

use dimsart_core::{Direction, Endpoint, Engine, Finding, Stage, Step};

use crate::report::{TickMap, TypeRow};
use hil_sim::rig::Rig;

/// Returns the maps of all controllers of a rig.
#[must_use]
pub fn tick_maps(rig: &Rig) -> Vec<TickMap> {
    rig.stations().iter().map(|station| tick_map(&station.name, station.dimsart.engine())).collect()
}

/// Returns the map of a controller's tick: the frame writes, the modules compute, the frame reads.
#[must_use]
pub fn tick_map(name: &str, engine: &Engine) -> TickMap {
    let steps: Vec<Step> = engine.steps().collect();
    let has_late =
        |step: &Step| steps.iter().any(|other| other.module == step.module && other.stage == Stage::Late);
    let label = |step: &Step| {
        let module = engine.kinds().module_name(step.module);
        match (step.stage, has_late(step)) {
            (Stage::Early, false) => module.to_string(),
            (Stage::Early, true) => format!("{module} early"),
            (Stage::Late, _) => format!("{module} late"),
        }
    };
    let first = "frame writes".to_owned();
    let last = "frame reads".to_owned();
    let labels = std::iter::once(first).chain(steps.iter().map(label)).chain(std::iter::once(last)).collect();
    let report = engine.check();
    let types = engine.data_base().signals().map(|(_, entry)| {
        let device = engine.device();
        let is_frame = |types: &[&dimsart_core::DataType]| {
            types.iter().any(|data_type| data_type.first() == entry.signal)
        };
        let users = |direction| {
            let uses = (1..).zip(&steps).filter(move |(_, step)| {
                engine.step_signals(**step).any(|found| found == (entry.signal, direction))
            });
            uses.map(|(place, _)| place)
        };
        let writer =
            if is_frame(device.outputs) { Some(0) } else { users(Direction::Write).next() };
        let is_late = |place: &usize| {
            report.findings().iter().any(|finding| {
                let step = place.checked_sub(1).and_then(|index| steps.get(index));
                matches!((finding, step), (Finding::Delay { signal, reader: Endpoint::Module(reader), .. }, Some(step))
                    if *signal == entry.signal && *reader == step.module)
            })
        };
        let frame_reads = is_frame(device.inputs).then_some(steps.len() + 1);
        let (delayed_readers, readers) = users(Direction::Read).chain(frame_reads).partition(is_late);
        TypeRow {
            name: device.signal_name(entry.signal).to_string(),
            unit: entry.data_type.unit.symbol(device.axes().first().copied().unwrap_or_default()).to_owned(),
            writer,
            readers,
            delayed_readers,
        }
    });
    TickMap { title: name.to_owned(), steps: labels, types: types.collect() }
}
