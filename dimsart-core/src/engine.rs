//! Module Engine: stores the modules, runs them and executes commands.

mod commands;
mod containment;
mod costs;
mod kinds;
mod laws;
mod observer;
mod parameters;
mod plug;
mod transaction;
mod vocabulary;

pub use commands::CommandCursor;
pub use containment::{FaultCause, ModuleFault};
use core::num::NonZeroU32;
pub use kinds::ModuleKinds;
pub use vocabulary::type_at;

pub use observer::{Calls, Observer};

use crate::data_base::{DataBase, Dof};
use crate::device::{Counter, DeviceDescriptor, Served};
use crate::memory::ProvidedMemory;
use crate::module::{Costs, Direction, KindId, ModuleKind, ModuleRef, Rate, Stage};
use crate::scheme::{CheckReport, Command, CommandError, Finding, MatchingCheck, Scheme, Schemes, Wiring};
use crate::signal::TypeRef;
use transaction::Transaction;

/// One call in a tick, for reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    /// The module.
    pub module: ModuleRef,
    /// The stage of the module.
    pub stage: Stage,
}

/// Use of the static storage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Usage {
    /// Module instances in use.
    pub modules: usize,
    /// Slots of the Data Base in use.
    pub slots: usize,
    /// Words of the Data Base in use.
    pub words: usize,
    /// Total words of the Data Base.
    #[serde(rename = "words_in_all")]
    pub total_words: usize,
}

/// Modules, their Data Base and the device.
///
/// All data are in [memory](crate::ControllerMemory) that the application provides. Commands are given
/// between ticks and take bounded time; [`step`](Self::step) cannot fail.
///
/// A change of the scheme is prepared in a pending copy, checked, and applied atomically between two ticks. A
/// single command is such a change; [`Command::Begin`] starts a change of several commands.
#[derive(Debug)]
pub struct Engine {
    device: Served,
    dof: Dof,
    kinds: ModuleKinds,
    schemes: Schemes,
    transaction: Transaction,
    /// Whether the pending scheme has passed its check and has not changed since.
    is_checked: bool,
    /// Whether words of the Data Base have moved and handles and calls must be updated.
    has_moved: bool,
    limit_cycles: Option<NonZeroU32>,
    costs: Option<Costs>,
    counter: Option<Counter>,
    spare_cycles: u32,
    is_running: bool,
    /// Whether any module initialises its state at its next call.
    begins: bool,
    /// Failed modules, which are isolated together with their dependents; one bit per place in the plug-in
    /// order.
    failed: u32,
    data_base: DataBase,
}

impl Engine {
    /// Creates an engine without modules in this memory, for a device and the available module kinds.
    #[must_use]
    pub fn new(memory: impl Into<ProvidedMemory>, device: DeviceDescriptor, kinds: ModuleKinds) -> Self {
        let mut engine = Self::unconnected(memory.into());
        engine.connect(device, kinds);
        engine
    }

    /// Creates an engine without a device.
    #[inline]
    pub(crate) fn unconnected(memory: ProvidedMemory) -> Self {
        let ProvidedMemory { schemes, data_base } = memory;
        Self {
            device: Served(None),
            dof: Dof::One,
            kinds: ModuleKinds::NONE,
            schemes,
            transaction: Transaction::None,
            is_checked: false,
            has_moved: false,
            limit_cycles: None,
            costs: None,
            counter: None,
            spare_cycles: 0,
            is_running: false,
            begins: false,
            failed: 0,
            data_base,
        }
    }

