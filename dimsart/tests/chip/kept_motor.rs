//! The stored motor configuration of b-g431b-esc1, and the identification of the motor at its bridge.

use std::io::{self, ErrorKind, Read, Write};
use std::sync::{Arc, Mutex, MutexGuard};

use dimsart::connect::{ConnectError, Device, DisplayValue};
use dimsart_link::protocol::IdentificationFailure;

use crate::common::{PATIENCE, Shared};
use crate::motor::Powered;

/// Longer than a start.
const START_S: f64 = 0.3;
/// Read timeout of the command line.
const READ_PERIODS: u32 = 20;

/// A board and its motor, shared by a test and its command line.
#[derive(Clone)]
struct Board(Arc<Mutex<Powered>>);

/// The host's end of its command line; reads advance the time of the board.
struct Line {
    board: Board,
    rest: Vec<u8>,
}

impl Board {
    fn start() -> Option<Self> {
        let mut powered = Powered::new()?;
        powered.motor.set_rotor(0.3, 0.0);
        powered.run_for(START_S);
        Some(Self(Arc::new(Mutex::new(powered))))
    }

    fn powered(&self) -> MutexGuard<'_, Powered> {
        self.0.lock().unwrap()
    }

    fn identify(&self) -> Device<Line> {
        Device::identify(Line { board: self.clone(), rest: Vec::new() }, PATIENCE, dimsart_modules::ALL)
            .unwrap()
    }

    fn restart(&self) -> Device<Line> {
        self.powered().bench.reset();
        self.powered().run_for(START_S);
        self.identify()
    }
}

impl Read for Line {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.rest.is_empty() {
            let mut powered = self.board.powered();
            (0..READ_PERIODS).for_each(|_| powered.period());
            self.rest = powered.received.drain(..).collect();
        }
        if self.rest.is_empty() {
            return Err(ErrorKind::WouldBlock.into());
        }
        let count = self.rest.as_slice().read(buffer)?;
        self.rest.drain(..count);
        Ok(count)
    }
}

