//! A controller that is connected to a device, and reconnected.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

use dimsart_core::ProvidedMemory;
use dimsart_core::{
    AxisKind, Command, CommandError, DeviceDescriptor, Dimsart, Observer, StorageError, TickResult, Word,
    limits::Capacities, memory, types,
};
use dimsart_modules::ALL;

fn device(axes: usize) -> DeviceDescriptor {
    let axes = &[AxisKind::Linear; 8][..axes];
    DeviceDescriptor::new("arm", axes, 1e-3, &[types::POSITION], &[types::DES_FORCE]).unwrap()
}

fn run(dimsart: &mut Dimsart) -> Result<(), CommandError> {
    let pd = ALL.module("PDCTRL_MOD").unwrap();
    dimsart.command(Command::bind(pd, 1, types::POSITION.first()))?;
    dimsart.command(Command::PlugIn(pd))?;
    dimsart.command(Command::Check)
}

#[test]
fn a_tick_without_a_device_is_idle() {
    let mut dimsart = Dimsart::without_device(ProvidedMemory::leak_default());
    assert_eq!(dimsart.tick(&[], &mut []), TickResult::Idle);
    assert_eq!(dimsart.engine().usage().slots, 0);
}

/// Counts calls.
struct Calls(usize);

impl Observer for Calls {
    fn call(&mut self, _: usize, call: impl FnOnce()) {
        call();
        self.0 += 1;
    }
}

#[test]
fn an_observer_makes_every_call_of_a_tick_and_none_while_idle() {
    let mut dimsart = Dimsart::new(ProvidedMemory::leak_default(), device(1), ALL).unwrap();
    let mut observer = Calls(0);
    let mut commanded = [Word(0)];
    assert_eq!(dimsart.tick_observed(&[Word(0)], &mut commanded, &mut observer), TickResult::Idle);
    assert_eq!(observer.0, 0);
    run(&mut dimsart).unwrap();
    assert_eq!(dimsart.tick_observed(&[Word(0)], &mut commanded, &mut observer), TickResult::Ran);
    assert_eq!(observer.0, dimsart.engine().steps().count());
}

#[test]
fn connecting_again_starts_anew() {
    let mut dimsart = Dimsart::new(ProvidedMemory::leak_default(), device(3), ALL).unwrap();
    run(&mut dimsart).unwrap();
    assert_eq!(dimsart.tick(&[Word(0); 3], &mut [Word(0); 3]), TickResult::Ran);
    dimsart.connect(device(2), ALL).unwrap();
    assert_eq!(dimsart.tick(&[Word(0); 2], &mut [Word(0); 2]), TickResult::Idle);
    assert_eq!(
        dimsart.engine().usage(),
        Dimsart::new(ProvidedMemory::leak_default(), device(2), ALL).unwrap().engine().usage()
    );
    run(&mut dimsart).unwrap();
    assert_eq!(dimsart.tick(&[Word(0); 2], &mut [Word(0); 2]), TickResult::Ran);
}

#[test]
fn a_device_that_does_not_fit_leaves_the_controller_unconnected() {
    type FourWords = memory!(Capacities { words: 4, ..Capacities::DEFAULT });
    let memory = Box::leak(Box::new(FourWords::new()));
    let mut dimsart = Dimsart::new(memory, device(2), ALL).unwrap();
    let no_room = StorageError::OutOfMemory { wanted: 3, free: 1 };
    assert_eq!(dimsart.connect(device(3), ALL), Err(no_room));
    assert_eq!(dimsart.tick(&[], &mut []), TickResult::Idle);
    assert_eq!((dimsart.engine().usage().words, dimsart.engine().device().dof()), (0, 0));
    dimsart.connect(device(2), ALL).unwrap();
}
