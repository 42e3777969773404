//! Errors: no receiver, shorted wires, different bit rates, bus-off and recovery.

use chips::FrameResult;

use crate::desk::{
    CCCR, Desk, ECR, FD, Frame, IR, ONE_MBIT, PLAIN, PSR, Setup, TWO_MBIT_DATA, TXBCF, TXBRP, TXBTO, standard,
};

const BO: u32 = 1 << 7;
const EP: u32 = 1 << 5;

#[test]
fn a_single_node_becomes_error_passive_and_stays_on_the_bus() {
    let mut desk = Desk::joined(1, PLAIN);
    desk.send(0, 0, standard(1, &[1, 2, 3]));
    desk.run_us(100_000.0);
    assert_eq!(desk.read(0, ECR) & 0xFF, 128, "16 times 8");
    assert_eq!(desk.read(0, PSR) & (BO | EP | 7), EP | 3, "acknowledge error");
    assert_eq!(desk.read(0, IR) >> 17 & 0b111, 0b011, "EP, EW");
    let tried = desk.0.take_frames();
    assert!(tried.len() > 500 && tried.iter().all(|frame| frame.result == FrameResult::NotAcknowledged));
    // An error-passive sender waits 8 more bits, so that other nodes can send first.
    let gap_bits = |first: usize| {
        let gap_s = tried[first + 1].start_s - tried[first].end_s;
        (gap_s * 1e6).round()
    };
    assert_eq!((gap_bits(0), gap_bits(100)), (17.0, 25.0));
    assert_eq!((desk.read(0, TXBRP), desk.read(0, TXBTO)), (1, 0));
}

#[test]
fn a_joining_node_acknowledges_and_the_sender_is_error_active_again() {
    let mut desk = Desk::new(2);
    desk.start(0, PLAIN);
    desk.send(0, 0, standard(1, &[]));
    desk.run_us(20_000.0);
    assert_eq!(desk.read(0, PSR) & EP, EP);
    desk.start(1, PLAIN);
    desk.run_us(200.0);
    assert_eq!((desk.read(0, TXBTO), desk.read(0, ECR) & 0xFF), (1, 127));
    assert_eq!(desk.read(0, PSR) & EP, 0);
    assert_eq!(desk.take(1).unwrap().0, 1 << 18);
}

#[test]
fn without_retransmission_an_unacknowledged_frame_is_dropped() {
    let mut desk = Desk::joined(1, Setup { control: PLAIN.control | 1 << 6, ..PLAIN });
    desk.send(0, 0, standard(1, &[]));
    desk.run_us(500.0);
    assert_eq!((desk.read(0, TXBRP), desk.read(0, TXBTO), desk.read(0, TXBCF)), (0, 0, 1));
    assert_eq!(desk.0.take_frames().len(), 1);
}

/// A sender that reads back no dominant bits is bus-off after 32 frames.
fn leaves(desk: &mut Desk) {
    desk.send(0, 0, standard(1, &[]));
    desk.run_us(3_000.0);
    assert_eq!(desk.read(0, PSR) & (BO | 7), BO | 5);
    assert_eq!(desk.read(0, CCCR) & 1, 1, "INIT");
    assert_eq!(desk.read(0, IR) >> 19 & 1, 1);
    assert_eq!(desk.0.take_frames().len(), 32);
}

#[test]
fn shorted_wires_cause_bus_off_until_the_program_requests_recovery() {
    let mut desk = Desk::joined(2, PLAIN);
    desk.0.set_shorted(true);
    leaves(&mut desk);
    desk.0.set_shorted(false);
    desk.run_us(50_000.0);
    assert_eq!(desk.read(0, PSR) & BO, BO, "no automatic recovery");
    desk.write(0, IR, 1 << 19);
    desk.write(0, CCCR, PLAIN.control);
    // 129 times 11 bits.
    desk.run_us(1_418.0);
    assert_eq!(desk.read(0, PSR) & BO, BO);
    assert_eq!(desk.0.take_frames().len(), 0);
    desk.run_us(2.0);
    assert_eq!((desk.read(0, PSR) & BO, desk.read(0, ECR), desk.read(0, IR) >> 19 & 1), (0, 32 << 16, 1));
    // The pending frame is sent.
    desk.run_us(200.0);
    assert_eq!(desk.passed(), [1]);
}

#[test]
fn frames_of_other_nodes_delay_bus_off_recovery() {
    let mut desk = Desk::joined(3, PLAIN);
    desk.0.set_shorted(true);
    leaves(&mut desk);
    desk.0.set_shorted(false);
    desk.write(0, CCCR, PLAIN.control);
    let mut sent = 0;
    let mut back_us = 0;
    while desk.read(0, PSR) & BO == BO {
        desk.send(1, sent % 3, standard(9, &[0xFF; 8]));
        sent += 1;
        desk.run_us(150.0);
        back_us += 150;
    }
    // A frame of 8 bytes lasts about ten idle sequences, and its end counts as one sequence.
    assert!((4_000..16_000).contains(&back_us), "{back_us} us");
}

