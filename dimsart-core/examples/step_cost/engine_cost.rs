//! Benchmark schemes: dependence of a step's cost on the sizes.

use dimsart_core::limits::Capacities;
use dimsart_core::{
    AxisKind, Command, Context, DataType, DeviceDescriptor, Dimsart, Module, ModuleKinds, ModuleRef,
    ProvidedMemory, memory, scheme, types,
};
use dimsart_modules::{self as modules, ALL};

/// A module that does nothing, so that only the engine's call costs.
#[derive(Debug)]
pub(crate) struct Empty;

impl Module for Empty {
    const NAME: &'static str = "EMPTY_MOD";
    const SUMMARY: &'static str = "Does nothing.";

    type Settings = ();
    type Gains = ();
    type State = ();
    type AxisState = ();
    type Ports = ();

    fn compute(_: &Context<'_, Self>) {}
}

/// The standard modules and the empty one, so that the engine searches the usual number of kinds.
const WITH_EMPTY: ModuleKinds = dimsart_core::kinds![
    modules::CommRx,
    modules::CommTx,
    modules::WaveTransformer,
    modules::WaveImpedance,
    modules::TimeDelay,
    modules::P,
    modules::Pd,
    modules::Pid,
    modules::VirtualWall,
    modules::Sum,
    modules::Normalizer,
    modules::Integrator,
    modules::Differentiator,
    modules::VelocityToPosition,
    modules::SignalGenerator,
    modules::Recorder,
    Empty
];

const FEW: &[&DataType] = &[types::POSITION, types::DES_POSITION];
const MANY: &[&DataType] = &[
    types::FORCE,
    types::VELOCITY,
    types::DES_VELOCITY,
    types::LINE_FORCE,
    types::LINE_VELOCITY,
    types::CONTROL_STIFFNESS,
    types::POSITION,
    types::DES_POSITION,
];

/// Marks the code that callgrind counts: the engine's step.
#[inline(never)]
fn counted_step(dimsart: &mut Dimsart) {
    dimsart.engine_mut().step();
}

fn robot(
    memory: impl Into<ProvidedMemory>,
    kinds: ModuleKinds,
    dof: usize,
    types: &'static [&'static DataType],
) -> Dimsart {
    let axes = [AxisKind::Linear; 8];
    let axes = axes.get(..dof).expect("1 to 8 axes");
    let device = DeviceDescriptor::new("robot", axes, 1e-3, types, &[]).expect("a sound device");
    Dimsart::new(memory, device, kinds).expect("an empty Data Base")
}

/// `modules` empty modules.
pub(crate) fn run_empty(modules: u8, ticks: u32) {
    let mut dimsart = robot(ProvidedMemory::leak_default(), WITH_EMPTY, 3, FEW);
    for number in 1..=modules {
        let module = ModuleRef::new(Empty::NAME, number);
        dimsart.command(Command::PlugIn(module)).expect("room for the module");
    }
    dimsart.command(Command::Check).expect("a sound scheme");
    (0..ticks).for_each(|_| counted_step(&mut dimsart));
}

/// Description of a scheme of P controllers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scheme {
    pub(crate) active: u8,
    pub(crate) inactive: u8,
    pub(crate) dof: usize,
    /// Whether the device has types that no module uses, in the slots before those in use.
    pub(crate) has_many_types: bool,
    /// Whether the Data Base is sixteen times the default size.
    pub(crate) has_large_data_base: bool,
}

/// Steps a scheme of P controllers, each with its own output.
pub(crate) fn run_scheme(scheme: Scheme, ticks: u32) {
    type LargeMemory = memory!(Capacities { words: 32_768, ..Capacities::DEFAULT });
    let memory = if scheme.has_large_data_base {
        Box::leak(Box::new(LargeMemory::new())).into()
    } else {
        ProvidedMemory::leak_default()
    };
    let mut dimsart = robot(memory, ALL, scheme.dof, if scheme.has_many_types { MANY } else { FEW });
    let mut rows = String::new();
    for number in 1..=scheme.inactive {
        rows += &format!("all PCTRL_MOD.{} K_PARAM 1\n", scheme.active + number);
    }
    for number in 1..=scheme.active {
        rows += &format!("all PCTRL_MOD.{number} PORT_DES_FORCE DES_FORCE.{number}\n");
        rows += &format!("all MOD_ENG MOD_ON PCTRL_MOD.{number}\n");
    }
    rows += "all MOD_ENG MATCHING_CHECK\n";
    let faults = scheme::load(&rows, "all", &[], &mut dimsart, |error| eprintln!("{error:?}"));
    assert_eq!(faults, 0, "the scheme does not load");
    (0..ticks).for_each(|_| counted_step(&mut dimsart));
}
