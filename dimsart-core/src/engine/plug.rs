//! Commands that build and change a scheme: each is carried out whole or not at all.

use super::{Engine, Instance};
use crate::binding::{Binding, Bound};
use crate::command::{Command, CommandError, ModuleRef};
use crate::data_base::bit;
use crate::data_type::{DataType, TypeRef};
use crate::kind::ModuleList;
use crate::mailbox::LinkPort;
use crate::parameter::{Parameters, Value};
use crate::port::PortSpecs;
use crate::schedule::schedule;
use crate::storage::Block;
use crate::vocabulary::Vocabulary as _;
use crate::wiring::New;

impl<M: ModuleList, const WORDS: usize> Engine<M, WORDS> {
    /// Lets the scheme run if it is sound.
    pub(super) fn check_and_start(&mut self) -> Result<(), CommandError> {
        let (_, faults) = self.finding(0);
        if faults > 0 {
            return Err(CommandError::DoesNotMatch { faults });
        }
        if !self.is_running {
            self.start();
        }
        Ok(())
    }

    /// Carries out a command to a module. An instance that does not exist is made for it, and unmade again if the
    /// command is refused.
    pub(super) fn on_instance(&mut self, module: ModuleRef, command: Command) -> Result<(), CommandError> {
        let known = self.instance(module).map(|instance| instance.memory);
        let memory = match known {
            Some(memory) => memory,
            None => self.create(module)?,
        };
        let done = match command {
            Command::PlugIn(_) => self.plug_in(module),
            Command::InitModule(_) => self.init(module, memory),
            Command::Set { parameter, entry, value, .. } => self.set(module, memory, parameter, entry, value),
            Command::Bind { port, signal, .. } => self.bind(module, port, signal),
            _ => Ok(()),
        };
        if done.is_err() && known.is_none() {
            self.instances.pop();
            self.data_base.storage_mut().give_back_at_end(memory);
        }
        done
    }

    fn bind(&mut self, module: ModuleRef, port: u8, signal: TypeRef) -> Result<(), CommandError> {
        self.known_type(signal)?;
        if self.is_plugged_in(module) {
            return Err(CommandError::PluggedIn(module));
        }
        let mut specs = PortSpecs::new();
        if !self.declare(module, &mut specs) {
            return Err(CommandError::TooManyPorts);
        }
        let spec = specs.get(usize::from(port)).filter(|spec| spec.data_type.is_some());
        let port = spec.ok_or(CommandError::UnknownPort(port))?.name;
        let is_it = |binding: &&mut Binding| binding.module == module && binding.port == port;
        if let Some(binding) = self.bindings.iter_mut().find(is_it) {
            binding.signal = signal;
            return Ok(());
        }
        let binding = Binding { module, port, signal };
        self.bindings.push(binding).map_err(|_| CommandError::WiringFull)
    }

    fn set(
        &mut self,
        module: ModuleRef,
        memory: Block,
        parameter: u8,
        place: Option<u8>,
        value: Value,
    ) -> Result<(), CommandError> {
        if let Value::Type(signal) = value {
            self.known_type(signal)?;
        }
        let (entries, axis, element) = self.locate(module.kind, parameter, place)?;
        let may_restructure = !self.is_plugged_in(module);
        let mut result = Ok(());
        let mut visit = Parameters::set(parameter, element, value, may_restructure, &mut result);
        self.visit(module, memory, axis, &mut visit);
        if result.is_ok() && entries.are_of_axes() && place.is_none() {
            for other in 1..self.dof() {
                let mut result = Ok(());
                let mut visit = Parameters::set(parameter, None, value, may_restructure, &mut result);
                self.visit(module, memory, other, &mut visit);
            }
        }
        result?;
        self.prepare(module, memory);
        Ok(())
    }

    fn create(&mut self, module: ModuleRef) -> Result<Block, CommandError> {
        let kind = M::KINDS.get(usize::from(module.kind)).filter(|kind| kind.is_there() && module.number > 0);
        let kind = kind.ok_or(CommandError::UnknownModule(module))?;
        if self.instances.is_full() {
            return Err(CommandError::TooManyModules);
        }
        let memory = self.data_base.storage_mut().take_at_end(kind.words(self.device.dof()))?;
        let _ = self.instances.push(Instance { reference: module, memory });
        self.set_defaults(module, memory);
        Ok(memory)
    }

    fn set_defaults(&mut self, module: ModuleRef, memory: Block) {
        for axis in 0..self.dof() {
            self.visit(module, memory, axis, &mut Parameters::defaults());
        }
        self.prepare(module, memory);
    }

    /// Starts from rest, as after power-up: what modules and signals held may be long past.
    fn start(&mut self) {
        self.reset();
        self.data_base.zero_signals();
        self.data_base.links().iter().for_each(LinkPort::forget_received);
        self.is_running = true;
    }

    pub(super) fn reset(&mut self) {
        self.begin(|_| true);
    }

    pub(super) fn begin(&mut self, is_meant: impl Fn(ModuleRef) -> bool) {
        self.wiring.begin(is_meant);
        self.begins = true;
    }

