//! Code that a tick can execute by its bound, compared with code found without following values: the calls declared in
//! `boards/calls.txt` are complete.

use std::collections::BTreeSet;

use boards::catalogue::INDIRECT_CALLS;
use cycles::declarations::{CallDeclarations, NamePattern};
use cycles::reachability;
use cycles::timing::{Column, Profile, Timing};
use dimsart::cycles::SteadyTick;
use hil_sim::experiment::Experiment;
use hil_sim::rig_file::RigFile;

use crate::common::{firmware_for_every_module, kinds};
use crate::kinds::EVERY_MODULE;

/// A part that the compiler has split from other functions.
const PIECE: &str = "OUTLINED_FUNCTION";

#[test]
fn every_function_that_a_tick_can_execute_is_looked_through_for_panics() {
    let Some(firmware) = firmware_for_every_module() else { return };
    let both = ["master", "slave"].map(|side| format!("{side}.scheme={EVERY_MODULE}"));
    let mut experiment = Experiment::new(&RigFile::from_shipped("bilateral", &both).unwrap()).unwrap();
    let master = &mut experiment.rig_mut().stations_mut()[0].dimsart;
    let timing = Timing::new(Profile::ZeroWait, Column::Upper);
    let steady = SteadyTick::of(&firmware, timing, master).unwrap();
    let function = |address: &u32| firmware.image.function_at(*address).unwrap().address;
    let executed: BTreeSet<u32> = steady.visited.iter().map(function).collect();
    let executed: Vec<String> =
        executed.into_iter().map(|address| firmware.image.location(address)).collect();
    let calls = executed.iter().filter(|name| name.ends_with("dimsart_core::module::kind::compute"));
    assert!(calls.count() >= kinds(), "{executed:?}");

    let declared = CallDeclarations::read(INDIRECT_CALLS).unwrap();
    let reached =
        reachability::check_reachable(&firmware.image, &declared, "dimsart_tick", &[NamePattern::new("*")])
            .unwrap();
    let unseen: Vec<&String> = executed
        .iter()
        .filter(|name| !name.starts_with(PIECE) && !reached.functions.contains(*name))
        .collect();
    assert!(unseen.is_empty(), "{unseen:?} of {executed:?}");
}
