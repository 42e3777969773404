//! The Module Engine: keeps the modules, steps them, takes commands.

mod commands;
mod observer;
mod plug;

pub use commands::Cursor;
use core::num::NonZeroU32;

use heapless::Vec;
pub use observer::Observer;

use crate::command::{Command, CommandError, ModuleRef, PORT, Target, Verb};
use crate::data::Data;
use crate::data_base::DataBase;
use crate::data_type::TypeRef;
use crate::device::{DeviceDescriptor, Served};
use crate::limits::{DEFAULT_WORDS, MAX_MODULES, MAX_PORTS};
use crate::matching::{Difference, Finding, Report, Scheme};
use crate::module::{Compute, ModuleList};
use crate::modules::{self, Standard};
use crate::parameter::{Parameter, ParameterError, Parameters, Value};
use crate::port::{Direction, LinkEnd, PortSpec, PortSpecs, Ports, Stage};
use crate::schedule::{MAX_CALLS, schedule};
use crate::storage::Block;
use crate::unit_tie::UnitTie;

/// A module that exists, plugged in or not.
#[derive(Debug)]
pub(crate) struct Instance<M> {
    pub(crate) reference: ModuleRef,
    module: M,
    bindings: Vec<(&'static str, TypeRef), MAX_PORTS>,
    pub(crate) link_end: Option<LinkEnd>,
    /// Empty while the module is not plugged in.
    pub(crate) ports: Vec<Port, MAX_PORTS>,
    is_active: bool,
}

/// A port of a module that is plugged in.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Port {
    pub(crate) name: &'static str,
    pub(crate) slot: u8,
    /// None for memory.
    pub(crate) signal: Option<TypeRef>,
    pub(crate) is_written: bool,
    pub(crate) stage: Stage,
    pub(crate) is_delayed: bool,
    pub(crate) difference: Option<Difference>,
    pub(crate) tie: Option<UnitTie>,
}

impl Port {
    /// How it uses its signal.
    pub(crate) fn direction(&self) -> Direction {
        if self.is_written { Direction::Write } else { Direction::Read }
    }
}

/// One call of a module in a tick.
#[derive(Debug)]
pub(crate) struct Call<M> {
    pub(crate) instance: u8,
    pub(crate) stage: Stage,
    compute: Compute<M>,
}

impl<M: ModuleList> Call<M> {
    /// Of the instance with this number.
    pub(crate) fn new(instance: u8, stage: Stage, instances: &[Instance<M>]) -> Option<Self> {
        let module = &instances.get(usize::from(instance))?.module;
        let compute = match stage {
            Stage::Early => module.compute(),
            Stage::Late => module.compute_late(),
        };
        Some(Self { instance, stage, compute })
    }
}

/// The calls of a tick, with the modules they go to.
#[derive(Debug)]
pub struct Calls<'a, M> {
    instances: &'a mut [Instance<M>],
    schedule: &'a [Call<M>],
}

impl<M: ModuleList> Calls<'_, M> {
    /// Makes every call, in order.
    #[inline]
    pub fn run(self, data: &Data<'_>) {
        self.run_observed(data, &mut ());
    }

    /// As [`run`](Self::run), while an observer looks on.
    #[inline]
    pub fn run_observed(self, data: &Data<'_>, observer: &mut impl Observer) {
        for call in self.schedule {
            if let Some(instance) = self.instances.get_mut(usize::from(call.instance)) {
                observer.call(|| (call.compute)(&mut instance.module, data));
            }
        }
    }
}

/// One call of the tick, as reports show it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    /// The module.
    pub module: ModuleRef,
    /// Which of its stages.
    pub stage: Stage,
}

/// What a scheme takes of the statically sized storage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Usage {
    /// Module instances, of [`MAX_MODULES`].
    pub modules: usize,
    /// Slots of the Data Base, of [`MAX_SLOTS`](crate::limits::MAX_SLOTS).
    pub slots: usize,
    /// Words of the Data Base that are taken.
    pub words: usize,
    /// Words of the Data Base in all.
    pub words_in_all: usize,
}

