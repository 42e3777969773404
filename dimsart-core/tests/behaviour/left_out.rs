//! Kinds of modules that an image is built without.

use dimsart_core::limits::DEFAULT_WORDS;
use dimsart_core::modules::{ALL, P};
use dimsart_core::{
    AxisKind, Command, CommandError, DeviceDescriptor, Engine, Kind, Kinds, ModuleRef, Value, types,
};

/// A list whose second kind was left out.
const LEAN: Kinds = Kinds::new(&[&Kind::of::<P>(), Kind::LEFT_OUT]);

fn engine() -> Option<Engine<[u32; DEFAULT_WORDS]>> {
    let (outputs, inputs) = (&[types::POSITION, types::DES_POSITION], &[types::DES_FORCE]);
    DeviceDescriptor::new("arm", &[AxisKind::Linear; 3], 1e-3, outputs, inputs)
        .ok()
        .map(|device| Engine::<[u32; DEFAULT_WORDS]>::new(device, LEAN))
}

#[test]
fn a_kind_that_is_left_out_has_a_number_and_is_refused() {
    let mut engine = engine().unwrap();
    let module = ModuleRef { kind: 1, number: 1 };
    assert_eq!(LEAN.module_name(module).name, "?");
    assert_eq!([LEAN.module("PDCTRL_MOD"), LEAN.module("")], [None; 2]);
    for command in [
        Command::PlugIn(module),
        Command::InitModule(module),
        Command::set(module, 0, Value::Real(1.0)),
        Command::bind(module, 0, types::POSITION.first()),
    ] {
        assert_eq!(engine.command(command), Err(CommandError::UnknownModule(module)), "{command:?}");
        assert_eq!(engine.instances().count(), 0);
    }
    assert_eq!(LEAN.describe_parameter(module.kind, 0), None);
    assert_eq!(engine.ports(module).map(|ports| ports.len()), Some(0));
}

#[test]
fn the_others_work_as_ever() {
    let mut engine = engine().unwrap();
    let module = LEAN.module("PCTRL_MOD").unwrap();
    assert_eq!(engine.command(Command::PlugIn(module)), Ok(()));
    assert_eq!(engine.command(Command::Check), Ok(()));
}

#[test]
fn the_library_is_whole_where_its_groups_are() {
    assert!(ALL.list().iter().all(|kind| kind.is_there()));
}
