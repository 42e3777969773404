//! Commands that build and change a scheme, each of them atomically.

use super::Engine;
use super::transaction::Transaction;
use crate::module::rate::{self, EVERY_TICKS};
use crate::module::{Binding, ModuleBindings, ModuleKind, ModuleRef, PortSpecs};
use crate::parameter::{ParameterError, Parameters, Value};
use crate::scheme::{Command, CommandError, Instance, New};
use crate::signal::{DataType, TypeRef};
use crate::vocabulary::Vocabulary as _;

impl Engine {
    /// Changes the pending scheme while a transaction is open. Otherwise changes parameters and bindings in
    /// place, and the wiring in a transaction of its own.
    pub(super) fn change(&mut self, command: Command) -> Result<(), CommandError> {
        let changes_wiring =
            matches!(command, Command::PlugIn(_) | Command::Unplug(_) | Command::CloseModule(_));
        self.is_checked = false;
        if !changes_wiring {
            return self.edit(command);
        }
        if self.transaction.is_open() {
            let edited = self.edit(command);
            self.schedule_next();
            self.give_back_slots();
            return edited;
        }
        self.open(Transaction::SingleCommand);
        let edited = self.edit(command).and_then(|()| self.take_effect(command));
        edited.inspect_err(|_| self.drop_pending())
    }

    /// Applies a change of one command.
    fn take_effect(&mut self, command: Command) -> Result<(), CommandError> {
        self.schedule_next();
        if let Command::PlugIn(module) = command {
            self.admit(Some(module))?;
        }
        if self.is_running
            && let Some(fault) = self.first_fault_of(&self.schemes.pending().wiring)
        {
            return Err(CommandError::BreaksScheme(fault));
        }
        self.switch();
        Ok(())
    }

    fn edit(&mut self, command: Command) -> Result<(), CommandError> {
        match command {
            Command::PlugIn(module)
            | Command::InitModule(module)
            | Command::Set { module, .. }
            | Command::Bind { module, .. } => self.edit_instance(module, command),
            Command::Unplug(module) => self.unplug(module),
            Command::PlaceBefore(module) => {
                self.edited().wiring.find(module).ok_or(CommandError::NotPluggedIn(module))?;
                self.edited_mut().place_before = Some(module);
                Ok(())
            }
            Command::CloseModule(module) => self.close(module),
            // These commands change no scheme: `Engine::command` executes them.
            Command::ResetModule(_)
            | Command::Check
            | Command::Stop
            | Command::Reset
            | Command::Close
            | Command::Init
            | Command::Begin
            | Command::Commit
            | Command::Abort
            | Command::UploadLaw { .. }
            | Command::StoreLaw { .. }
            | Command::RemoveLaw { .. } => Ok(()),
        }
    }

    /// Executes a command to a module; creates the instance if needed. If the command is refused, restores
    /// the instance.
    fn edit_instance(&mut self, module: ModuleRef, command: Command) -> Result<(), CommandError> {
        let before = self.edited().instance(module).copied();
        if before.is_none() {
            self.create(module)?;
        }
        let done = match command {
            Command::PlugIn(_) => self.plug_in(module),
            Command::InitModule(_) => self.init(module),
            Command::Set { parameter, entry, value, .. } => self.set(module, parameter, entry, value),
            Command::Bind { port, signal, .. } => self.bind(module, port, signal),
            // The caller passes no other command.
            _ => Err(CommandError::UnknownModule(module)),
        };
        done.inspect_err(|_| self.restore(module, before))
    }

    fn restore(&mut self, module: ModuleRef, before: Option<Instance>) {
        let scheme = self.edited_mut();
        let changed = match (scheme.instance_mut(module), before) {
            (Some(instance), Some(before)) => Some(core::mem::replace(instance, before)),
            _ => scheme.instances.pop(),
        };
        if let Some(changed) = changed {
            self.give_back_blocks(&changed);
        }
    }

