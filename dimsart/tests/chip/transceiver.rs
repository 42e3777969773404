//! What is between the chip of b-g431b-esc1 and the bus.

use chips::{Bench, Board, CanBus, Fate};

use crate::pair::stamped;

/// Known: the board has a TCAN330, and data goes at 4 Mbit/s. All nodes of a bus have the same rates
/// (`boards/src/stm32g4/fdcan.rs`), so a bus with this board on it needs slower data for everybody.
#[test]
fn the_esc_s_transceiver_is_on_and_is_not_specified_for_the_rate_of_data() {
    let mut benches = Vec::new();
    for (board, side) in [("b-g431b-esc1", "slave"), ("nucleo-g474re", "master")] {
        let Some(image) = stamped(board, side, &[]) else { return };
        benches.push(Bench::new(Board::named(board).unwrap(), image).unwrap());
    }
    let mut bus = CanBus::new(benches);
    bus.run_for(0.3).unwrap();
    assert_eq!(bus.bench(0).unwrap().chip().output('C', 11), Some(false));
    let passed = bus.take_passed();
    for sender in [0, 1] {
        let count =
            passed.iter().filter(|frame| frame.sender == sender && frame.fate == Fate::Passed).count();
        assert!(count > 200, "{count} frames of board {sender}");
    }
    for frame in &passed {
        let bits = frame.message.wire_bits();
        let lasts_s = f64::from(bits.head + bits.tail) / 1e6 + f64::from(bits.fast) / 4e6;
        assert!((frame.ends_s - frame.begins_s - lasts_s).abs() < 1e-9, "1 and 4 Mbit/s");
    }
    let known = "TCAN330 is specified for 1 Mbit/s, and the bus has 4.0 Mbit/s";
    assert_eq!(bus.bench(0).unwrap().violations(), [known]);
    assert_eq!(bus.bench(1).unwrap().violations(), [] as [&str; 0]);
}
