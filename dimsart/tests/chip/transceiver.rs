//! The transceiver of b-g431b-esc1: a TCAN330, which carries 1 Mbit/s.

use chips::{Bench, Board, CanBus, FrameResult};

use crate::pair::stamped;

const ESC: &str = "b-g431b-esc1";

/// Returns boards of these names on a bus, a slave and a master, after 0.3 s; `None` without images.
fn on_a_bus(boards: [&str; 2]) -> Option<CanBus> {
    let sides = [("slave", *b"FIRST-BOARD\0"), ("master", *b"OTHER-BOARD\0")];
    let mut benches = Vec::new();
    for (board, (side, serial)) in boards.into_iter().zip(sides) {
        let mut bench = Bench::new(Board::find(board).unwrap(), stamped(board, side, &[])?).unwrap();
        bench.chip().set_serial_number(serial);
        benches.push(bench);
    }
    let mut bus = CanBus::new(benches);
    bus.run_for(0.3).unwrap();
    Some(bus)
}

#[test]
fn two_escs_keep_to_what_their_transceivers_carry() {
    let Some(mut bus) = on_a_bus([ESC, ESC]) else { return };
    // Low: the transceiver is on.
    assert_eq!(bus.bench(0).unwrap().chip().output('C', 11), Some(false));
    let passed = bus.take_frames();
    for sender in [0, 1] {
        let count = passed
            .iter()
            .filter(|frame| frame.sender == sender && frame.result == FrameResult::Acknowledged)
            .count();
        assert!(count > 200, "{count} frames of board {sender}");
        assert_eq!(bus.bench(sender).unwrap().violations(), [] as [&str; 0]);
    }
    for frame in &passed {
        let bits = frame.message.wire_bits();
        assert_eq!(bits.fast, 0);
        let lasts_s = f64::from(bits.head + bits.tail) / 1e6;
        assert!((frame.end_s - frame.start_s - lasts_s).abs() < 1e-9, "1 Mbit/s");
    }
}

/// Every node must use the rate of the slowest transceiver: nucleo-g474re does with the feature `one-can-rate`.
#[test]
fn a_node_that_sends_data_faster_is_told() {
    let Some(mut bus) = on_a_bus([ESC, "nucleo-g474re"]) else { return };
    let known = "TCAN330 is specified for 1 Mbit/s, but the bus runs at 4.0 Mbit/s";
    assert_eq!(bus.bench(0).unwrap().violations(), [known]);
    assert_eq!(bus.bench(1).unwrap().violations(), [] as [&str; 0]);
}
