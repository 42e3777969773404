//! The wiring: which modules are plugged in, in which order, to what their ports are bound, and the calls of a tick.
//!
//! It is a value of its own. The engine holds two: the one that runs, and the next one, which is put together and
//! checked as a whole while the other one runs, and then takes its place, or is dropped and nothing has changed.

use core::cell::Cell;

use heapless::Vec;

use crate::binding::Bound;
use crate::command::{CommandError, ModuleRef};
use crate::data_base::{DataBase, bit};
use crate::declare::Declare;
use crate::device::DeviceDescriptor;
use crate::kind::{Compute, Kind, MAX_HANDLES};
use crate::limits::{MAX_CALLS, MAX_MODULES, MAX_PACKET_WORDS, MAX_WIRES};
use crate::port::{Difference, Direction, LinkEnd, PortSpec, PortSpecs, Stage};
use crate::storage::{Block, Storage};
use crate::unit_tie::{UnitRelation, UnitTie};

/// Modules in plug-in order, their ports and handles, and the calls of a tick.
#[derive(Debug)]
pub(crate) struct Wiring {
    modules: Vec<Plugged, MAX_MODULES>,
    ports: Vec<Port, MAX_WIRES>,
    /// Of each module's handles, which of its ports it is of; [`NO_PORT`] for one that was not declared.
    handles: Vec<u8, MAX_WIRES>,
    calls: Vec<Call, MAX_CALLS>,
}

const NO_PORT: u8 = u8::MAX;
const FULL: CommandError = CommandError::WiringFull;

/// A module that is plugged in.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plugged {
    pub(crate) module: ModuleRef,
    pub(crate) link_end: Option<LinkEnd>,
    /// Whether its state begins with its next call.
    pub(crate) begins: bool,
    /// Whether it then takes over from the module that wrote to its outputs before.
    pub(crate) takes_over: bool,
    /// Whether its ports are as in the scheme that runs: only then its state is still about them.
    pub(crate) is_alike: bool,
    /// Whether it wrote what its signals cannot be, and is cut out since.
    pub(crate) has_failed: bool,
    /// Whether it writes an input of the device, or one of those that fall with it does.
    pub(crate) drives_device: bool,
    /// Modules that are cut out when it is: itself, and all that depend on it. A bit for each place in the plug-in order.
    pub(crate) falls_with: u32,
    ports: Span,
    handles: Span,
}

/// Some of a list, one behind the other.
#[derive(Debug, Clone, Copy)]
struct Span {
    start: u8,
    count: u8,
}

impl Span {
    fn of<T>(self, list: &[T]) -> &[T] {
        let start = usize::from(self.start);
        list.get(start..start + usize::from(self.count)).unwrap_or_default()
    }

    /// Follows its part of the list, out of which another one was cut.
    fn close_gap(&mut self, gone: Self) {
        if self.start > gone.start {
            self.start -= gone.count;
        }
    }
}

/// A port of a module that is plugged in.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Port {
    pub(crate) slot: u8,
    flags: u8,
    /// Relation and port of its tie, [`Port::NO_TIE`] for none.
    tie: u8,
}

impl Port {
    const WRITTEN: u8 = 1;
    const LATE: u8 = 2;
    const DELAYED: u8 = 4;
    const MEMORY: u8 = 8;
    /// Where the number of its difference begins; 0 for none.
    const DIFFERENCE: u8 = 4;
    const DIFFERENCES: [Difference; 3] = [Difference::Unit, Difference::Format, Difference::Shape];
    const RELATIONS: [UnitRelation; 4] =
        [UnitRelation::Same, UnitRelation::Integral, UnitRelation::Derivative, UnitRelation::Alike];
    const NO_TIE: u8 = u8::MAX;

    fn new(slot: u8, spec: &PortSpec, difference: Option<Difference>) -> Self {
        let flag = |is_set, flag| if is_set { flag } else { 0 };
        let number = |found: &Difference| Self::DIFFERENCES.iter().position(|known| known == found);
        let difference = difference.as_ref().and_then(number).map_or(0, |number| number + 1);
        let tie = spec.tie.and_then(|UnitTie { relation, port }| {
            let relation = Self::RELATIONS.iter().position(|known| *known == relation)?;
            Some(u8::try_from(relation).ok()? << 4 | port)
        });
        let flags = flag(spec.direction == Direction::Write, Self::WRITTEN)
            | flag(spec.stage == Stage::Late, Self::LATE)
            | flag(spec.is_delayed, Self::DELAYED)
            | flag(spec.data_type.is_none(), Self::MEMORY)
            | u8::try_from(difference).unwrap_or(0) << Self::DIFFERENCE;
        Self { slot, flags, tie: tie.unwrap_or(Self::NO_TIE) }
    }

