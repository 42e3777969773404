//! Errors: nobody there, wires that touch, bit rates that differ, leaving the bus and coming back.

use chips::Fate;

use crate::desk::{
    CCCR, Desk, ECR, FD, Frame, IR, ONE_MBIT, PLAIN, PSR, Setup, TWO_MBIT_DATA, TXBCF, TXBRP, TXBTO, standard,
};

const BO: u32 = 1 << 7;
const EP: u32 = 1 << 5;

#[test]
fn alone_a_node_becomes_passive_and_stays_on_the_bus() {
    let mut desk = Desk::joined(1, PLAIN);
    desk.send(0, 0, standard(1, &[1, 2, 3]));
    desk.run_us(100_000.0);
    assert_eq!(desk.read(0, ECR) & 0xFF, 128, "16 times 8");
    assert_eq!(desk.read(0, PSR) & (BO | EP | 7), EP | 3, "acknowledge error");
    assert_eq!(desk.read(0, IR) >> 17 & 0b111, 0b011, "EP, EW");
    let tried = desk.0.take_passed();
    assert!(tried.len() > 500 && tried.iter().all(|frame| frame.fate == Fate::NotAcknowledged));
    // It lets others go first, by 8 bits more.
    let gap_bits = |first: usize| {
        let gap_s = tried[first + 1].begins_s - tried[first].ends_s;
        (gap_s * 1e6).round()
    };
    assert_eq!((gap_bits(0), gap_bits(100)), (17.0, 25.0));
    assert_eq!((desk.read(0, TXBRP), desk.read(0, TXBTO)), (1, 0));
}

#[test]
fn who_joins_acknowledges_and_the_sender_is_active_again() {
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
fn where_nobody_sends_again_an_unacknowledged_frame_is_given_up() {
    let mut desk = Desk::joined(1, Setup { control: PLAIN.control | 1 << 6, ..PLAIN });
    desk.send(0, 0, standard(1, &[]));
    desk.run_us(500.0);
    assert_eq!((desk.read(0, TXBRP), desk.read(0, TXBTO), desk.read(0, TXBCF)), (0, 0, 1));
    assert_eq!(desk.0.take_passed().len(), 1);
}

/// A sender that reads none of its dominant bits leaves the bus behind 32 frames.
fn leaves(desk: &mut Desk) {
    desk.send(0, 0, standard(1, &[]));
    desk.run_us(3_000.0);
    assert_eq!(desk.read(0, PSR) & (BO | 7), BO | 5);
    assert_eq!(desk.read(0, CCCR) & 1, 1, "INIT");
    assert_eq!(desk.read(0, IR) >> 19 & 1, 1);
    assert_eq!(desk.0.take_passed().len(), 32);
}

#[test]
fn wires_that_touch_drive_a_sender_off_the_bus_and_it_comes_back_when_it_is_let() {
    let mut desk = Desk::joined(2, PLAIN);
    desk.0.short(true);
    leaves(&mut desk);
    desk.0.short(false);
    desk.run_us(50_000.0);
    assert_eq!(desk.read(0, PSR) & BO, BO, "not by itself");
    desk.write(0, IR, 1 << 19);
    desk.write(0, CCCR, PLAIN.control);
    // 129 times 11 bits.
    desk.run_us(1_418.0);
    assert_eq!(desk.read(0, PSR) & BO, BO);
    assert_eq!(desk.0.take_passed().len(), 0);
    desk.run_us(2.0);
    assert_eq!((desk.read(0, PSR) & BO, desk.read(0, ECR), desk.read(0, IR) >> 19 & 1), (0, 32 << 16, 1));
    // What waited goes.
    desk.run_us(200.0);
    assert_eq!(desk.passed(), [1]);
}

#[test]
fn frames_of_others_make_the_way_back_longer() {
    let mut desk = Desk::joined(3, PLAIN);
    desk.0.short(true);
    leaves(&mut desk);
    desk.0.short(false);
    desk.write(0, CCCR, PLAIN.control);
    let mut sent = 0;
    let mut back_us = 0;
    while desk.read(0, PSR) & BO == BO {
        desk.send(1, sent % 3, standard(9, &[0xFF; 8]));
        sent += 1;
        desk.run_us(150.0);
        back_us += 150;
    }
    // A frame of 8 bytes takes the time of ten sequences or so, and its end is one.
    assert!((4_000..16_000).contains(&back_us), "{back_us} us");
}

#[test]
fn a_transceiver_that_is_off_does_not_give_back_what_is_sent() {
    let mut desk = Desk::of(&["b-g431b-esc1", "nucleo-g474re"]);
    desk.start(0, PLAIN);
    desk.start(1, PLAIN);
    desk.run_us(50.0);
    // The ESC's PC11 goes up.
    desk.store(0, 0x4800_0818, 1 << 11);
    leaves(&mut desk);
    assert_eq!(desk.read(1, ECR), 0, "the other one hears nothing");
}

#[test]
fn a_transceiver_says_when_it_is_too_slow() {
    let mut desk = Desk::of(&["b-g431b-esc1", "nucleo-g474re"]);
    desk.start(0, PLAIN);
    desk.start(1, PLAIN);
    desk.run_us(50.0);
    desk.send(0, 0, standard(1, &[]));
    desk.run_us(150.0);
    assert_eq!(desk.bench(0).violations(), [] as [&str; 0]);
    desk.send(0, 1, Frame { flags: FD, ..standard(1, &[]) });
    desk.run_us(150.0);
    assert_eq!(desk.bench(0).violations(), ["TCAN330 is specified for 1 Mbit/s, and the bus has 2.0 Mbit/s"]);
    assert_eq!(desk.bench(1).violations(), [] as [&str; 0]);
}

#[test]
fn nodes_of_different_bit_rates_spoil_each_other_s_frames() {
    let mut desk = Desk::joined(2, PLAIN);
    // 800 kbit/s.
    desk.start(1, Setup { nominal: ONE_MBIT & !0xFF00 | 15 << 8, ..PLAIN });
    desk.run_us(50.0);
    desk.send(0, 0, standard(1, &[]));
    desk.run_us(10_000.0);
    assert_eq!(desk.passed(), []);
    assert!(desk.read(0, ECR) & 0xFF >= 128, "{:#x}", desk.read(0, ECR));
    // The receiver is passive, too, and lets the frames be: nobody acknowledges them.
    assert_eq!(desk.read(1, ECR) >> 15 & 1, 1);
    assert_eq!(desk.take(1), None);
}

#[test]
fn a_data_rate_that_differs_spoils_only_what_uses_it() {
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
fn what_crystals_differ_by_does_no_harm_and_six_percent_do() {
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
fn a_classic_node_lets_fd_frames_pass_or_breaks_them_off() {
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
fn two_that_send_with_one_identifier_collide() {
    let mut desk = Desk::joined(3, PLAIN);
    desk.send(2, 0, standard(0, &[0; 8]));
    desk.run_us(50.0);
    desk.send(0, 0, standard(7, &[1]));
    desk.send(1, 0, standard(7, &[2]));
    desk.run_us(230.0);
    assert_eq!(desk.passed(), [0]);
    assert!([0, 1].into_iter().all(|board| desk.read(board, ECR) & 0xFF >= 8));
}
