//! What a tick can execute, by its bound, against what is found of it without following any value: the calls that
//! `boards/calls.txt` declares are all there are.

use std::collections::BTreeSet;

use boards::catalogue::CALLS;
use cycles::declared::{Declared, Name};
use cycles::reach;
use cycles::timing::{Column, Profile, Timing};
use hil_sim::cycles::Steady;
use hil_sim::experiment::Experiment;
use hil_sim::scenario::Scenario;

use crate::common::firmware;
use crate::kinds::EVERY_MODULE;

/// A piece of other functions, which the compiler has put apart.
const PIECE: &str = "OUTLINED_FUNCTION";

#[test]
fn every_function_that_a_tick_can_execute_is_looked_through_for_panics() {
    let Some(firmware) = firmware() else { return };
    let both = ["master", "slave"].map(|side| format!("{side}.scheme={EVERY_MODULE}"));
    let mut experiment = Experiment::new(&Scenario::load(None, &both).unwrap()).unwrap();
    let master = &mut experiment.rig_mut().stations_mut()[0].dimsart;
    let timing = Timing::new(Profile::ZeroWait, Column::Upper);
    let steady = Steady::of(&firmware, timing, master).unwrap();
    let name = |address: &u32| firmware.image.place(firmware.image.function_at(*address).unwrap().address);
    let executed: BTreeSet<String> = steady.visited.iter().map(name).collect();

    let declared = Declared::read(CALLS).unwrap();
    let reached = reach::only(&firmware.image, &declared, "dimsart_tick", &[Name::new("*")]).unwrap();
    let unseen: Vec<&String> = executed
        .iter()
        .filter(|name| !name.starts_with(PIECE) && !reached.functions.contains(*name))
        .collect();
    assert!(unseen.is_empty(), "{unseen:?} of {executed:?}");
    assert!(executed.len() > 16, "{executed:?}");
}