    pub(crate) fn is_written(self) -> bool {
        self.flags & Self::WRITTEN != 0
    }

    pub(crate) fn is_delayed(self) -> bool {
        self.flags & Self::DELAYED != 0
    }

    pub(crate) fn is_memory(self) -> bool {
        self.flags & Self::MEMORY != 0
    }

    pub(crate) fn stage(self) -> Stage {
        if self.flags & Self::LATE == 0 { Stage::Early } else { Stage::Late }
    }

    /// How it uses its signal.
    pub(crate) fn direction(self) -> Direction {
        if self.is_written() { Direction::Write } else { Direction::Read }
    }

    /// How its signal differs from what it expects.
    pub(crate) fn difference(self) -> Option<Difference> {
        let number = usize::from(self.flags >> Self::DIFFERENCE).checked_sub(1)?;
        Self::DIFFERENCES.get(number).copied()
    }

    pub(crate) fn tie(self) -> Option<UnitTie> {
        if self.tie == Self::NO_TIE {
            return None;
        }
        let relation = *Self::RELATIONS.get(usize::from(self.tie >> 4))?;
        Some(UnitTie { relation, port: self.tie & 0xF })
    }
}

/// One call of a module in a tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Call {
    pub(crate) compute: Compute,
    /// What the module begins by in this call, if it has a state and this is its first call in a tick.
    pub(crate) begin: Option<Compute>,
    /// First word of its module's configuration.
    pub(crate) configuration: u16,
    /// First word of its module's state.
    pub(crate) state: u16,
    /// Of its module in the plug-in order.
    pub(crate) order: u8,
    pub(crate) stage: Stage,
}

/// A module that is to be plugged in.
#[derive(Debug)]
pub(crate) struct New<'a> {
    pub(crate) module: ModuleRef,
    pub(crate) kind: &'a Kind,
    pub(crate) settings: &'a [Cell<u32>],
    /// Behind so many others.
    pub(crate) order: usize,
    /// How it is plugged in in the scheme that runs, with its ports, if it goes on from there: where all of them are
    /// alike, it keeps its memories.
    pub(crate) before: Option<(&'a Plugged, &'a [Port])>,
}

impl Wiring {
    pub(crate) const fn new() -> Self {
        Self { modules: Vec::new(), ports: Vec::new(), handles: Vec::new(), calls: Vec::new() }
    }

    pub(crate) fn clear(&mut self) {
        self.modules.clear();
        self.ports.clear();
        self.handles.clear();
        self.calls.clear();
    }

