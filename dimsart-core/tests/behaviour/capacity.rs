//! Capacity of a board's memory.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use dimsart_core::limits::Capacities;
use dimsart_core::{AxisKind, DataType, DeviceDescriptor, Dimsart, memory, scheme, types};
use dimsart_modules::ALL;

/// The sizes of the board nucleo-g474re.
type BoardMemory = memory!(Capacities { words: 3072, ..Capacities::DEFAULT });
const SCHEME: &str = include_str!("../../../dimsart/tests/emulated/every_module.scheme");
const SIDES: &[&str] = &["master", "slave"];

/// Returns the refusal of a scheme of every module with a recorder of `rows` rows for 7 axes; none if it
/// runs.
fn refused(recorder_rows: usize, side: &str) -> Vec<String> {
    const OUTPUTS: [&DataType; 7] = {
        let [cycles, mean, max, late, overruns, period] = types::TIMING;
        [types::POSITION, cycles, mean, max, late, overruns, period]
    };
    let axes = [AxisKind::Rotary; 7];
    let device = DeviceDescriptor::new("arm", &axes, 1e-3, &OUTPUTS, &[types::DES_FORCE]).unwrap();
    let mut dimsart = Dimsart::new(Box::leak(Box::new(BoardMemory::new())), device, ALL).unwrap();
    let length = format!("LENGTH               {recorder_rows}");
    let text = SCHEME.replace("LENGTH               500", &length);
    assert!(text.contains(&length));
    let mut refused = Vec::new();
    scheme::load(&text, side, SIDES, &mut dimsart, |error| {
        refused.push(format!("{} {:?}", error.place.word, error.problem));
    });
    assert!(dimsart.engine().is_running());
    refused
}

#[test]
fn every_module_at_seven_axes_leaves_the_nucleo_room_for_a_recorder_of_250_rows() {
    for side in SIDES {
        assert_eq!(refused(250, side), [""; 0]);
        let [too_long] = refused(500, side).try_into().unwrap();
        assert!(too_long.starts_with("RECORDER_MOD Refused(Storage(OutOfMemory { wanted: "), "{too_long}");
    }
}
