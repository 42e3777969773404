//! Frames: content, timing and order.

use chips::FrameResult;

use crate::desk::{
    Desk, EVENT, FD, Frame, IE, ILE, ILS, IR, PLAIN, RXF0S, Setup, TXBAR, TXBCF, TXBCR, TXBRP, TXBTO, TXEFS,
    TXFQS, extended, standard,
};

#[test]
fn a_frame_is_received_at_its_second_to_last_bit() {
    let mut desk = Desk::joined(2, PLAIN);
    let data: Vec<u8> = (1..=48).collect();
    desk.send(0, 0, Frame { first: 0x123 << 18, flags: FD, code: 14, data: &data });
    assert_eq!(desk.read(0, TXBRP), 1);
    desk.run_us(50.0);
    assert_eq!(desk.take(1), None);
    desk.run_us(400.0);
    let [passed] = desk.0.take_frames().try_into().unwrap();
    assert_eq!((passed.result, passed.sender), (FrameResult::Acknowledged, 0));
    let (first, second, bytes) = desk.take(1).unwrap();
    assert_eq!((first, second >> 16 & 0x3F, bytes), (0x123 << 18, 0b11_1110, data));
    assert_eq!(desk.take(1), None);
    assert_eq!((desk.read(0, TXBRP), desk.read(0, TXBTO), desk.read(0, TXFQS)), (0, 1, 0x0001_0103));
    // Slow: 17 bits before the rate switch, 9 after the CRC. Fast: 4 + 8 * 48 bits, stuff count and CRC. Both
    // parts have stuff bits.
    let bits = passed.message.wire_bits();
    assert!((17..=20).contains(&bits.head) && bits.tail == 9, "{bits:?}");
    let unstuffed = 5 + 8 * 48 + 1 + 4 + 21 + 6 + 1;
    assert!((unstuffed..unstuffed + 90).contains(&bits.fast), "{bits:?}");
    let lasts_us = f64::from(bits.head + bits.tail) + 0.5 * f64::from(bits.fast);
    let lasted_us = 1e6 * (passed.end_s - passed.start_s);
    assert!((lasted_us - lasts_us).abs() < 1e-6, "{lasted_us} us");
}

#[test]
fn sender_and_receiver_are_notified_in_the_correct_cycle() {
    let mut desk = Desk::joined(2, PLAIN);
    desk.send(0, 0, standard(0x555, &[0xAA; 8]));
    let asked = desk.bench(0).processor.cycles();
    let bits = loop {
        desk.run_us(2.0);
        if let [passed] = &desk.0.take_frames()[..] {
            break u64::from(passed.message.wire_bits().head + passed.message.wire_bits().tail);
        }
    };
    // 16 cycles per bit. The processor runs from one chip event to the next.
    let received_at = asked + 16 * (bits - 1);
    for (board, cycle, register) in [(1, received_at, RXF0S), (0, asked + 16 * bits, TXBTO)] {
        let before = desk.bench(board).processor.cycles();
        assert!(before < cycle, "{before} {cycle}");
        desk.bench(board).processor.run_until(cycle - 3).unwrap();
        assert_eq!(desk.read(board, register) & 1, 0);
        desk.bench(board).processor.run_until(cycle + 3).unwrap();
        assert_eq!(desk.read(board, register) & 1, 1);
    }
}

#[test]
fn the_lowest_identifier_wins_and_standard_before_extended() {
    let mut desk = Desk::joined(4, PLAIN);
    desk.send(0, 0, standard(0x7FF, &[0; 8]));
    desk.run_us(40.0);
    // While the first frame is on the bus.
    desk.send(1, 0, standard(0x101, &[]));
    desk.send(2, 0, extended(0x100 << 18, &[]));
    desk.send(3, 0, standard(0x100, &[]));
    desk.send(0, 1, standard(0x0FF, &[]));
    desk.run_us(500.0);
    assert_eq!(desk.passed(), [0x7FF, 0x0FF, 0x100, 0x100 << 18, 0x101]);
    assert_eq!(desk.bench(0).violations(), [] as [&str; 0]);
}

#[test]
fn a_fifo_sends_in_order_and_a_queue_by_priority() {
    for (is_queue, expected) in [(false, [3, 1, 2]), (true, [1, 2, 3])] {
        let mut desk = Desk::joined(2, Setup { is_queue, ..PLAIN });
        for (buffer, identifier) in (0..).zip([3, 1, 2]) {
            desk.send(0, buffer, standard(identifier, &[]));
        }
        assert_eq!(desk.read(0, TXFQS) >> 21 & 1, 1, "full");
        desk.run_us(400.0);
        assert_eq!(desk.passed(), expected);
        for (buffer, identifier) in (0..).zip([6, 5, 4]) {
            desk.put(0, buffer, standard(identifier, &[]));
        }
        if is_queue {
            desk.write(0, TXBAR, 0b111);
            desk.run_us(400.0);
            assert_eq!(desk.passed(), [4, 5, 6]);
        }
    }
}