    fn bind(&mut self, module: ModuleRef, port: u8, signal: TypeRef) -> Result<(), CommandError> {
        self.known_type(signal)?;
        self.is_unplugged(module)?;
        let mut specs = PortSpecs::new();
        if !self.declare(self.edited(), module, &mut specs) {
            return Err(CommandError::TooManyPorts);
        }
        let spec = specs.get(usize::from(port)).filter(|spec| spec.data_type.is_some());
        let port = spec.ok_or(CommandError::UnknownPort(port))?.name;
        let bindings = &mut self.edited_mut().bindings;
        let is_it = |binding: &&mut Binding| binding.module == module && binding.port == port;
        if let Some(binding) = bindings.iter_mut().find(is_it) {
            binding.signal = signal;
            return Ok(());
        }
        bindings.push(Binding { module, port, signal }).map_err(|_| CommandError::TooManyWires)
    }

    fn set(
        &mut self,
        module: ModuleRef,
        parameter: u8,
        place: Option<u8>,
        value: Value,
    ) -> Result<(), CommandError> {
        if let Value::Type(signal) = value {
            self.known_type(signal)?;
        }
        let (entries, axis, element) = self.locate(module.kind, parameter, place)?;
        let may_restructure = !self.edited().is_plugged_in(module);
        if parameter == EVERY_TICKS {
            rate::PARAMETER.accepts.admit(value)?;
            if !may_restructure {
                return Err(ParameterError::WhilePluggedIn.into());
            }
            let instance = self.own_instance(module)?;
            instance.every_ticks = rate::from_value(value);
            let instance = *instance;
            self.prepare(&instance);
            return Ok(());
        }
        let instance = *self.own_instance(module)?;
        let configuration = instance.configuration;
        let mut result = Ok(());
        let mut visit = Parameters::set(parameter, element, value, may_restructure, &mut result);
        self.visit(module.kind, configuration, axis, &mut visit);
        if result.is_ok() && entries.is_per_axis() && place.is_none() {
            for other in 1..self.dof() {
                let mut result = Ok(());
                let mut visit = Parameters::set(parameter, None, value, may_restructure, &mut result);
                self.visit(module.kind, configuration, other, &mut visit);
            }
        }
        result?;
        self.prepare(&instance);
        Ok(())
    }

