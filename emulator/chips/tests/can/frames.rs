//! Frames: what comes in, when, in which order.

use chips::Fate;

use crate::desk::{
    Desk, EVENT, FD, Frame, IE, ILE, ILS, IR, PLAIN, RXF0S, Setup, TXBAR, TXBCF, TXBCR, TXBRP, TXBTO, TXEFS,
    TXFQS, extended, standard,
};

#[test]
fn a_frame_comes_in_whole_at_its_last_bit_but_one() {
    let mut desk = Desk::joined(2, PLAIN);
    let data: Vec<u8> = (1..=48).collect();
    desk.send(0, 0, Frame { first: 0x123 << 18, flags: FD, code: 14, data: &data });
    assert_eq!(desk.read(0, TXBRP), 1);
    desk.run_us(50.0);
    assert_eq!(desk.take(1), None);
    desk.run_us(400.0);
    let [passed] = desk.0.take_passed().try_into().unwrap();
    assert_eq!((passed.fate, passed.sender), (Fate::Passed, 0));
    let (first, second, bytes) = desk.take(1).unwrap();
    assert_eq!((first, second >> 16 & 0x3F, bytes), (0x123 << 18, 0b11_1110, data));
    assert_eq!(desk.take(1), None);
    assert_eq!((desk.read(0, TXBRP), desk.read(0, TXBTO), desk.read(0, TXFQS)), (0, 1, 0x0001_0103));
    // 17 bits slow before the switch, 9 behind the CRC; 4 + 8 * 48 and its checks fast, stuff bits on both sides.
    let bits = passed.message.wire_bits();
    assert!((17..=20).contains(&bits.head) && bits.tail == 9, "{bits:?}");
    let unstuffed = 5 + 8 * 48 + 1 + 4 + 21 + 6 + 1;
    assert!((unstuffed..unstuffed + 90).contains(&bits.fast), "{bits:?}");
    let lasts_us = f64::from(bits.head + bits.tail) + 0.5 * f64::from(bits.fast);
    let lasted_us = 1e6 * (passed.ends_s - passed.begins_s);
    assert!((lasted_us - lasts_us).abs() < 1e-6, "{lasted_us} us");
}

#[test]
fn both_ends_are_told_in_the_right_cycle() {
    let mut desk = Desk::joined(2, PLAIN);
    desk.send(0, 0, standard(0x555, &[0xAA; 8]));
    let asked = desk.bench(0).processor.cycles();
    let bits = loop {
        desk.run_us(2.0);
        if let [passed] = &desk.0.take_passed()[..] {
            break u64::from(passed.message.wire_bits().head + passed.message.wire_bits().tail);
        }
    };
    // 16 cycles to a bit. The events of the processor are those of the chip.
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
fn the_lowest_identifier_goes_first_and_eleven_bits_before_twenty_nine() {
    let mut desk = Desk::joined(4, PLAIN);
    desk.send(0, 0, standard(0x7FF, &[0; 8]));
    desk.run_us(40.0);
    // While that is on the bus.
    desk.send(1, 0, standard(0x101, &[]));
    desk.send(2, 0, extended(0x100 << 18, &[]));
    desk.send(3, 0, standard(0x100, &[]));
    desk.send(0, 1, standard(0x0FF, &[]));
    desk.run_us(500.0);
    assert_eq!(desk.passed(), [0x7FF, 0x0FF, 0x100, 0x100 << 18, 0x101]);
    assert_eq!(desk.bench(0).violations(), [] as [&str; 0]);
}

#[test]
fn a_fifo_keeps_its_order_and_a_queue_sends_the_most_urgent() {
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
fn a_full_fifo_loses_the_new_one_or_gives_up_the_oldest() {
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
fn what_has_not_begun_is_cancelled_at_once_and_what_has_is_sent() {
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
    // The FIFO went on behind the one that was cancelled.
    assert_eq!(desk.read(0, TXFQS), 0x0000_0003);
    // Right behind its request, nobody knows yet.
    desk.send(0, 0, standard(7, &[]));
    desk.write(0, TXBCR, 1);
    desk.run_us(400.0);
    assert_eq!(desk.passed(), [7]);
}

#[test]
fn a_cancelled_oldest_lets_the_fifo_go_on() {
    let mut desk = Desk::joined(1, PLAIN);
    for buffer in 0..3 {
        desk.send(0, buffer, standard(buffer, &[]));
    }
    desk.run_us(5_000.0);
    assert_eq!(desk.read(0, TXFQS), 1 << 21, "nobody acknowledges");
    for (buffer, free) in [(0, 1), (1, 2), (2, 3)] {
        desk.write(0, TXBCR, 1 << buffer);
        desk.run_us(300.0);
        assert_eq!(desk.read(0, TXFQS) & 7, free);
    }
    assert_eq!((desk.read(0, TXBRP), desk.read(0, TXBCF), desk.read(0, TXBTO)), (0, 0b111, 0));
}

#[test]
fn lines_tell_what_is_selected_for_them() {
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
fn what_was_sent_leaves_an_event_where_that_is_asked_for() {
    let mut desk = Desk::joined(2, PLAIN);
    desk.send(0, 0, Frame { flags: EVENT | 0x5A << 24, ..standard(0x42, &[1, 2]) });
    desk.send(0, 1, standard(0x43, &[]));
    desk.run_us(300.0);
    assert_eq!(desk.read(0, TXEFS), 0x0001_0001);
    assert_eq!((desk.ram(0, 0x260), desk.ram(0, 0x264) >> 16), (0x42 << 18, 0x5A42));
    assert_eq!(desk.read(0, IR) >> 10 & 1, 1);
}

#[test]
fn who_is_not_set_for_fd_sends_classic_frames() {
    let mut desk = Desk::joined(2, Setup { control: 0, ..PLAIN });
    desk.send(0, 0, Frame { first: 1 << 18, flags: FD, code: 15, data: &[9; 64] });
    desk.run_us(300.0);
    let [passed] = desk.0.take_passed().try_into().unwrap();
    assert!(!passed.message.is_fd && passed.message.data == [9; 8]);
}