impl Write for Line {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.board.powered().bench.send(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_configuration_that_is_set_is_taken_by_the_next_start_until_it_is_forgotten() {
    let Some(board) = Board::start() else { return };
    let mut device = board.identify();
    let image = device.motor().unwrap();
    assert_eq!(image.configuration, board.powered().drive.configuration);
    assert!(!image.is_stored && !image.is_restart_pending && image.fallback.is_none());

    let mut told = image.configuration;
    (told.joint.gear_ratio, told.joint.zero_rad, told.limits.current_a) = (-4.0, 0.5, 4.0);
    assert!(device.store_motor(&told).unwrap(), "its scheme runs, and the write would delay its ticks");
    let now = device.motor().unwrap();
    assert!(now.is_restart_pending && now.configuration == image.configuration);

    device.restart().unwrap();
    let kept = device.motor().unwrap();
    assert!(kept.is_stored && !kept.is_restart_pending && kept.fallback.is_none(), "{kept:?}");
    assert_eq!(kept.configuration, told);
    // The joint turns back by a quarter of the rotor's angle, relative to its start.
    board.powered().motor.set_rotor(0.3 + 2.0, 0.0);
    board.powered().run_for(0.05);
    let signals = device.signals(&["POSITION".to_owned()]).unwrap();
    let Some(DisplayValue::Real(position)) = signals.first().and_then(|signal| signal.values.first()) else {
        panic!("{signals:?}")
    };
    assert!(position.abs() < 0.01, "0.5 - 2 / 4: {position}");

    device.delete_motor().unwrap();
    let forgotten = board.restart().motor().unwrap();
    assert!(!forgotten.is_stored && forgotten.configuration == image.configuration);
    assert_eq!(board.powered().bench.violations(), [] as [&str; 0]);
}

#[test]
fn what_the_board_would_not_take_is_refused_and_nothing_is_kept() {
    let Some(board) = Board::start() else { return };
    let mut device = board.identify();
    let right = device.motor().unwrap().configuration;
    let mut too_much = right;
    too_much.limits.current_a = 50.0;
    let other_encoder = drive::Configuration { encoder: drive::Encoder::As5047p, ..right };
    for wrong in [too_much, other_encoder] {
        let refused = device.store_motor(&wrong).unwrap_err().to_string();
        assert!(refused.contains("out of range, or this board does not support"), "{refused}");
    }
    device.take_lease().unwrap();
    let refused = device.store_motor(&right).unwrap_err().to_string();
    assert!(refused.contains("at rest"), "{refused}");
    let refused = device.restart().unwrap_err().to_string();
    assert!(refused.contains("holds the lease"), "{refused}");
    device.release_lease().unwrap();
    assert!(!device.motor().unwrap().is_restart_pending);
    assert!(!board.restart().motor().unwrap().is_stored);
}

#[test]
fn a_board_without_a_drive_says_so() {
    let Some(shared) = Shared::start("nucleo-g474re") else { return };
    shared.run_for(0.1);
    let mut device = shared.identify();
    assert!(matches!(device.motor(), Err(ConnectError::NoDrive)));
    assert!(matches!(device.delete_motor(), Err(ConnectError::NoDrive)));
}

#[test]
fn a_board_identifies_its_motor_although_it_was_told_of_another_one() {
    let Some(board) = Board::start() else { return };
    let mut device = board.identify();
    let truth = device.motor().unwrap().configuration.motor;
    let mut told = device.motor().unwrap().configuration;
    (told.motor.pole_pairs, told.motor.resistance_ohm, told.motor.direct_inductance_h) = (4, 2.0, 1e-3);
    device.store_motor(&told).unwrap();
    let mut device = board.restart();
    device.set("COMM_RXMOD", "TIMEOUT_TICKS", "0").unwrap();
    let found = device.identify_motor(2.0, || {}).unwrap();
    eprintln!("{found:?}");
    let is_near = |found: f32, truth: f32, share: f32| (found / truth - 1.0).abs() < share;
    assert!(is_near(found.resistance_ohm, truth.resistance_ohm, 0.05), "{found:?}");
    assert!(is_near(found.direct_inductance_h, truth.direct_inductance_h, 0.05), "{found:?}");
    assert!(is_near(found.quadrature_inductance_h, truth.quadrature_inductance_h, 0.05), "{found:?}");
    assert_eq!((found.pole_pairs, found.is_encoder_reversed), (truth.pole_pairs, false));
    board.powered().run_for(0.01);
    assert!(!board.powered().is_on(), "the lease is released");
    assert_eq!(board.powered().bench.violations(), [] as [&str; 0]);
}

/// At 12 V dead time takes `4/3 * 0.016 * 12 V = 0.256 V`, as 12.8 A in 0.02 ohm do: less than 3.9 A cannot turn the rotor.
#[test]
fn a_motor_of_low_resistance_asks_for_the_current_that_identifies_it() {
    let Some(board) = Board::start() else { return };
    board.powered().set_resistance(0.02);
    let mut device = board.identify();
    let mut told = device.motor().unwrap().configuration;
    (told.limits.current_a, told.limits.trip_current_a) = (10.0, 20.0);
    device.store_motor(&told).unwrap();
    let mut device = board.restart();
    device.set("COMM_RXMOD", "TIMEOUT_TICKS", "0").unwrap();
    let error = device.identify_motor(2.0, || {}).unwrap_err();
    let ConnectError::Identification(IdentificationFailure::TooLittleCurrent(tenths)) = error else {
        panic!("{error}")
    };
    assert!(error.to_string().contains("request at least"), "{error}");
    let needed_a = f32::from(tenths) / 10.0;
    assert!((3.9..=10.0).contains(&needed_a), "{needed_a} A");
    let found = device.identify_motor(needed_a, || {}).unwrap();
    assert!((found.resistance_ohm / 0.02 - 1.0).abs() < 0.1, "{found:?}");
    assert_eq!(found.pole_pairs, told.motor.pole_pairs);
}

#[test]
fn a_rotor_that_is_held_is_told() {
    let Some(board) = Board::start() else { return };
    board.powered().lock(true);
    let mut device = board.identify();
    device.set("COMM_RXMOD", "TIMEOUT_TICKS", "0").unwrap();
    let error = device.identify_motor(2.0, || {}).unwrap_err();
    assert!(matches!(error, ConnectError::Identification(IdentificationFailure::DidNotMove)), "{error}");
    board.powered().run_for(0.01);
    assert!(!board.powered().is_on());
}