#[test]
fn a_full_fifo_drops_the_new_frame_or_overwrites_the_oldest() {
    for overwrites in [false, true] {
        let mut desk = Desk::joined(2, Setup { filters: u32::from(overwrites) << 9, ..PLAIN });
        for identifier in 0..4u32 {
            desk.send(0, identifier % 3, standard(identifier, &[]));
            desk.run_us(100.0);
        }
        let taken: Vec<u32> = std::iter::from_fn(|| desk.take(1)).map(|(first, ..)| first >> 18).collect();
        assert_eq!(taken, if overwrites { [1, 2, 3] } else { [0, 1, 2] });
        assert_eq!(desk.read(1, IR) >> 2 & 1 == 1, !overwrites);
        assert_eq!(desk.read(1, RXF0S) >> 25 & 1 == 1, !overwrites);
        desk.write(1, IR, 1 << 2);
        assert_eq!(desk.read(1, RXF0S) >> 25, 0);
    }
}

#[test]
fn a_waiting_frame_is_cancelled_at_once_and_a_started_frame_is_sent() {
    let mut desk = Desk::joined(2, PLAIN);
    for buffer in 0..3 {
        desk.send(0, buffer, standard(buffer, &[0; 8]));
    }
    desk.run_us(40.0);
    desk.write(0, TXBCR, 0b101);
    assert_eq!((desk.read(0, TXBRP), desk.read(0, TXBCF)), (0b011, 0b100));
    desk.run_us(400.0);
    assert_eq!(desk.passed(), [0, 1]);
    assert_eq!((desk.read(0, TXBTO), desk.read(0, TXBCF)), (0b011, 0b101));
    // The FIFO has continued after the cancelled buffer.
    assert_eq!(desk.read(0, TXFQS), 0x0000_0003);
    // Directly after its request, the frame may have started.
    desk.send(0, 0, standard(7, &[]));
    desk.write(0, TXBCR, 1);
    desk.run_us(400.0);
    assert_eq!(desk.passed(), [7]);
}

#[test]
fn a_fifo_continues_after_its_oldest_request_is_cancelled() {
    let mut desk = Desk::joined(1, PLAIN);
    for buffer in 0..3 {
        desk.send(0, buffer, standard(buffer, &[]));
    }
    desk.run_us(5_000.0);
    assert_eq!(desk.read(0, TXFQS), 1 << 21, "no acknowledge");
    for (buffer, free) in [(0, 1), (1, 2), (2, 3)] {
        desk.write(0, TXBCR, 1 << buffer);
        desk.run_us(300.0);
        assert_eq!(desk.read(0, TXFQS) & 7, free);
    }
    assert_eq!((desk.read(0, TXBRP), desk.read(0, TXBCF), desk.read(0, TXBTO)), (0, 0b111, 0));
}

#[test]
fn interrupt_lines_signal_their_selected_flags() {
    let mut desk = Desk::joined(2, PLAIN);
    let lines = |desk: &mut Desk| {
        use cycles::processor::Bus as _;
        desk.bench(1).processor.bus.lines() >> 21 & 3
    };
    desk.send(0, 0, standard(1, &[]));
    desk.run_us(100.0);
    assert_eq!(lines(&mut desk), 0);
    desk.write(1, IE, 1);
    assert_eq!(lines(&mut desk), 0);
    desk.write(1, ILE, 0b11);
    assert_eq!(lines(&mut desk), 0b01);
    desk.write(1, ILS, 1);
    assert_eq!(lines(&mut desk), 0b10);
    desk.write(1, IR, 1);
    assert_eq!(lines(&mut desk), 0);
}

#[test]
fn a_sent_frame_stores_an_event_if_requested() {
    let mut desk = Desk::joined(2, PLAIN);
    desk.send(0, 0, Frame { flags: EVENT | 0x5A << 24, ..standard(0x42, &[1, 2]) });
    desk.send(0, 1, standard(0x43, &[]));
    desk.run_us(300.0);
    assert_eq!(desk.read(0, TXEFS), 0x0001_0001);
    assert_eq!((desk.ram(0, 0x260), desk.ram(0, 0x264) >> 16), (0x42 << 18, 0x5A42));
    assert_eq!(desk.read(0, IR) >> 10 & 1, 1);
}

#[test]
fn a_controller_without_fd_sends_classic_frames() {
    let mut desk = Desk::joined(2, Setup { control: 0, ..PLAIN });
    desk.send(0, 0, Frame { first: 1 << 18, flags: FD, code: 15, data: &[9; 64] });
    desk.run_us(300.0);
    let [passed] = desk.0.take_frames().try_into().unwrap();
    assert!(!passed.message.is_fd && passed.message.data == [9; 8]);
}