    fn kind_of(&self, module: ModuleRef) -> Result<&'static ModuleKind, CommandError> {
        let kind = self.kind(module.kind).filter(|_| module.number > 0);
        kind.ok_or(CommandError::UnknownModule(module))
    }

    fn create(&mut self, module: ModuleRef) -> Result<(), CommandError> {
        let (kind, dof) = (self.kind_of(module)?, self.device.dof());
        if self.edited().instances.is_full() {
            return Err(CommandError::TooManyModules);
        }
        let memory = self.data_base.storage_mut().take_at_end(kind.words(dof))?;
        let (configuration, state) = memory.split_at(kind.configuration_words(dof));
        let instance = Instance { reference: module, every_ticks: 1, configuration, state };
        let _ = self.edited_mut().instances.push(instance);
        self.set_defaults(&instance);
        Ok(())
    }

    /// Returns an instance to change; while a transaction is open, with its own configuration block for the
    /// pending scheme.
    fn own_instance(&mut self, module: ModuleRef) -> Result<&mut Instance, CommandError> {
        let missing = CommandError::NotPluggedIn(module);
        let shared = self.edited().instance(module).ok_or(missing)?.configuration;
        let is_own = shared.words == 0 || !self.transaction.is_open() || !self.schemes.share(module, shared);
        let own = if is_own { shared } else { self.data_base.storage_mut().take_copy_at_end(shared)? };
        let instance = self.edited_mut().instance_mut(module).ok_or(missing)?;
        instance.configuration = own;
        Ok(instance)
    }

    fn set_defaults(&mut self, instance: &Instance) {
        for axis in 0..self.dof() {
            self.visit(instance.reference.kind, instance.configuration, axis, &mut Parameters::defaults());
        }
        self.prepare(instance);
    }

    pub(super) fn reset(&mut self) {
        self.begin_anew(|_| true);
    }

    pub(super) fn begin(&mut self, is_meant: impl Fn(ModuleRef) -> bool) {
        self.schemes.running_mut().wiring.begin(is_meant);
        self.begins = true;
    }

    /// Initialises the modules as after a start, except those that outlast arming, and zeroes their outputs.
    pub(crate) fn begin_motion(&mut self) {
        let kinds = self.kinds();
        let begins = |module: ModuleRef| kinds.kind(module.kind).is_some_and(|kind| !kind.outlasts_arming());
        let wiring = &self.schemes.running().wiring;
        for plugged in wiring.modules().iter().filter(|plugged| begins(plugged.module)) {
            for port in wiring.ports(plugged).iter().filter(|port| port.is_written()) {
                self.data_base.overwrite(port.slot, core::iter::repeat(0));
            }
        }
        self.begin(begins);
    }

    fn init(&mut self, module: ModuleRef) -> Result<(), CommandError> {
        self.is_unplugged(module)?;
        let instance = self.own_instance(module)?;
        instance.every_ticks = 1;
        let instance = *instance;
        self.set_defaults(&instance);
        self.edited_mut().bindings.retain(|binding| binding.module != module);
        Ok(())
    }

    fn plug_in(&mut self, module: ModuleRef) -> Result<(), CommandError> {
        self.is_unplugged(module)?;
        let kind = self.kind_of(module)?;
        if self.schemes.running().is_plugged_in(module) {
            // The running scheme uses the shared block's handles.
            self.own_instance(module)?;
        }
        let settings = &self.settings(self.schemes.pending(), module, kind);
        let (running, pending) = self.schemes.split_mut();
        let place = pending.instances.iter().position(|instance| instance.reference == module);
        let instance = place.and_then(|place| pending.instances.get(place));
        let state = instance.map(|instance| instance.state);
        let goes_on = running.instance(module).map(|instance| instance.state) == state;
        let before = running.wiring.find(module).filter(|_| goes_on);
        let before = before.map(|plugged| (plugged, running.wiring.ports(plugged)));
        let end = pending.wiring.modules().len();
        // If the module has been removed, the end.
        let order = pending.place_before.and_then(|before| pending.wiring.order_of(before)).unwrap_or(end);
        let every_ticks = instance.map_or(1, |instance| instance.every_ticks);
        let instance = place.and_then(|place| u8::try_from(place).ok()).unwrap_or(u8::MAX);
        let new = New { module, instance, every_ticks, kind, settings, order, before };
        let bound = ModuleBindings { module, bindings: pending.bindings };
        pending.wiring.plug_in(&new, &self.device, &mut self.data_base, bound)?;
        pending.place_before = None;
        Ok(())
    }

    fn unplug(&mut self, module: ModuleRef) -> Result<(), CommandError> {
        let pending = self.edited_mut();
        pending.wiring.find(module).ok_or(CommandError::NotPluggedIn(module))?;
        pending.wiring.unplug(module);
        Ok(())
    }

    /// Deletes an instance.
    fn close(&mut self, module: ModuleRef) -> Result<(), CommandError> {
        let pending = self.edited_mut();
        let index = pending.instances.iter().position(|instance| instance.reference == module);
        let index = index.ok_or(CommandError::NotPluggedIn(module))?;
        let gone = pending.instances.remove(index);
        pending.bindings.retain(|binding| binding.module != module);
        if pending.is_plugged_in(module) {
            self.unplug(module)?;
        }
        self.edited_mut().wiring.forget_instance(index);
        self.give_back_blocks(&gone);
        Ok(())
    }

    fn is_unplugged(&self, module: ModuleRef) -> Result<(), CommandError> {
        if self.edited().is_plugged_in(module) { Err(CommandError::PluggedIn(module)) } else { Ok(()) }
    }

    fn known_type(&self, signal: TypeRef) -> Result<&'static DataType, CommandError> {
        let known = self.device.data_type(signal.id).filter(|_| signal.number > 0);
        known.ok_or(CommandError::UnknownType(signal))
    }
}
