//! Commands that build and change a scheme: each is carried out whole or not at all.

use super::{Engine, Instance, Port};
use crate::command::{CommandError, ModuleRef, Verb};
use crate::data_type::{DataType, TypeRef};
use crate::mailbox::LinkPort;
use crate::matching::Difference;
use crate::module::ModuleList;
use crate::parameter::{ParameterError, Value};
use crate::port::{Direction, PortSpec, PortSpecs};

impl<M: ModuleList, const WORDS: usize> Engine<M, WORDS> {
    pub(super) fn engine_command(&mut self, verb: Verb, value: Value) -> Result<(), CommandError> {
        match (verb, value) {
            (Verb::ModOn, Value::Module(module)) => {
                self.with_instance(module, |engine, index| engine.plug_in(module, index))
            }
            (Verb::ModOff, Value::Module(module)) => self.unplug(module),
            (Verb::PlaceBefore, Value::Module(module)) => {
                self.active_index(module)?;
                self.place_before = Some(module);
                Ok(())
            }
            (Verb::ModReset, Value::Module(module)) => {
                let instance = self.instance(module).ok_or(CommandError::NotPluggedIn(module))?;
                instance.module.reset();
                Ok(())
            }
            (Verb::ModInit, Value::Module(module)) => {
                self.with_instance(module, |engine, index| engine.init(module, index))
            }
            (Verb::ModClose, Value::Module(module)) => self.close(module),
            (Verb::MatchingCheck, Value::Nothing) => {
                let (_, faults) = self.finding(0);
                if faults > 0 {
                    return Err(CommandError::DoesNotMatch { faults });
                }
                if !self.is_running {
                    self.start();
                }
                Ok(())
            }
            (Verb::Stop, Value::Nothing) => {
                self.is_running = false;
                Ok(())
            }
            (Verb::Reset, Value::Nothing) => {
                self.reset();
                Ok(())
            }
            (Verb::Close | Verb::Init, Value::Nothing) => {
                self.close_all();
                Ok(())
            }
            _ => Err(CommandError::WrongValue),
        }
    }

    pub(super) fn bind(&mut self, module: ModuleRef, port: u8, signal: TypeRef) -> Result<(), CommandError> {
        self.known_type(signal)?;
        self.with_instance(module, |engine, index| {
            let device = &engine.device;
            let instance = engine.instances.get_mut(index).ok_or(CommandError::UnknownModule(module))?;
            if instance.is_active {
                return Err(CommandError::PluggedIn(module));
            }
            let mut specs = PortSpecs::new();
            if !instance.declare(device, &engine.data_base, &mut specs) {
                return Err(CommandError::TooManyPorts);
            }
            let spec = specs.get(usize::from(port)).filter(|spec| spec.data_type.is_some());
            let name = spec.ok_or(CommandError::UnknownPort(port))?.name;
            instance.bindings.retain(|(bound, _)| *bound != name);
            instance.bindings.push((name, signal)).map_err(|_| CommandError::TooManyPorts)
        })
    }

    pub(super) fn set(
        &mut self,
        module: ModuleRef,
        parameter: u8,
        axis: Option<u8>,
        value: Value,
    ) -> Result<(), CommandError> {
        if let Value::Type(signal) = value {
            self.known_type(signal)?;
        }
        if axis.is_some_and(|axis| usize::from(axis) >= self.device.dof()) {
            return Err(ParameterError::NoSuchAxis.into());
        }
        self.with_instance(module, |engine, index| {
            let device = &engine.device;
            let instance = engine.instances.get_mut(index).ok_or(CommandError::UnknownModule(module))?;
            instance.module.command(parameter, axis, value, !instance.is_active)?;
            instance.module.prepare(device);
            Ok(())
        })
    }

    pub(super) fn instance(&mut self, module: ModuleRef) -> Option<&mut Instance<M>> {
        self.instances.iter_mut().find(|instance| instance.reference == module)
    }

