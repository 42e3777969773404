//! Wiring: the modules that are plugged in, their order, the bindings of their ports, and the calls of a
//! tick.
//!
//! The engine holds two: the running wiring, and the pending wiring, which is built and checked as a whole
//! and then replaces the running wiring or is discarded.

mod budgets;
mod falling;
mod phases;
mod port;

use core::cell::Cell;

use heapless::vec::VecView;

use crate::data_base::{Block, CheckedWords, DataBase, List, Storage, bit};
use crate::device::DeviceDescriptor;
use crate::limits::MAX_PACKET_WORDS;
use crate::module::{
    Begin, Compute, Declarations, Direction, KindId, LinkEnd, MAX_HANDLES, ModuleBindings, ModuleKind,
    ModuleRef, PortSpec, PortSpecs, Rate, Stage,
};
use crate::parameter::ParameterError;
use crate::scheme::command::CommandError;
pub(crate) use falling::{any, module_bit};
pub(crate) use port::Port;

/// Modules in plug-in order, their ports and handles, and the calls of a tick.
#[derive(Debug)]
pub(crate) struct Wiring {
    modules: List<ActiveModule>,
    ports: List<Port>,
    /// Port index of each handle of each module; [`NO_PORT`] for an undeclared handle.
    handles: List<u8>,
    calls: List<Call>,
    /// Words to check after the calls that write them.
    checked_words: List<CheckedWords>,
    /// Modules that the device's inputs depend on, one bit per place in the plug-in order.
    drives_device: u32,
    /// Whether any module does not run in every tick.
    has_rates: bool,
}

const NO_PORT: u8 = u8::MAX;
const FULL: CommandError = CommandError::TooManyWires;

/// A module that is plugged in.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ActiveModule {
    pub(crate) module: ModuleRef,
    /// Index in the instances of its scheme.
    pub(crate) instance: u8,
    pub(crate) link_end: Option<LinkEnd>,
    pub(crate) rate: Rate,
    /// Whether its state is initialised at its next call.
    pub(crate) begins: bool,
    /// Whether it then takes over from the module that wrote its outputs before.
    pub(crate) takes_over: bool,
    /// Number of its program; 0 for none.
    pub(crate) program: u8,
    /// Whether its ports are the same as in the running scheme: only then is its state still valid.
    pub(crate) is_alike: bool,
    /// Modules whose failure isolates it: itself and all that it depends on, one bit per place in the plug-in
    /// order.
    pub(crate) needs: u32,
    ports: IndexRange,
    handles: IndexRange,
}

/// A contiguous part of a list.
#[derive(Debug, Clone, Copy)]
pub(crate) struct IndexRange {
    start: u8,
    pub(crate) count: u8,
}

impl IndexRange {
    #[inline]
    fn range(self) -> core::ops::Range<usize> {
        let start = usize::from(self.start);
        start..start + usize::from(self.count)
    }

    fn of<T>(self, list: &[T]) -> &[T] {
        list.get(self.range()).unwrap_or_default()
    }

    /// Adjusts the range after another part of the list was removed.
    fn close_gap(&mut self, gone: Self) {
        if self.start > gone.start {
            self.start -= gone.count;
        }
    }
}

/// One call of a module in a tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Call {
    pub(crate) compute: Compute,
    /// Function that initialises the module's state at its first call; none if it has no state.
    pub(crate) begin: Option<Begin>,
    /// First word of the module's configuration.
    pub(crate) configuration: u16,
    /// First word of the module's state.
    pub(crate) state: u16,
    /// Time budget in counts of the engine's counter.
    pub(crate) budget_counts: u32,
    /// Index of the module in the plug-in order.
    pub(crate) order: u8,
    pub(crate) stage: Stage,
    /// Spans of written words to check after the call.
    pub(crate) checked_words: IndexRange,
}

