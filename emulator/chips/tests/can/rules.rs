//! Violations of the reference manual.

use crate::desk::{CCCR, DBTP, Desk, NBTP, PLAIN, RXF0A, TXBAR, standard};

fn violation(desk: &mut Desk) -> String {
    let lines = desk.bench(0).violations();
    let [line] = &lines[..] else { panic!("{lines:?}") };
    line.clone()
}

#[test]
fn a_running_controller_cannot_be_configured() {
    let mut desk = Desk::joined(1, PLAIN);
    let before = desk.read(0, NBTP);
    desk.write(0, NBTP, before + 1);
    assert_eq!(desk.read(0, NBTP), before);
    assert!(violation(&mut desk).contains("FDCAN1_NBTP is written while it is locked"));
}

#[test]
fn init_alone_does_not_unlock_the_configuration() {
    let mut desk = Desk::joined(1, PLAIN);
    desk.write(0, CCCR, PLAIN.control | 1);
    desk.write(0, CCCR, 1);
    assert_eq!(desk.read(0, CCCR), PLAIN.control | 1);
    assert!(violation(&mut desk).contains("FDCAN1_CCCR changes bits 0x0300"));
}

#[test]
fn cce_is_set_after_init_and_cleared_with_it() {
    let mut desk = Desk::joined(1, PLAIN);
    desk.write(0, CCCR, PLAIN.control | 0b11);
    assert_eq!(desk.read(0, CCCR) & 0b11, 1);
    assert!(violation(&mut desk).contains("sets CCE before INIT"));
    desk.write(0, CCCR, PLAIN.control | 0b11);
    desk.write(0, CCCR, PLAIN.control | 0b10);
    assert_eq!(desk.read(0, CCCR) & 0b11, 0);
}

#[test]
fn a_controller_without_a_running_clock_does_not_start() {
    let mut desk = Desk::new(1);
    desk.power(0);
    // The crystal, which is off.
    desk.store(0, 0x4002_1088, 0);
    desk.configure(0, PLAIN);
    desk.write(0, CCCR, PLAIN.control);
    assert!(violation(&mut desk).contains("clock that RCC_CCIPR selects"));
    // The PLL's output Q, which is off, too.
    desk.store(0, 0x4002_1088, 1 << 24);
    desk.send(0, 0, standard(1, &[]));
    desk.run_us(1_000.0);
    assert_eq!(desk.0.take_frames().len(), 0);
}

#[test]
fn writing_a_pending_message_is_a_violation() {
    let mut desk = Desk::joined(1, PLAIN);
    desk.send(0, 0, standard(1, &[]));
    desk.put(0, 1, standard(2, &[]));
    assert_eq!(desk.bench(0).violations(), [] as [&str; 0]);
    desk.put(0, 0, standard(2, &[]));
    assert!(
        violation(&mut desk).contains("TX buffer 0 of FDCAN1 is written while its transmission is pending")
    );
}

#[test]
fn a_fifo_is_filled_in_order_and_only_occupied_elements_are_acknowledged() {
    let mut desk = Desk::joined(1, PLAIN);
    desk.put(0, 1, standard(1, &[]));
    desk.write(0, TXBAR, 0b10);
    assert!(violation(&mut desk).contains("requests buffer 1"));
    let mut desk = Desk::joined(1, PLAIN);
    desk.write(0, RXF0A, 0);
    assert!(violation(&mut desk).contains("FDCAN1_RXF0A acknowledges element 0, which is empty"));
}

#[test]
fn delay_compensation_requires_a_prescaler_of_at_most_two() {
    let mut desk = Desk::new(1);
    desk.power(0);
    desk.configure(0, PLAIN);
    desk.write(0, DBTP, PLAIN.data | 1 << 23 | 2 << 16);
    assert!(violation(&mut desk).contains("prescaler above 2"));
}