    /// Carries out `action` on the instance, which is made for it if it does not exist, and unmade
    /// again if the action fails.
    fn with_instance(
        &mut self,
        module: ModuleRef,
        action: impl FnOnce(&mut Self, usize) -> Result<(), CommandError>,
    ) -> Result<(), CommandError> {
        if let Some(index) = self.index(module) {
            return action(self, index);
        }
        let index = self.instances.len();
        self.create(module)?;
        action(self, index).inspect_err(|_| self.instances.truncate(index))
    }

    /// Apart from what is done with the instance: its copy is off the stack by then.
    #[inline(never)]
    fn create(&mut self, module: ModuleRef) -> Result<(), CommandError> {
        let fresh = Instance::new(module).ok_or(CommandError::UnknownModule(module))?;
        self.instances.push(fresh).map_err(|_| CommandError::TooManyModules)
    }

    /// Starts from rest, as after power-up: what modules and signals held may be long past.
    fn start(&mut self) {
        self.reset();
        self.data_base.storage_mut().words.fill(0);
        self.data_base.links().iter().for_each(LinkPort::forget_received);
        self.is_running = true;
    }

    fn reset(&mut self) {
        self.instances.iter_mut().for_each(|instance| instance.module.reset());
    }

    fn init(&mut self, module: ModuleRef, index: usize) -> Result<(), CommandError> {
        let instance = self.instances.get_mut(index).ok_or(CommandError::UnknownModule(module))?;
        if instance.is_active {
            return Err(CommandError::PluggedIn(module));
        }
        instance.module.init();
        instance.bindings.clear();
        Ok(())
    }

    fn plug_in(&mut self, module: ModuleRef, index: usize) -> Result<(), CommandError> {
        let instance = self.instances.get(index).ok_or(CommandError::UnknownModule(module))?;
        if instance.is_active {
            return Err(CommandError::PluggedIn(module));
        }
        self.admit(module)?;
        let instance = self.instances.get_mut(index).ok_or(CommandError::UnknownModule(module))?;
        let mut specs = PortSpecs::new();
        if !instance.declare(&self.device, &self.data_base, &mut specs) {
            return Err(CommandError::TooManyPorts);
        }
        for spec in &specs {
            let bound = instance.bound(spec.name);
            match self.data_base.insert_port(&self.device, spec, bound) {
                Ok(port) => {
                    let _ = instance.ports.push(port);
                }
                Err(error) => {
                    instance.ports.iter().rev().for_each(|port| self.data_base.remove(port.slot));
                    instance.ports.clear();
                    return Err(error);
                }
            }
        }
        instance.is_active = true;
        instance.connect(&self.device, &self.data_base);
        instance.module.prepare(&self.device);
        instance.module.reset();
        let listens_to = |link| instance.link_end.is_some_and(|end| end.listens_to(link));
        let links = (0..).zip(self.data_base.links()).filter(|(number, _)| listens_to(*number));
        links.for_each(|(_, link)| link.forget_received());
        let place = self.place_before.and_then(|before| self.place_of(before));
        let entry = u8::try_from(index).unwrap_or(u8::MAX);
        let place = place.unwrap_or(self.plug_in_order.len());
        let _ = self.plug_in_order.insert(place, entry);
        self.reschedule();
        if self.is_running
            && let Some(fault) = self.first_fault(None)
        {
            self.take_out(module);
            return Err(CommandError::WouldBreak(fault));
        }
        self.place_before = None;
        Ok(())
    }

    /// Whether a tick is short enough with one more module.
    fn admit(&self, module: ModuleRef) -> Result<(), CommandError> {
        let Some(limit) = self.limit_cycles else { return Ok(()) };
        let known = self.cycles_of(module.kind).zip(self.tick_cycles());
        let (cycles, others) = known.ok_or(CommandError::CostUnknown(module))?;
        let (tick_cycles, limit_cycles) = (others + cycles, limit.get());
        if tick_cycles > limit_cycles {
            return Err(CommandError::TooSlow { module, cycles, tick_cycles, limit_cycles });
        }
        Ok(())
    }

    fn unplug(&mut self, module: ModuleRef) -> Result<(), CommandError> {
        self.active_index(module)?;
        if self.is_running
            && let Some(fault) = self.first_fault(Some(module))
        {
            return Err(CommandError::WouldBreak(fault));
        }
        self.take_out(module);
        Ok(())
    }