/// Modules, their Data Base and the device they serve.
///
/// All of it is statically sized: `WORDS` words of Data Base, [`MAX_MODULES`] modules. Commands are
/// given between ticks and take bounded time; [`step`](Self::step) cannot fail.
#[derive(Debug)]
pub struct Engine<M = Standard, const WORDS: usize = DEFAULT_WORDS> {
    device: Served,
    data_base: DataBase<WORDS>,
    instances: Vec<Instance<M>, MAX_MODULES>,
    plug_in_order: Vec<u8, MAX_MODULES>,
    schedule: Vec<Call<M>, MAX_CALLS>,
    place_before: Option<ModuleRef>,
    limit_cycles: Option<NonZeroU32>,
    is_running: bool,
}

impl<M: ModuleList, const WORDS: usize> Engine<M, WORDS> {
    /// An engine without modules, for a device.
    #[must_use]
    pub fn new(device: DeviceDescriptor) -> Self {
        let mut engine = Self::unconnected();
        engine.connect(device);
        engine
    }

    /// An engine that serves no device yet. All zero bits: a static one takes no room in an image.
    #[must_use]
    pub const fn unconnected() -> Self {
        Self {
            device: Served(None),
            data_base: DataBase::new(),
            instances: Vec::new(),
            plug_in_order: Vec::new(),
            schedule: Vec::new(),
            place_before: None,
            limit_cycles: None,
            is_running: false,
        }
    }

    /// Computes every module that is plugged in once, in order. Does nothing unless the scheme runs.
    #[doc(alias = "Module_Step")]
    pub fn step(&mut self) {
        self.step_observed(&mut ());
    }

    /// As [`step`](Self::step), while an observer looks on: it makes each of the [`steps`](Self::steps), in order.
    #[inline]
    pub fn step_observed(&mut self, observer: &mut impl Observer) {
        if !self.is_running {
            return;
        }
        let Some(device) = &self.device.0 else { return };
        let data = self.data_base.view(device);
        let calls = Calls { instances: &mut self.instances, schedule: &self.schedule };
        observer.look_on(calls, &data);
    }

    /// Takes a command to the engine or to a module.
    ///
    /// # Errors
    /// [`CommandError`] says why the command was refused; nothing has changed then.
    #[doc(alias = "ModuleCmd")]
    pub fn command(&mut self, command: Command) -> Result<(), CommandError> {
        match (command.module, command.value) {
            (Target::Engine, value) => {
                let verb =
                    Verb::from_number(command.param).ok_or(CommandError::UnknownVerb(command.param))?;
                self.engine_command(verb, value)
            }
            (Target::Module(module), Value::Type(signal)) if command.param >= PORT => {
                self.bind(module, command.param - PORT, signal)
            }
            (Target::Module(_), _) if command.param >= PORT => Err(CommandError::WrongValue),
            (Target::Module(module), value) => self.set(module, command.param, command.axis, value),
        }
    }

    /// Value of a module's parameter; of axis `axis` if each axis has its own.
    ///
    /// # Errors
    /// [`CommandError`] when the module or the parameter does not exist.
    pub fn get(&mut self, module: ModuleRef, parameter: u8, axis: u8) -> Result<Value, CommandError> {
        let instance = self.instance(module).ok_or(CommandError::NotPluggedIn(module))?;
        let mut found = None;
        instance.module.parameters(&mut Parameters::get(parameter, axis, &mut found));
        found.ok_or(CommandError::Parameter(ParameterError::Unknown))
    }

    /// Checks the scheme as it is plugged in now. Changes nothing.
    #[doc(alias = "Types matching check")]
    #[must_use]
    pub fn check(&self) -> Report {
        let mut report = Report::default();
        self.check_without(None, &mut report);
        report
    }

    /// The first fault of the scheme without a module, or with all. Apart from what is done with it: the report
    /// is off the stack by then.
    #[inline(never)]
    pub(crate) fn first_fault(&self, without: Option<ModuleRef>) -> Option<Finding> {
        let mut report = Report::default();
        self.check_without(without, &mut report);
        report.findings().iter().copied().find(Finding::is_fault)
    }

    /// Finding `index` of the scheme, and the number of its faults.
    #[inline(never)]
    pub(crate) fn finding(&self, index: u8) -> (Option<Finding>, usize) {
        let mut report = Report::default();
        self.check_without(None, &mut report);
        (report.findings().get(usize::from(index)).copied(), report.faults())
    }

    /// Whether the scheme passed its check and runs.
    #[must_use]
    pub fn is_running(&self) -> bool {
        self.is_running
    }

