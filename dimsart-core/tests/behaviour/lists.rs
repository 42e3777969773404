//! Lists of module kinds: of an image, several joined, and a missing kind.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use dimsart_core::{
    AxisKind, Command, CommandError, DeviceDescriptor, Dimsart, ModuleKinds, ModuleRef, ProvidedMemory,
    Value, join_kinds, kinds, types,
};
use dimsart_modules::{CONTROL, P};

const P_ALONE: ModuleKinds = kinds![P];
const TWO_LISTS: ModuleKinds = join_kinds![P_ALONE, CONTROL];

fn controller(list: ModuleKinds) -> Dimsart {
    let (outputs, inputs) = (&[types::POSITION, types::DES_POSITION], &[types::DES_FORCE]);
    let device = DeviceDescriptor::new("arm", &[AxisKind::Linear; 3], 1e-3, outputs, inputs);
    Dimsart::new(ProvidedMemory::leak_default(), device.unwrap(), list).unwrap()
}

#[test]
fn a_kind_that_the_list_lacks_is_refused_by_its_id() {
    let mut dimsart = controller(P_ALONE);
    let module = ModuleRef::new("PDCTRL_MOD", 1);
    for command in [
        Command::PlugIn(module),
        Command::InitModule(module),
        Command::set(module, 0, Value::Real(1.0)),
        Command::bind(module, 0, types::POSITION.first()),
    ] {
        assert_eq!(dimsart.command(command), Err(CommandError::UnknownModule(module)), "{command:?}");
        assert_eq!(dimsart.engine().instances().count(), 0);
    }
    assert_eq!(P_ALONE.describe_parameter(module.kind, 0), None);
    assert_eq!((P_ALONE.module("PDCTRL_MOD"), P_ALONE.module_name(module).name), (None, "?"));
}

#[test]
fn joined_lists_have_the_kinds_of_each_in_order() {
    let names: Vec<&str> = TWO_LISTS.list().iter().map(|kind| kind.name).collect();
    assert_eq!(names, ["PCTRL_MOD", "PDCTRL_MOD", "PIDCTRL_MOD", "VWALL_MOD"]);
    let mut dimsart = controller(TWO_LISTS);
    for name in ["PCTRL_MOD", "PDCTRL_MOD"] {
        let module = TWO_LISTS.module(name).unwrap();
        assert_eq!(dimsart.command(Command::PlugIn(module)), Ok(()));
        assert_eq!(dimsart.command(Command::Unplug(module)), Ok(()));
    }
}

#[test]
#[should_panic(expected = "two module kinds have the same id")]
fn a_list_with_the_same_kind_twice_is_refused() {
    // In a constant this is a build error.
    let first = P_ALONE.list()[0];
    let _ = ModuleKinds::new(vec![first, first].leak());
}