/// A module to plug in.
#[derive(Debug)]
pub(crate) struct New<'a> {
    pub(crate) module: ModuleRef,
    pub(crate) instance: u8,
    pub(crate) every_ticks: u8,
    pub(crate) kind: &'a ModuleKind,
    pub(crate) settings: &'a [Cell<u32>],
    /// Index in the plug-in order.
    pub(crate) order: usize,
    /// The module in the running scheme, with its ports, if it continues from there: it keeps its memories if
    /// all ports are the same.
    pub(crate) before: Option<(&'a ActiveModule, &'a [Port])>,
}

impl Wiring {
    pub(crate) fn new(
        modules: List<ActiveModule>,
        ports: List<Port>,
        handles: List<u8>,
        calls: List<Call>,
        checked_words: List<CheckedWords>,
    ) -> Self {
        Self { modules, ports, handles, calls, checked_words, drives_device: 0, has_rates: false }
    }

    pub(crate) fn clear(&mut self) {
        self.modules.clear();
        self.ports.clear();
        self.handles.clear();
        self.calls.clear();
        self.checked_words.clear();
        self.drives_device = 0;
        self.has_rates = false;
    }

    /// Copies another wiring, in place: a copy would need kilobytes of stack.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.clear();
        // Does not overflow: both have the same capacity.
        let _ = self.modules.extend_from_slice(other.modules);
        let _ = self.ports.extend_from_slice(other.ports);
        let _ = self.handles.extend_from_slice(other.handles);
        let _ = self.calls.extend_from_slice(other.calls);
        let _ = self.checked_words.extend_from_slice(other.checked_words);
        self.drives_device = other.drives_device;
        self.has_rates = other.has_rates;
    }

    /// Unplugs a module.
    pub(crate) fn unplug(&mut self, module: ModuleRef) {
        let Some(order) = self.order_of(module) else { return };
        let ActiveModule { ports, handles, .. } = self.modules.remove(order);
        cut(self.ports, ports);
        cut(self.handles, handles);
        for plugged in self.modules.iter_mut() {
            plugged.ports.close_gap(ports);
            plugged.handles.close_gap(handles);
        }
    }

    /// Adjusts instance indices after the instance at `gone` was removed.
    pub(crate) fn forget_instance(&mut self, gone: usize) {
        for plugged in self.modules.iter_mut().filter(|plugged| usize::from(plugged.instance) > gone) {
            plugged.instance -= 1;
        }
    }

    /// Plugs a module in and allocates its signals and memory in the Data Base.
    ///
    /// An error leaves the wiring unchanged; the Data Base may then contain unused slots.
    pub(crate) fn plug_in(
        &mut self,
        new: &New<'_>,
        device: &DeviceDescriptor,
        data_base: &mut DataBase,
        bound: ModuleBindings<'_>,
    ) -> Result<(), CommandError> {
        let (ports, handles) = (self.ports.len(), self.handles.len());
        let declared = self.declare(new, device, data_base, bound);
        let plugged_in = declared.and_then(|plugged| {
            self.modules.insert(new.order, plugged).map_err(|_| CommandError::TooManyModules)
        });
        plugged_in.inspect_err(|_| {
            self.ports.truncate(ports);
            self.handles.truncate(handles);
        })
    }

    /// A separate function, so that the port descriptions are off the stack afterwards.
    #[inline(never)]
    fn declare(
        &mut self,
        new: &New<'_>,
        device: &DeviceDescriptor,
        data_base: &mut DataBase,
        bound: ModuleBindings<'_>,
    ) -> Result<ActiveModule, CommandError> {
        let mut specs = PortSpecs::new();
        let mut declare = Declarations::new(device, data_base.programs(), bound, &mut specs);
        let declared = [const { Cell::new(0) }; MAX_HANDLES];
        new.kind.ports(new.settings, &mut declare, &declared);
        let handles = new.kind.handles();
        let (has_all, link_end, words) = (declare.has_all(), declare.link_end(), declare.packet_words());
        if !has_all {
            return Err(CommandError::TooManyPorts);
        }
        if link_end.is_some_and(|end| usize::from(end.link) >= data_base.links().len()) {
            return Err(ParameterError::OutOfRange.into());
        }
        if !declare.has_program() {
            return Err(CommandError::UnknownLaw(new.module));
        }
        if !declare.has_axis() {
            return Err(ParameterError::NoSuchEntry.into());
        }
        if link_end.is_some() && new.every_ticks > 1 {
            return Err(CommandError::RunsEveryTick(new.module));
        }
        if words > MAX_PACKET_WORDS {
            return Err(CommandError::PacketTooLong { words });
        }
        let program = new.kind.program(new.settings);
        let is_alike = new.before.is_some_and(|(before, ports)| {
            let words = |spec: &PortSpec| match (spec.data_type, spec.direction) {
                (Some((_, default)), _) => {
                    let signal = bound.signal(spec.name).unwrap_or(default);
                    device.data_type(signal.id).map_or(0, |found| found.shape.words(device.dof()))
                }
                (None, Direction::Memory(words)) => words,
                (None, _) => 0,
            };
            let is_same = |(port, spec): (&Port, &PortSpec)| {
                port.is_memory() == spec.data_type.is_none()
                    && port.is_written() == (spec.direction == Direction::Write)
                    && data_base.words(port.slot).len() == words(spec)
            };
            before.link_end == link_end
                && before.program == program
                && ports.len() == specs.len()
                && ports.iter().zip(&specs).all(is_same)
        });
        let plugged = ActiveModule {
            module: new.module,
            instance: new.instance,
            link_end,
            rate: Rate { every_ticks: new.every_ticks, ticks_until_run: 0 },
            begins: true,
            takes_over: false,
            program,
            is_alike,
            needs: 0,
            ports: IndexRange { start: index(self.ports.len())?, count: index(specs.len())? },
            handles: IndexRange { start: index(self.handles.len())?, count: index(handles)? },
        };
        let ports_before = new.before.filter(|_| is_alike).map_or(&[][..], |(_, ports)| ports);
        let mut memories_before = ports_before.iter().filter(|port| port.is_memory());
        for spec in &specs {
            let port = match spec.data_type {
                Some((_, default)) => {
                    let signal = bound.signal(spec.name).unwrap_or(default);
                    let found = device.data_type(signal.id).ok_or(CommandError::UnknownType(signal))?;
                    let slot = data_base.insert(found, signal, device.dof())?;
                    Port::new(slot, spec, Some(found))
                }
                None => {
                    let words = if let Direction::Memory(words) = spec.direction { words } else { 0 };
                    let kept = memories_before.next().map(|port| port.slot);
                    Port::new(kept.map_or_else(|| data_base.take(words), Ok)?, spec, None)
                }
            };
            self.ports.push(port).map_err(|_| FULL)?;
        }
        for declared in declared.iter().take(handles) {
            let port = Block::from_word(declared.get()).port().unwrap_or(NO_PORT);
            self.handles.push(port).map_err(|_| FULL)?;
        }
        Ok(plugged)
    }

    /// Sets the order of the calls.
    pub(crate) fn set_calls(
        &mut self,
        calls: impl Iterator<Item = (u8, Stage)>,
        find_kind: impl Fn(KindId) -> Option<&'static ModuleKind>,
    ) {
        self.calls.clear();
        for (order, stage) in calls {
            let Some(plugged) = self.modules.get(usize::from(order)) else { continue };
            let Some(kind) = find_kind(plugged.module.kind) else { continue };
            let begin = if stage == Stage::Early { kind.begin() } else { None };
            let compute = kind.compute(stage);
            let _ = self.calls.push(Call {
                compute,
                begin,
                configuration: u16::MAX,
                state: u16::MAX,
                budget_counts: u32::MAX,
                order,
                stage,
                checked_words: IndexRange { start: 0, count: 0 },
            });
        }
    }

    /// Updates every handle and call to the current location of its words.
    pub(crate) fn connect(&mut self, storage: &mut Storage, memory: impl Fn(u8) -> [Block; 2]) {
        for plugged in self.modules.iter() {
            let [configuration, _] = memory(plugged.instance);
            let (ports, start) = (plugged.ports.of(self.ports), configuration.offset);
            for (offset, port) in (start..).zip(plugged.handles.of(self.handles)) {
                let port = ports.get(usize::from(*port));
                let handle = port.map_or(Block::FREE, |port| storage.block(port.slot));
                if let Some([word]) = storage.words_mut(Block { offset, words: 1 }) {
                    *word = handle.to_word();
                }
            }
        }
        for call in self.calls.iter_mut() {
            if let Some(plugged) = self.modules.get(usize::from(call.order)) {
                let [configuration, state] = memory(plugged.instance);
                (call.configuration, call.state) = (configuration.offset, state.offset);
            }
        }
        self.find_checked_words(storage);
    }

    /// Returns the number of ports or of handles, whichever is larger.
    pub(crate) fn wires(&self) -> usize {
        self.ports.len().max(self.handles.len())
    }

    /// Returns the slots that the ports use, one bit each.
    pub(crate) fn slots(&self) -> u64 {
        self.ports.iter().fold(0, |slots, port| slots | bit(port.slot))
    }

    /// Returns the slots that a module writes, one bit each.
    pub(crate) fn writes(&self, plugged: &ActiveModule) -> u64 {
        let written = self.ports(plugged).iter().filter(|port| port.is_written());
        written.fold(0, |slots, port| slots | bit(port.slot))
    }

    /// Returns the modules in plug-in order.
    pub(crate) fn modules(&self) -> &[ActiveModule] {
        self.modules
    }

    /// Marks the selected modules to initialise their state at the next call.
    pub(crate) fn begin(&mut self, is_meant: impl Fn(ModuleRef) -> bool) {
        for plugged in self.modules.iter_mut().filter(|plugged| is_meant(plugged.module)) {
            (plugged.begins, plugged.takes_over) = (true, false);
        }
    }

    /// Returns the module at an index of the plug-in order.
    pub(crate) fn at_mut(&mut self, order: usize) -> Option<&mut ActiveModule> {
        self.modules.get_mut(order)
    }

    /// Marks the modules in the bit set `places` to initialise their state at the next call, as after a
    /// start.
    pub(crate) fn begin_places(&mut self, places: u32) {
        for (order, plugged) in (0..).zip(self.modules.iter_mut()) {
            if places & module_bit(order) != 0 {
                (plugged.begins, plugged.takes_over) = (true, false);
            }
        }
    }

    /// Clears the marks of all modules to initialise their state.
    pub(crate) fn has_begun(&mut self) {
        self.modules.iter_mut().for_each(|plugged| plugged.begins = false);
    }

    pub(crate) fn calls(&self) -> &[Call] {
        self.calls
    }

    /// Returns the ports of a module that is plugged in.
    pub(crate) fn ports(&self, plugged: &ActiveModule) -> &[Port] {
        plugged.ports.of(self.ports)
    }

    /// Returns the module of a call.
    pub(crate) fn called(&self, call: &Call) -> Option<&ActiveModule> {
        self.modules.get(usize::from(call.order))
    }

    pub(crate) fn find(&self, module: ModuleRef) -> Option<&ActiveModule> {
        self.modules.iter().find(|plugged| plugged.module == module)
    }

    /// Returns the index of a module in the plug-in order.
    pub(crate) fn order_of(&self, module: ModuleRef) -> Option<usize> {
        self.modules.iter().position(|plugged| plugged.module == module)
    }
}

/// Removes a range from a list.
fn cut<T: Copy>(list: &mut VecView<T>, gone: IndexRange) {
    let (start, count) = (usize::from(gone.start), usize::from(gone.count));
    if let Some(tail) = list.get_mut(start..) {
        let rest = tail.len().saturating_sub(count);
        tail.copy_within(count.min(tail.len()).., 0);
        list.truncate(start + rest);
    }
}

fn index(number: usize) -> Result<u8, CommandError> {
    u8::try_from(number).map_err(|_| FULL)
}