    /// The device; before it is connected, one without axes and types.
    #[must_use]
    pub fn device(&self) -> &DeviceDescriptor {
        &self.device
    }

    /// Starts anew for a device: no modules, and nothing in the Data Base.
    pub(crate) fn connect(&mut self, device: DeviceDescriptor) {
        self.disconnect();
        self.device = Served(Some(device));
    }

    /// Serves no device any more.
    pub(crate) fn disconnect(&mut self) {
        self.close_all();
        self.data_base.clear();
        self.device = Served(None);
    }

    /// The Data Base.
    #[must_use]
    pub fn data_base(&self) -> &DataBase<WORDS> {
        &self.data_base
    }

    pub(crate) fn data_base_mut(&mut self) -> &mut DataBase<WORDS> {
        &mut self.data_base
    }

    /// The calls of a tick, in order.
    pub fn steps(&self) -> impl Iterator<Item = Step> + '_ {
        self.schedule.iter().filter_map(|call| {
            let instance = self.instances.get(usize::from(call.instance))?;
            Some(Step { module: instance.reference, stage: call.stage })
        })
    }

    /// The signals that a step reads or writes.
    pub fn step_signals(&self, step: Step) -> impl Iterator<Item = (TypeRef, Direction)> + '_ {
        let instance = self.instances.iter().find(|instance| instance.reference == step.module);
        let ports = instance.map(|instance| instance.ports.iter()).into_iter().flatten();
        ports
            .filter(move |port| port.stage == step.stage)
            .filter_map(|port| port.signal.map(|signal| (signal, port.direction())))
    }

    /// Every module that exists, plugged in or not.
    pub fn instances(&self) -> impl Iterator<Item = ModuleRef> + '_ {
        self.instances.iter().map(|instance| instance.reference)
    }

    /// Whether a module is plugged in.
    #[must_use]
    pub fn is_plugged_in(&self, module: ModuleRef) -> bool {
        self.instances.iter().any(|instance| instance.reference == module && instance.is_active)
    }

    /// The channel that a module listens to on a link; 0 while none does.
    pub(crate) fn listening_channel(&self, link: usize) -> u16 {
        let active = self.instances.iter().filter(|instance| instance.is_active);
        let mut ends = active.filter_map(|instance| instance.link_end);
        ends.find(|end| end.listens_to(link)).map_or(0, |end| end.channel)
    }

    /// The first memory of a module that is plugged in, for example what a recorder has recorded.
    #[must_use]
    pub fn memory(&self, module: ModuleRef) -> Option<&[u32]> {
        let instance = self.instances.iter().find(|instance| instance.reference == module)?;
        let port = instance.ports.iter().find(|port| port.signal.is_none())?;
        Some(self.data_base.words(port.slot))
    }

    /// What is taken of the static storage.
    #[must_use]
    pub fn usage(&self) -> Usage {
        Usage {
            modules: self.instances.len(),
            slots: self.data_base.taken_slots(),
            words: WORDS - self.data_base.free_words(),
            words_in_all: WORDS,
        }
    }

    /// What a tick may take, in processor cycles: a module that could make it longer is not plugged in. None, as at
    /// first: as long as it likes. Modules that are plugged in stay.
    pub fn limit_cycles(&mut self, limit: Option<NonZeroU32>) {
        self.limit_cycles = limit;
    }

    /// What a tick takes at most with the modules that are plugged in, in processor cycles: [`TICK`](modules::TICK)
    /// and the [cost](crate::Cost) of each. None if one's is not known.
    #[must_use]
    pub fn tick_cycles(&self) -> Option<u32> {
        let active = self.instances.iter().filter(|instance| instance.is_active);
        let mut costs = active.map(|instance| self.cycles_of(instance.reference.kind));
        costs.try_fold(modules::TICK.cycles(self.device.dof()), |sum, cycles| Some(sum + cycles?))
    }

    /// What a module of a kind adds to a tick of this device, in processor cycles; none if that is not known.
    #[must_use]
    pub fn cycles_of(&self, kind: u8) -> Option<u32> {
        M::KINDS.get(usize::from(kind))?.cost.map(|cost| cost.cycles(self.device.dof()))
    }

    /// Describes parameter `index` of a kind of module; none past the last one.
    #[must_use]
    #[inline(never)]
    pub fn describe_parameter(kind: u8, index: u8) -> Option<Parameter> {
        let mut found = None;
        M::create(kind)?.parameters(&mut Parameters::describe(index, &mut found));
        found
    }

    /// The ports of a module as its parameters are now; as by default for one that does not exist.
    #[must_use]
    pub fn ports(&mut self, module: ModuleRef) -> Option<Vec<PortSpec, MAX_PORTS>> {
        let mut specs = Vec::new();
        self.declare(module, &mut specs).then_some(specs)
    }

    /// One of the [`ports`](Self::ports).
    #[inline(never)]
    pub(crate) fn port(&mut self, module: ModuleRef, index: u8) -> Option<PortSpec> {
        let mut specs = Vec::new();
        self.declare(module, &mut specs).then_some(())?;
        specs.get(usize::from(index)).copied()
    }

    fn declare(&mut self, module: ModuleRef, specs: &mut PortSpecs) -> bool {
        match self.instances.iter_mut().find(|instance| instance.reference == module) {
            Some(instance) => instance.declare(&self.device, &self.data_base, specs),
            None => declare_default::<M>(module.kind, &self.device, specs),
        }
    }

    /// Name of a port of a module that is plugged in.
    #[must_use]
    pub fn port_name(&self, module: ModuleRef, port: u8) -> Option<&'static str> {
        let instance = self.instances.iter().find(|instance| instance.reference == module)?;
        instance.ports.get(usize::from(port)).map(|port| port.name)
    }

    /// Where a port is bound to, if a command said so.
    #[must_use]
    pub fn binding(&self, module: ModuleRef, port_name: &str) -> Option<TypeRef> {
        let instance = self.instances.iter().find(|instance| instance.reference == module)?;
        instance.bound(port_name)
    }

    /// Into an empty report: it is large, and would be copied.
    #[inline(never)]
    fn check_without(&self, without: Option<ModuleRef>, report: &mut Report) {
        let Self { device, instances, schedule, .. } = self;
        let signals = self.data_base.signals().map(|(slot, entry)| (slot, entry.signal));
        Scheme { device, instances, schedule, without }.check(signals, report);
    }

    fn reschedule(&mut self) {
        self.schedule = schedule(&self.instances, &self.plug_in_order);
    }
}