    /// Stops and ends the existence of every module.
    pub(super) fn close_all(&mut self) {
        self.is_running = false;
        while let Some(reference) = self.instances.last().map(|instance| instance.reference) {
            self.remove(reference);
        }
        self.place_before = None;
    }

    fn close(&mut self, module: ModuleRef) -> Result<(), CommandError> {
        self.index(module).ok_or(CommandError::NotPluggedIn(module))?;
        if self.is_plugged_in(module) {
            self.unplug(module)?;
        }
        self.remove(module);
        Ok(())
    }

    /// Takes a module out of the tick and gives its slots back, without asking whether it is missed.
    fn take_out(&mut self, module: ModuleRef) {
        let Some(place) = self.place_of(module) else { return };
        self.plug_in_order.remove(place);
        self.place_before = self.place_before.filter(|before| *before != module);
        if let Some(instance) = self.instances.iter_mut().find(|instance| instance.reference == module) {
            instance.is_active = false;
            instance.ports.iter().rev().for_each(|port| self.data_base.remove(port.slot));
            instance.ports.clear();
        }
        // What lay behind the slots given back has moved.
        for instance in &mut self.instances {
            instance.connect(&self.device, &self.data_base);
        }
        self.reschedule();
    }

    /// Ends an instance; the others move up.
    fn remove(&mut self, module: ModuleRef) {
        self.take_out(module);
        let Some(index) = self.index(module) else { return };
        self.instances.remove(index);
        for entry in self.plug_in_order.iter_mut().filter(|entry| usize::from(**entry) > index) {
            *entry -= 1;
        }
        self.reschedule();
    }

    fn index(&self, module: ModuleRef) -> Option<usize> {
        self.instances.iter().position(|instance| instance.reference == module)
    }

    fn active_index(&self, module: ModuleRef) -> Result<usize, CommandError> {
        let index = self.index(module).filter(|_| self.is_plugged_in(module));
        index.ok_or(CommandError::NotPluggedIn(module))
    }

    /// Place of a module in the plug-in order.
    fn place_of(&self, module: ModuleRef) -> Option<usize> {
        let index = self.index(module)?;
        self.plug_in_order.iter().position(|entry| usize::from(*entry) == index)
    }

    fn known_type(&self, signal: TypeRef) -> Result<&'static DataType, CommandError> {
        let known = self.device.data_type(signal.id).filter(|_| signal.number > 0);
        known.ok_or(CommandError::UnknownType(signal))
    }
}

impl<const WORDS: usize> crate::data_base::DataBase<WORDS> {
    /// Takes what a port needs: its signal, or its memory.
    fn insert_port(
        &mut self,
        device: &crate::device::DeviceDescriptor,
        spec: &PortSpec,
        bound: Option<TypeRef>,
    ) -> Result<Port, CommandError> {
        let PortSpec { name, direction, stage, is_delayed, tie, .. } = *spec;
        let port = |slot, signal, difference| Port {
            name,
            slot,
            signal,
            is_written: direction == Direction::Write,
            stage,
            is_delayed,
            difference,
            tie,
        };
        match (spec.data_type, direction) {
            (Some((expected, default)), _) => {
                let signal = bound.unwrap_or(default);
                let found = device.data_type(signal.id).ok_or(CommandError::UnknownType(signal))?;
                let slot = self.insert(found, signal, device.dof())?;
                Ok(port(slot, Some(signal), difference(spec, expected, found)))
            }
            (None, Direction::Memory(words)) => Ok(port(self.take(words)?, None, None)),
            (None, _) => Err(CommandError::WrongValue),
        }
    }
}

/// How the signal a port is bound to differs from what the port expects.
fn difference(spec: &PortSpec, expected: &DataType, found: &DataType) -> Option<Difference> {
    if !spec.takes_any_unit && !expected.unit.fits(found.unit) {
        Some(Difference::Unit)
    } else if expected.format != found.format {
        Some(Difference::Format)
    } else if expected.shape != found.shape {
        Some(Difference::Shape)
    } else {
        spec.misfit
    }
}