    fn init(&mut self, module: ModuleRef, memory: Block) -> Result<(), CommandError> {
        if self.is_plugged_in(module) {
            return Err(CommandError::PluggedIn(module));
        }
        self.set_defaults(module, memory);
        self.bindings.retain(|binding| binding.module != module);
        Ok(())
    }

    fn plug_in(&mut self, module: ModuleRef) -> Result<(), CommandError> {
        if self.is_plugged_in(module) {
            return Err(CommandError::PluggedIn(module));
        }
        let kind = M::KINDS.get(usize::from(module.kind)).ok_or(CommandError::UnknownModule(module))?;
        let settings = &self.settings(module, kind);
        let order = self.place_before.and_then(|before| self.wiring.order_of(before));
        let order = order.unwrap_or(self.wiring.modules().len());
        let new = New { module, kind, settings, order };
        let Self { wiring, next, device, data_base, bindings, .. } = self;
        let bound = Bound { module, bindings };
        let wired = next.with(&new, wiring, device, data_base, bound);
        wired
            .and_then(|()| self.admit(module))
            .and_then(|()| self.switch())
            .inspect_err(|_| self.give_back_slots())?;
        self.begins = true;
        let end = self.wiring.find(module).and_then(|plugged| plugged.link_end);
        let listens_to = |link| end.is_some_and(|end| end.listens_to(link));
        let links = (0..).zip(self.data_base.links()).filter(|(number, _)| listens_to(*number));
        links.for_each(|(_, link)| link.forget_received());
        self.place_before = None;
        Ok(())
    }

    /// Whether a tick is short enough with the next wiring, which has one more module.
    fn admit(&self, module: ModuleRef) -> Result<(), CommandError> {
        let Some((limit, _)) = self.limit_cycles.zip(self.costs) else { return Ok(()) };
        let own = self.next.find(module).and_then(|plugged| self.cycles_in(&self.next, plugged));
        let known = own.zip(self.cycles_with(&self.next));
        let (cycles, tick_cycles) = known.ok_or(CommandError::CostUnknown(module))?;
        let limit_cycles = limit.get();
        if tick_cycles > limit_cycles {
            return Err(CommandError::TooSlow { module, cycles, tick_cycles, limit_cycles });
        }
        Ok(())
    }

    pub(super) fn unplug(&mut self, module: ModuleRef) -> Result<(), CommandError> {
        self.wiring.find(module).ok_or(CommandError::NotPluggedIn(module))?;
        self.next.without(module, &self.wiring);
        self.switch()?;
        self.place_before = self.place_before.filter(|before| *before != module);
        self.give_back_slots();
        Ok(())
    }

    /// The next wiring takes the place of the one there is, unless that runs and the next one has a fault.
    fn switch(&mut self) -> Result<(), CommandError> {
        let calls = schedule(&self.next);
        self.next.set_calls(calls.into_iter(), M::KINDS);
        if self.is_running
            && let Some(fault) = self.first_fault_of(&self.next)
        {
            return Err(CommandError::WouldBreak(fault));
        }
        core::mem::swap(&mut self.wiring, &mut self.next);
        self.connect_wiring();
        Ok(())
    }

    /// Gives back what neither the wiring nor the device uses.
    fn give_back_slots(&mut self) {
        let types = self.device.outputs.iter().chain(self.device.inputs);
        let slots = types.filter_map(|data_type| self.data_base.slot(data_type.first()));
        let of_device = slots.fold(0, |slots, slot| slots | bit(slot));
        self.data_base.keep_only(self.wiring.slots() | of_device);
        // What lay behind the slots given back has moved.
        self.connect_wiring();
    }

    fn connect_wiring(&mut self) {
        let Self { wiring, data_base, instances, .. } = self;
        let memory = |module| {
            let found = instances.iter().find(|instance| instance.reference == module);
            found.map_or(Block::FREE, |instance| instance.memory)
        };
        wiring.connect(data_base.storage_mut(), memory);
    }

    /// Stops and ends the existence of every module.
    pub(super) fn close_all(&mut self) {
        self.is_running = false;
        self.wiring.clear();
        while let Some(Instance { memory, .. }) = self.instances.pop() {
            self.data_base.storage_mut().give_back_at_end(memory);
        }
        self.bindings.clear();
        self.give_back_slots();
        self.place_before = None;
    }

    /// Ends an instance; the others move up.
    pub(super) fn close(&mut self, module: ModuleRef) -> Result<(), CommandError> {
        let index = self.instances.iter().position(|instance| instance.reference == module);
        let index = index.ok_or(CommandError::NotPluggedIn(module))?;
        if self.is_plugged_in(module) {
            self.unplug(module)?;
        }
        let gone = self.instances.remove(index).memory;
        self.data_base.storage_mut().give_back_at_end(gone);
        for instance in self.instances.iter_mut().filter(|instance| instance.memory.offset < gone.offset) {
            instance.memory.offset += gone.words;
        }
        self.bindings.retain(|binding| binding.module != module);
        self.connect_wiring();
        Ok(())
    }

    fn known_type(&self, signal: TypeRef) -> Result<&'static DataType, CommandError> {
        let known = self.device.data_type(signal.id).filter(|_| signal.number > 0);
        known.ok_or(CommandError::UnknownType(signal))
    }
}