impl<M: ModuleList> Instance<M> {
    fn new(reference: ModuleRef) -> Option<Self> {
        let module = M::create(reference.kind).filter(|_| reference.number > 0)?;
        let (bindings, ports) = (Vec::new(), Vec::new());
        Some(Self { reference, module, bindings, link_end: None, ports, is_active: false })
    }

    /// Asks the module for its ports, false if there are too many; its handles stay as they are.
    fn declare<const WORDS: usize>(
        &mut self,
        device: &DeviceDescriptor,
        data_base: &DataBase<WORDS>,
        specs: &mut PortSpecs,
    ) -> bool {
        let has_all = declare(&mut self.module, device, specs);
        self.connect(device, data_base);
        has_all
    }

    /// Gives the module the handles of its ports.
    fn connect<const WORDS: usize>(&mut self, device: &DeviceDescriptor, data_base: &DataBase<WORDS>) {
        let blocks: Vec<Block, MAX_PORTS> =
            self.ports.iter().map(|port| data_base.storage().block(port.slot)).collect();
        let mut ports = Ports::connect(device, &blocks);
        self.module.activate(&mut ports);
        self.link_end = ports.link_end();
    }

    fn bound(&self, port_name: &str) -> Option<TypeRef> {
        self.bindings.iter().find(|(name, _)| *name == port_name).map(|(_, signal)| *signal)
    }
}

fn declare<M: ModuleList>(module: &mut M, device: &DeviceDescriptor, specs: &mut PortSpecs) -> bool {
    let mut ports = Ports::declare(device, specs);
    module.activate(&mut ports);
    ports.has_all()
}

/// As a module of this kind declares them by default; false if there is none. Apart from what is done with
/// the ports: the module is off the stack by then.
#[inline(never)]
fn declare_default<M: ModuleList>(kind: u8, device: &DeviceDescriptor, specs: &mut PortSpecs) -> bool {
    M::create(kind).is_some_and(|mut module| declare(&mut module, device, specs))
}
