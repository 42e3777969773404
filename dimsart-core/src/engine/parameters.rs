//! Parameters and ports of the modules.

use core::cell::Cell;

use heapless::Vec;

use super::Engine;
use crate::data_base::Block;
use crate::limits::MAX_PORTS;
use crate::module::rate::{self, EVERY_TICKS};
use crate::module::{Declare, Kind, KindId, MAX_HANDLES, MAX_SETTINGS_WORDS, ModuleRef, PortSpec, PortSpecs};
use crate::parameter::{Entries, Found, ParameterError, Parameters, Value};
use crate::scheme::{CommandError, Instance, Scheme};
use crate::signal::TypeRef;
use crate::vocabulary::Vocabulary as _;

impl Engine {
    /// Value of a module's parameter, in the next scheme while a transaction is open; that at `place` if it has [several](crate::Entries), the axis where each axis has
    /// one.
    ///
    /// # Errors
    /// [`CommandError`] when the module or the parameter does not exist, or has no such value.
    pub fn get(&mut self, module: ModuleRef, parameter: u8, place: u8) -> Result<Value, CommandError> {
        let instance = self.edited().instance(module).ok_or(CommandError::NotPluggedIn(module))?;
        if parameter == EVERY_TICKS && place == 0 {
            return Ok(rate::to_value(instance.every_ticks));
        }
        self.value_in(instance.configuration, module.kind, parameter, place)
    }

    #[inline(never)]
    pub(super) fn value_in(
        &mut self,
        configuration: Block,
        kind: KindId,
        parameter: u8,
        place: u8,
    ) -> Result<Value, CommandError> {
        const UNKNOWN: CommandError = CommandError::Parameter(ParameterError::Unknown);
        let (described, mut value) = self.look(configuration, kind, parameter, (0, None)).ok_or(UNKNOWN)?;
        // The first one is that of a parameter with one, too.
        if place > 0 {
            let at = described.entries.split(place, self.dof()).ok_or(ParameterError::NoSuchEntry)?;
            value = self.look(configuration, kind, parameter, at).and_then(|(_, value)| value);
        }
        value.ok_or(UNKNOWN)
    }

    /// A parameter and its value, in one visit: of an axis, and of several there the one in that place.
    #[inline(never)]
    pub(super) fn look(
        &mut self,
        configuration: Block,
        kind: KindId,
        parameter: u8,
        (axis, entry): (u8, Option<u8>),
    ) -> Option<Found> {
        let mut found = None;
        self.visit(kind, configuration, axis, &mut Parameters::get(parameter, entry, &mut found));
        found
    }

    /// How many values a parameter of a kind of module has, which axis holds the one at a place, and where; of all, the
    /// first axis. One value for a parameter that does not exist.
    #[inline(never)]
    pub(super) fn locate(
        &self,
        kind: KindId,
        parameter: u8,
        place: Option<u8>,
    ) -> Result<(Entries, u8, Option<u8>), ParameterError> {
        let found = self.kinds().describe_parameter(kind, parameter);
        let entries = found.map_or(Entries::ONE, |found| found.entries);
        let Some(place) = place else { return Ok((entries, 0, None)) };
        let (axis, element) = entries.split(place, self.dof()).ok_or(ParameterError::NoSuchEntry)?;
        Ok((entries, axis, element))
    }

    /// The ports of a module as its parameters are now, or in the next scheme while a transaction is open; as by default
    /// for one that does not exist.
    #[must_use]
    pub fn ports(&self, module: ModuleRef) -> Option<Vec<PortSpec, MAX_PORTS>> {
        let mut specs = Vec::new();
        self.declare(self.edited(), module, &mut specs).then_some(specs)
    }

    /// One of the [`ports`](Self::ports).
    #[inline(never)]
    pub(crate) fn port(&self, module: ModuleRef, index: u8) -> Option<PortSpec> {
        let mut specs = Vec::new();
        self.declare(self.edited(), module, &mut specs).then_some(())?;
        specs.get(usize::from(index)).copied()
    }

    /// Where a port is bound to, if a command said so; as [`ports`](Self::ports).
    #[must_use]
    pub fn binding(&self, module: ModuleRef, port_name: &str) -> Option<TypeRef> {
        self.edited().bound(module).signal(port_name)
    }

    /// Asks a module for its ports; false if there are too many, or no such kind.
    #[inline(never)]
    pub(super) fn declare(&self, scheme: &Scheme, module: ModuleRef, specs: &mut PortSpecs) -> bool {
        let Some(kind) = self.kind(module.kind) else { return false };
        let settings = self.settings(scheme, module, kind);
        let mut declare = Declare::new(&self.device, self.data_base.programs(), scheme.bound(module), specs);
        kind.ports(&settings, &mut declare, &[const { Cell::new(0) }; MAX_HANDLES]);
        declare.has_all()
    }

    /// A copy of a module's settings; the default ones of a module that does not exist.
    #[inline(never)]
    pub(super) fn settings(
        &self,
        scheme: &Scheme,
        module: ModuleRef,
        kind: &Kind,
    ) -> [Cell<u32>; MAX_SETTINGS_WORDS] {
        let copy = [const { Cell::new(0) }; MAX_SETTINGS_WORDS];
        match scheme.instance(module) {
            Some(instance) => {
                let words = self.data_base.storage().words(instance.configuration).unwrap_or_default();
                let settings = words.get(kind.settings()).unwrap_or_default();
                copy.iter().zip(settings).for_each(|(copy, word)| copy.set(*word));
            }
            None => {
                kind.set_defaults(&copy);
            }
        }
        copy
    }

    /// Visits the parameters of an instance, with the gains of an axis.
    #[inline(never)]
    pub(super) fn visit(&mut self, kind: KindId, configuration: Block, axis: u8, visit: &mut Parameters<'_>) {
        if let Some(kind) = self.kind(kind) {
            self.law_parameter(kind, configuration, visit);
            kind.parameters(&kind.configuration(self.data_base.own(configuration)), axis, visit);
        }
    }

    /// Works out what follows from an instance's parameters, and from how often it runs.
    #[inline(never)]
    pub(super) fn prepare(&mut self, instance: &Instance) {
        if let Some(kind) = self.kind(instance.reference.kind) {
            self.give_defaults_of_law(kind, instance.configuration);
            let device = self.device.with_period_of(instance.every_ticks);
            kind.prepare(&kind.configuration(self.data_base.own(instance.configuration)), &device);
        }
    }
}
