//! CAN adapters of a host.

use chips::{Board, CanAdapter, CanBus};

/// Bit timing of a controller at 170 MHz: 1 and 5 Mbit/s, with transceiver delay compensation.
const TIMING: [u32; 3] = [32 << 25 | 135 << 8 | 32, 1 << 23 | 23 << 8 | 8 << 4 | 7, 25 << 8];

/// Two adapters on a bus.
fn bus() -> CanBus {
    let board = Board::find("nucleo-g474re").unwrap();
    let mut bus = CanBus::new([0, 1].map(|_| CanAdapter::bench(board).unwrap()).into());
    for node in 0..2 {
        CanAdapter::join(bus.bench(node).unwrap(), TIMING).unwrap();
    }
    bus
}

#[test]
fn two_adapters_exchange_frames_in_order_without_violations() {
    let mut bus = bus();
    let mut adapter = CanAdapter::default();
    let frames: Vec<(u32, Vec<u8>)> = [0, 1, 8, 12, 20, 64]
        .into_iter()
        .zip(0x1234_5600..)
        .map(|(length, identifier)| (identifier, (0..length).collect()))
        .collect();
    for (identifier, data) in &frames {
        adapter.send(*identifier, data.clone());
    }
    let mut taken = Vec::new();
    for _ in 0..200 {
        adapter.flush(bus.bench(0).unwrap()).unwrap();
        bus.run_for(50e-6).unwrap();
        taken.extend(CanAdapter::take(bus.bench(1).unwrap()).unwrap());
    }
    assert_eq!(taken, frames);
    for node in 0..2 {
        assert_eq!(bus.bench(node).unwrap().violations(), [] as [&str; 0]);
    }
}

#[test]
fn data_is_padded_with_zeros_to_the_next_can_fd_length() {
    let mut bus = bus();
    let mut adapter = CanAdapter::default();
    adapter.send(5, vec![7; 9]);
    adapter.flush(bus.bench(0).unwrap()).unwrap();
    bus.run_for(1e-3).unwrap();
    let (identifier, data) = CanAdapter::take(bus.bench(1).unwrap()).unwrap().unwrap();
    assert_eq!((identifier, data), (5, [[7; 9].as_slice(), &[0; 3]].concat()));
}