    fn kind(&self, id: KindId) -> Option<&'static ModuleKind> {
        self.kinds().kind(id)
    }

    /// Returns the available module kinds; none before a device is connected.
    #[must_use]
    pub fn kinds(&self) -> ModuleKinds {
        self.kinds
    }

    /// Runs every module that is plugged in once, in order. Does nothing unless the scheme runs.
    ///
    /// A module that writes an invalid value is isolated in the same tick, together with its dependents: see
    /// [`module_fault`](Self::module_fault).
    #[doc(alias = "Module_Step")]
    pub fn step(&mut self) {
        self.step_observed(&mut ());
    }

    /// As [`step`](Self::step), with an observer that makes each of the [`steps`](Self::steps), in order.
    #[inline]
    pub fn step_observed(&mut self, observer: &mut impl Observer) {
        if !self.is_running {
            return;
        }
        let Some(device) = &self.device.0 else { return };
        let data = self.data_base.view(device, self.dof);
        let wiring = &mut self.schemes.running_mut().wiring;
        let resting = wiring.resting();
        let failed = &mut self.failed;
        let counter = self.counter.as_ref();
        observer.observe_step(Calls { wiring, begins: self.begins, resting, counter, failed }, &data);
        if self.begins {
            self.begins = false;
            wiring.has_begun();
        }
    }

    /// Executes a command to the engine or to a module.
    ///
    /// # Errors
    /// [`CommandError`] gives the reason; nothing has changed.
    #[doc(alias = "ModuleCmd")]
    #[inline(never)]
    pub fn command(&mut self, command: Command) -> Result<(), CommandError> {
        let done = self.carry_out(command);
        self.follow_moves();
        done
    }

    fn carry_out(&mut self, command: Command) -> Result<(), CommandError> {
        match command {
            Command::Begin => return self.open_transaction(),
            Command::Commit => return self.commit(),
            Command::Abort => return self.abort(),
            Command::Check => return self.check_and_start(),
            Command::ResetModule(module) => {
                self.schemes.running().instance(module).ok_or(CommandError::NotPluggedIn(module))?;
                self.begin_anew(|found| found == module);
            }
            Command::Reset => self.reset(),
            Command::Stop => self.stop(),
            Command::Close | Command::Init => self.close_all(),
            Command::UploadLaw { .. } | Command::StoreLaw { .. } | Command::RemoveLaw { .. } => {
                return self.change_law(command).map_err(CommandError::Law);
            }
            change => return self.change(change),
        }
        Ok(())
    }

    /// Checks the scheme, or the pending scheme while a transaction is open. Changes nothing.
    #[doc(alias = "Types matching check")]
    #[must_use]
    pub fn check(&self) -> CheckReport {
        let mut report = CheckReport::default();
        self.check_edited(&mut report);
        report
    }

    /// Returns the scheme that commands change: the pending scheme during a transaction.
    fn edited(&self) -> &Scheme {
        if self.transaction.is_there() { self.schemes.pending() } else { self.schemes.running() }
    }

    fn edited_mut(&mut self) -> &mut Scheme {
        if self.transaction.is_there() { self.schemes.pending_mut() } else { self.schemes.running_mut() }
    }

    fn check_edited(&self, report: &mut CheckReport) {
        self.check_wiring(&self.edited().wiring, report);
    }

    /// Returns the first fault of a wiring. A separate function, so that the report is off the stack
    /// afterwards.
    #[inline(never)]
    fn first_fault_of(&self, wiring: &Wiring) -> Option<Finding> {
        let mut report = CheckReport::of_first_fault();
        self.check_wiring(wiring, &mut report);
        report.findings().iter().copied().find(Finding::is_fault)
    }

    /// Returns the first fault of the scheme.
    pub fn first_fault(&self) -> Option<Finding> {
        self.first_fault_of(&self.schemes.running().wiring)
    }

    /// Returns finding `index` of the scheme and the number of faults.
    #[inline(never)]
    pub fn finding(&self, index: u8) -> (Option<Finding>, usize) {
        let mut report = CheckReport::default();
        self.check_edited(&mut report);
        (report.findings().get(usize::from(index)).copied(), report.faults())
    }

    /// Checks a wiring into an empty report.
    #[inline(never)]
    fn check_wiring(&self, wiring: &Wiring, report: &mut CheckReport) {
        let signals = self.data_base.signals().map(|(slot, entry)| (slot, entry.signal));
        let signal_in = |slot| self.data_base.entry(slot).map(|entry| entry.signal);
        MatchingCheck { device: &self.device, wiring }.check(signals, signal_in, report);
    }

    /// Returns whether the scheme has passed its check and runs.
    #[must_use]
    pub fn is_running(&self) -> bool {
        self.is_running
    }

    /// Returns the device; before one is connected, a device without axes and types.
    #[must_use]
    pub fn device(&self) -> &DeviceDescriptor {
        &self.device
    }

    /// Restarts for a device, without modules and signals.
    pub(crate) fn connect(&mut self, device: DeviceDescriptor, kinds: ModuleKinds) {
        self.disconnect();
        self.dof = Dof::of(&device);
        self.device = Served(Some(device));
        self.kinds = kinds;
    }

    /// Disconnects the device.
    pub(crate) fn disconnect(&mut self) {
        self.drop_pending();
        self.close_all();
        self.follow_moves();
        self.data_base.clear();
        self.device = Served(None);
        self.kinds = ModuleKinds::NONE;
    }

    /// Returns the memory, emptied.
    pub(crate) fn release(mut self) -> ProvidedMemory {
        self.disconnect();
        self.data_base.forget();
        ProvidedMemory { schemes: self.schemes, data_base: self.data_base }
    }

    /// Returns the Data Base.
    #[must_use]
    pub fn data_base(&self) -> &DataBase {
        &self.data_base
    }

    pub(crate) fn device_and_data_base(&mut self) -> (&DeviceDescriptor, &mut DataBase) {
        (&self.device, &mut self.data_base)
    }

    pub(crate) fn data_base_mut(&mut self) -> &mut DataBase {
        &mut self.data_base
    }

    /// Returns the calls of a tick, in order.
    pub fn steps(&self) -> impl Iterator<Item = Step> + '_ {
        let wiring = &self.schemes.running().wiring;
        wiring.calls().iter().filter_map(|call| {
            let module = wiring.called(call)?.module;
            Some(Step { module, stage: call.stage })
        })
    }

    /// Returns the signals that a step reads or writes.
    pub fn step_signals(&self, step: Step) -> impl Iterator<Item = (TypeRef, Direction)> + '_ {
        let wiring = &self.schemes.running().wiring;
        let ports = wiring.find(step.module).map_or(&[][..], |plugged| wiring.ports(plugged));
        ports.iter().filter(move |port| port.stage() == step.stage).filter_map(|port| {
            let entry = self.data_base.entry(port.slot)?;
            Some((entry.signal, port.direction()))
        })
    }

    /// Returns every module instance, plugged in or not; of the pending scheme while a transaction is open.
    pub fn instances(&self) -> impl Iterator<Item = ModuleRef> + '_ {
        self.edited().instances.iter().map(|instance| instance.reference)
    }

    /// Returns the index of a module in the plug-in order, from 0; for the same scheme as
    /// [`instances`](Self::instances).
    #[must_use]
    pub fn plug_in_position(&self, module: ModuleRef) -> Option<usize> {
        self.edited().wiring.order_of(module)
    }

    /// Returns the period and phase of a module, in the pending scheme while a transaction is open; none if
    /// it is not plugged in.
    #[must_use]
    pub fn module_rate(&self, module: ModuleRef) -> Option<Rate> {
        self.edited().wiring.find(module).map(|plugged| plugged.rate)
    }

    /// Returns whether a module is plugged in in the running scheme.
    #[must_use]
    pub fn is_plugged_in(&self, module: ModuleRef) -> bool {
        self.schemes.running().is_plugged_in(module)
    }

    /// Returns the channel that a module receives on a link; 0 without a receiver.
    pub(crate) fn receive_channel(&self, link: usize) -> u16 {
        let modules = self.schemes.running().wiring.modules();
        let mut ends = modules.iter().filter_map(|plugged| plugged.link_end);
        ends.find(|end| end.receives_from(link)).map_or(0, |end| end.channel)
    }

    /// Returns the first memory of a module that is plugged in, for example a recorder's record.
    #[must_use]
    pub fn memory(&self, module: ModuleRef) -> Option<&[u32]> {
        let wiring = &self.schemes.running().wiring;
        let ports = wiring.ports(wiring.find(module)?);
        let port = ports.iter().find(|port| port.is_memory())?;
        Some(self.data_base.words(port.slot))
    }

    /// Returns the slot of the memory that a port of a module declares; none if the module is not plugged in.
    pub fn memory_slot(&self, module: ModuleRef, port: u8) -> Option<u8> {
        let wiring = &self.schemes.running().wiring;
        let ports = wiring.ports(wiring.find(module)?);
        ports.get(usize::from(port)).filter(|port| port.is_memory()).map(|port| port.slot)
    }

    /// Returns the use of the static storage by the running and the pending scheme together; instances are
    /// counted as in [`instances`](Self::instances).
    #[must_use]
    pub fn usage(&self) -> Usage {
        let total_words = self.data_base.storage().words.len();
        Usage {
            modules: self.edited().instances.len(),
            slots: self.data_base.used_slots(),
            words: total_words - self.data_base.free_words(),
            total_words,
        }
    }

    /// Returns the number of ports (or handles, whichever is larger) of all modules that are plugged in, and
    /// of ports bound by commands; [`Capacities`](crate::limits::Capacities) has the maxima.
    #[must_use]
    pub fn wire_and_binding_counts(&self) -> [usize; 2] {
        let Scheme { wiring, bindings, .. } = self.edited();
        [wiring.wires(), bindings.len()]
    }

    /// Returns the number of Data Base words for parameters and state of an instance of a kind, on this
    /// device.
    #[must_use]
    pub fn module_words(&self, kind: KindId) -> Option<usize> {
        self.kind(kind).map(|kind| kind.words(self.device.dof()))
    }
}