    /// Becomes as another one. In its place: a copy would take kilobytes of the stack.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.clear();
        // As much room as there is.
        let _ = self.modules.extend_from_slice(&other.modules);
        let _ = self.ports.extend_from_slice(&other.ports);
        let _ = self.handles.extend_from_slice(&other.handles);
        let _ = self.calls.extend_from_slice(&other.calls);
    }

    /// Takes a module out.
    pub(crate) fn unplug(&mut self, module: ModuleRef) {
        let Some(order) = self.order_of(module) else { return };
        let Plugged { ports, handles, .. } = self.modules.remove(order);
        cut(&mut self.ports, ports);
        cut(&mut self.handles, handles);
        for plugged in &mut self.modules {
            plugged.ports.close_gap(ports);
            plugged.handles.close_gap(handles);
        }
    }

    /// Puts a module in, whose signals and memory are taken from the Data Base.
    ///
    /// On an error it is as before, and the Data Base may have slots that nobody uses.
    pub(crate) fn plug_in<const WORDS: usize>(
        &mut self,
        new: &New<'_>,
        device: &DeviceDescriptor,
        data_base: &mut DataBase<WORDS>,
        bound: Bound<'_>,
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

    /// Apart from what is done with the wiring: the ports' descriptions are off the stack by then.
    #[inline(never)]
    fn declare<const WORDS: usize>(
        &mut self,
        new: &New<'_>,
        device: &DeviceDescriptor,
        data_base: &mut DataBase<WORDS>,
        bound: Bound<'_>,
    ) -> Result<Plugged, CommandError> {
        let mut specs = PortSpecs::new();
        let mut declare = Declare::new(device, bound, &mut specs);
        let declared = [const { Cell::new(0) }; MAX_HANDLES];
        new.kind.ports(new.settings, &mut declare, &declared);
        let handles = new.kind.handles();
        let (has_all, link_end, words) = (declare.has_all(), declare.link_end(), declare.packet_words());
        if !has_all {
            return Err(CommandError::TooManyPorts);
        }
        if words > MAX_PACKET_WORDS {
            return Err(CommandError::PacketTooLong { words });
        }
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
            before.link_end == link_end && ports.len() == specs.len() && ports.iter().zip(&specs).all(is_same)
        });
        let plugged = Plugged {
            module: new.module,
            link_end,
            begins: true,
            takes_over: false,
            is_alike,
            has_failed: false,
            drives_device: false,
            falls_with: 0,
            ports: Span { start: index(self.ports.len())?, count: index(specs.len())? },
            handles: Span { start: index(self.handles.len())?, count: index(handles)? },
        };
        let ports_before = new.before.filter(|_| is_alike).map_or(&[][..], |(_, ports)| ports);
        let mut memories_before = ports_before.iter().filter(|port| port.is_memory());
        for spec in &specs {
            let port = match spec.data_type {
                Some((_, default)) => {
                    let signal = bound.signal(spec.name).unwrap_or(default);
                    let found = device.data_type(signal.id).ok_or(CommandError::UnknownType(signal))?;
                    let slot = data_base.insert(found, signal, device.dof())?;
                    Port::new(slot, spec, spec.difference(found))
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

    /// Takes over the order of the calls. `of_device` are the slots of the device's inputs, a bit each.
    pub(crate) fn set_calls(
        &mut self,
        calls: impl Iterator<Item = (u8, Stage)>,
        kinds: &[Kind],
        of_device: u64,
    ) {
        self.find_what_falls(of_device);
        self.calls.clear();
        for (order, stage) in calls {
            let Some(plugged) = self.modules.get(usize::from(order)) else { continue };
            let Some(kind) = kinds.get(usize::from(plugged.module.kind)) else { continue };
            let begin = if stage == Stage::Early { kind.begin() } else { None };
            let compute = kind.compute(stage);
            let _ = self.calls.push(Call {
                compute,
                begin,
                configuration: u16::MAX,
                state: u16::MAX,
                order,
                stage,
            });
        }
    }

    /// Finds out which modules fall with which: all that read what one of them writes, in this tick or the next one.
    fn find_what_falls(&mut self, of_device: u64) {
        let mut writes = [0; MAX_MODULES];
        let mut reads = [0; MAX_MODULES];
        for ((plugged, writes), reads) in self.modules.iter().zip(&mut writes).zip(&mut reads) {
            (*writes, *reads) = (self.writes(plugged), self.reads(plugged));
        }
        for ((order, plugged), writes) in (0..).zip(&mut self.modules).zip(&writes) {
            let readers = (0..).zip(&reads).filter(|(_, reads)| **reads & writes != 0);
            plugged.falls_with =
                readers.fold(module_bit(order), |found, (reader, _)| found | module_bit(reader));
        }
        // Warshall: what falls with those that fall with it.
        for by in 0..self.modules.len() {
            let further = self.modules.get(by).map_or(0, |plugged| plugged.falls_with);
            let by = (0..).nth(by).map_or(0, module_bit);
            for plugged in self.modules.iter_mut().filter(|plugged| plugged.falls_with & by != 0) {
                plugged.falls_with |= further;
            }
        }
        for plugged in &mut self.modules {
            let falls = (0..).zip(&writes).filter(|(order, _)| plugged.falls_with & module_bit(*order) != 0);
            plugged.drives_device = falls.fold(0, |slots, (_, writes)| slots | writes) & of_device != 0;
        }
    }

    /// Points every handle to where its slot is now, and every call to its module's configuration and state.
    pub(crate) fn connect<const WORDS: usize>(
        &mut self,
        storage: &mut Storage<WORDS>,
        memory: impl Fn(ModuleRef) -> [Block; 2],
    ) {
        let mut places = Vec::<[Block; 2], MAX_MODULES>::new();
        for plugged in &self.modules {
            let blocks = memory(plugged.module);
            let _ = places.push(blocks);
            let [configuration, _] = blocks;
            let (ports, start) = (plugged.ports.of(&self.ports), configuration.offset);
            for (offset, port) in (start..).zip(plugged.handles.of(&self.handles)) {
                let port = ports.get(usize::from(*port));
                let handle = port.map_or(Block::FREE, |port| storage.block(port.slot));
                if let Some([word]) = storage.words_mut(Block { offset, words: 1 }) {
                    *word = handle.to_word();
                }
            }
        }
        for call in &mut self.calls {
            if let Some([configuration, state]) = places.get(usize::from(call.order)) {
                (call.configuration, call.state) = (configuration.offset, state.offset);
            }
        }
    }

    /// Slots that its ports use, a bit each.
    pub(crate) fn slots(&self) -> u64 {
        self.ports.iter().fold(0, |slots, port| slots | bit(port.slot))
    }

    /// Slots that a module writes to, a bit each.
    pub(crate) fn writes(&self, plugged: &Plugged) -> u64 {
        let written = self.ports(plugged).iter().filter(|port| port.is_written());
        written.fold(0, |slots, port| slots | bit(port.slot))
    }

    /// Slots that a module reads from, a bit each.
    fn reads(&self, plugged: &Plugged) -> u64 {
        let read = self.ports(plugged).iter().filter(|port| !port.is_written() && !port.is_memory());
        read.fold(0, |slots, port| slots | bit(port.slot))
    }

    /// Modules in plug-in order.
    pub(crate) fn modules(&self) -> &[Plugged] {
        &self.modules
    }

    /// Has the state of these modules begin with their next call.
    pub(crate) fn begin(&mut self, is_meant: impl Fn(ModuleRef) -> bool) {
        for plugged in self.modules.iter_mut().filter(|plugged| is_meant(plugged.module)) {
            (plugged.begins, plugged.takes_over) = (true, false);
        }
    }

    /// Takes these modules for sound again.
    pub(crate) fn forgive(&mut self, is_meant: impl Fn(ModuleRef) -> bool) {
        self.modules
            .iter_mut()
            .filter(|plugged| is_meant(plugged.module))
            .for_each(|plugged| plugged.has_failed = false);
    }

    /// A module that is plugged in, by its place.
    pub(crate) fn at_mut(&mut self, order: usize) -> Option<&mut Plugged> {
        self.modules.get_mut(order)
    }

    /// Has the state of the modules at these places begin with their next call, as after a start.
    pub(crate) fn begin_places(&mut self, places: u32) {
        for (order, plugged) in (0..).zip(&mut self.modules) {
            if places & module_bit(order) != 0 {
                (plugged.begins, plugged.takes_over) = (true, false);
            }
        }
    }

    /// No module begins any more.
    pub(crate) fn has_begun(&mut self) {
        self.modules.iter_mut().for_each(|plugged| plugged.begins = false);
    }

    pub(crate) fn calls(&self) -> &[Call] {
        &self.calls
    }

    /// Ports of a module that is plugged in.
    pub(crate) fn ports(&self, plugged: &Plugged) -> &[Port] {
        plugged.ports.of(&self.ports)
    }

    /// The module of a call.
    pub(crate) fn called(&self, call: &Call) -> Option<&Plugged> {
        self.modules.get(usize::from(call.order))
    }

    pub(crate) fn find(&self, module: ModuleRef) -> Option<&Plugged> {
        self.modules.iter().find(|plugged| plugged.module == module)
    }

    /// How many modules are plugged in before this one.
    pub(crate) fn order_of(&self, module: ModuleRef) -> Option<usize> {
        self.modules.iter().position(|plugged| plugged.module == module)
    }
}

/// A module's place in the plug-in order as one of 32 bits.
pub(crate) fn module_bit(order: u8) -> u32 {
    const { assert!(MAX_MODULES <= 32, "a set of modules is 32 bits") };
    1_u32.checked_shl(u32::from(order)).unwrap_or(0)
}

/// Cuts a part out of a list.
fn cut<T: Copy, const N: usize>(list: &mut Vec<T, N>, gone: Span) {
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
