//! Laws as text: what they come to, what is refused, and that they have the bits of the same law in Rust.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "in helpers of tests as in tests"
)]

mod errors;
mod expressions;
mod laws;
mod names;

use dimsart_core::{
    AxisKind, Command, DeviceDescriptor, Dimsart, ModuleRef, ProvidedMemory, TickResult, Value, Word, types,
};
use dimsart_modules::ALL;
use hil_sim::law::Law;

/// A controller of an arm with so many axes, without a module.
pub(crate) fn controller(dof: usize) -> Dimsart {
    let axes = [AxisKind::Rotary; 8];
    let outputs = &[types::POSITION, types::VELOCITY, types::DES_POSITION];
    let device = DeviceDescriptor::new("arm", &axes[..dof], 1e-3, outputs, &[types::DES_FORCE]);
    Dimsart::new(ProvidedMemory::leak_default(), device.unwrap(), ALL).unwrap()
}

pub(crate) fn module(name: &str) -> ModuleRef {
    ALL.module(name).unwrap()
}

/// Gives a controller a law.
pub(crate) fn keep(dimsart: &mut Dimsart, number: u8, law: &Law) {
    for command in law.commands(number) {
        dimsart.command(command).unwrap_or_else(|error| panic!("{command:?}: {error:?}"));
    }
}

/// Has a controller run a law, with these commands to its module before.
pub(crate) fn run(dimsart: &mut Dimsart, law: &Law, parameters: &[(u8, Option<u8>, f32)]) {
    keep(dimsart, 1, law);
    let module = module("ONLINE_MOD");
    let mut commands = vec![Command::set(module, 0, Value::Count(1))];
    let set = |(parameter, entry, value): &(u8, Option<u8>, f32)| Command::Set {
        module,
        parameter: *parameter,
        entry: *entry,
        value: Value::Real(*value),
    };
    commands.extend(parameters.iter().map(set));
    commands.extend([Command::PlugIn(module), Command::Check]);
    for command in commands {
        dimsart.command(command).unwrap_or_else(|error| panic!("{command:?}: {error:?}"));
    }
}

/// A tick with these measurements, a type behind the other; gives the forces.
pub(crate) fn tick(dimsart: &mut Dimsart, measured: &[f32]) -> Vec<f32> {
    let measured: Vec<Word> = measured.iter().copied().map(Word::from).collect();
    let mut forces = vec![Word(0); dimsart.engine().device().dof()];
    assert_eq!(dimsart.tick(&measured, &mut forces), TickResult::Ran);
    forces.into_iter().map(|word| f32::from_bits(word.0)).collect()
}