#[test]
fn with_its_transceiver_off_a_sender_reads_back_nothing() {
    let mut desk = Desk::of(&["b-g431b-esc1", "nucleo-g474re"]);
    desk.start(0, PLAIN);
    desk.start(1, PLAIN);
    desk.run_us(50.0);
    // PC11 of the ESC goes high.
    desk.store(0, 0x4800_0818, 1 << 11);
    leaves(&mut desk);
    assert_eq!(desk.read(1, ECR), 0, "the other node receives nothing");
}

#[test]
fn a_bit_rate_above_the_transceiver_s_limit_is_a_violation() {
    let mut desk = Desk::of(&["b-g431b-esc1", "nucleo-g474re"]);
    desk.start(0, PLAIN);
    desk.start(1, PLAIN);
    desk.run_us(50.0);
    desk.send(0, 0, standard(1, &[]));
    desk.run_us(150.0);
    assert_eq!(desk.bench(0).violations(), [] as [&str; 0]);
    desk.send(0, 1, Frame { flags: FD, ..standard(1, &[]) });
    desk.run_us(150.0);
    assert_eq!(
        desk.bench(0).violations(),
        ["TCAN330 is specified for 1 Mbit/s, but the bus runs at 2.0 Mbit/s"]
    );
    assert_eq!(desk.bench(1).violations(), [] as [&str; 0]);
}

#[test]
fn nodes_with_different_bit_rates_corrupt_each_other_s_frames() {
    let mut desk = Desk::joined(2, PLAIN);
    // 800 kbit/s.
    desk.start(1, Setup { nominal: ONE_MBIT & !0xFF00 | 15 << 8, ..PLAIN });
    desk.run_us(50.0);
    desk.send(0, 0, standard(1, &[]));
    desk.run_us(10_000.0);
    assert_eq!(desk.passed(), []);
    assert!(desk.read(0, ECR) & 0xFF >= 128, "{:#x}", desk.read(0, ECR));
    // The receiver is error-passive, too, and no longer aborts the frames: they are not acknowledged.
    assert_eq!(desk.read(1, ECR) >> 15 & 1, 1);
    assert_eq!(desk.take(1), None);
}

#[test]
fn a_different_data_bit_rate_corrupts_only_frames_that_use_it() {
    let mut desk = Desk::joined(2, PLAIN);
    desk.start(1, Setup { data: TWO_MBIT_DATA + (1 << 8), ..PLAIN });
    desk.run_us(50.0);
    desk.send(0, 0, standard(1, &[]));
    desk.run_us(200.0);
    assert_eq!(desk.passed(), [1]);
    desk.send(0, 1, Frame { flags: FD, ..standard(2, &[]) });
    desk.run_us(200.0);
    assert_eq!(desk.passed(), []);
    assert_eq!(desk.read(1, IR) >> 22 & 1, 1, "PED");
    assert_eq!((desk.read(1, PSR) >> 8 & 7, desk.read(0, PSR) >> 8 & 7), (1, 4));
}

#[test]
fn crystal_tolerance_is_accepted_and_a_six_percent_difference_is_not() {
    let mut desk = Desk::joined(2, PLAIN);
    // 17 quanta instead of 16.
    desk.start(1, Setup { nominal: ONE_MBIT + (1 << 8), ..PLAIN });
    desk.send(0, 0, standard(1, &[]));
    desk.run_us(300.0);
    assert_eq!(desk.passed(), []);
    // 8 quanta of a crystal of 8.02 MHz: 0.25 % fast.
    let mut desk = Desk::joined(2, PLAIN);
    desk.bench(1).chip().set_crystal(Some(8.02e6));
    desk.store(1, 0x4002_1000, 1 << 16 | 0x500);
    desk.run_us(3_000.0);
    desk.power(1);
    desk.store(1, 0x4002_1088, 0);
    desk.configure(1, Setup { nominal: 1 << 25 | 4 << 8 | 1, ..PLAIN });
    desk.write(1, CCCR, PLAIN.control);
    desk.run_us(50.0);
    desk.send(0, 0, standard(1, &[]));
    desk.run_us(300.0);
    assert_eq!(desk.passed(), [1]);
}

#[test]
fn a_classic_node_ignores_or_aborts_fd_frames() {
    for (control, expected) in [(0, 1), (1 << 12, 0)] {
        let mut desk = Desk::joined(3, PLAIN);
        desk.start(2, Setup { control, ..PLAIN });
        desk.run_us(50.0);
        desk.send(0, 0, Frame { flags: FD, ..standard(1, &[]) });
        desk.run_us(200.0);
        assert_eq!(desk.passed().len(), expected);
        assert_eq!(desk.take(2), None);
    }
}

#[test]
fn two_senders_with_the_same_identifier_collide() {
    let mut desk = Desk::joined(3, PLAIN);
    desk.send(2, 0, standard(0, &[0; 8]));
    desk.run_us(50.0);
    desk.send(0, 0, standard(7, &[1]));
    desk.send(1, 0, standard(7, &[2]));
    desk.run_us(230.0);
    assert_eq!(desk.passed(), [0]);
    assert!([0, 1].into_iter().all(|board| desk.read(board, ECR) & 0xFF >= 8));
}
