//! Parameters and ports of the modules.

use core::cell::Cell;

use heapless::Vec;

use super::Engine;
use crate::data_base::Block;
use crate::limits::MAX_PORTS;
use crate::module::rate::{self, EVERY_TICKS};
use crate::module::{
    Declarations, KindId, MAX_HANDLES, MAX_SETTINGS_WORDS, ModuleKind, ModuleRef, PortSpec, PortSpecs,
};
use crate::parameter::{Found, ParameterError, ParameterShape, Parameters, Value};
use crate::scheme::{CommandError, Instance, Scheme};
use crate::signal::TypeRef;
use crate::vocabulary::Vocabulary as _;

impl Engine {
    /// Returns the value of a module's parameter, in the pending scheme while a transaction is open; `place`
    /// is the index of one of [several values](crate::ParameterShape), such as the axis.
    ///
    /// # Errors
    /// [`CommandError`] when the module, the parameter or the value does not exist.
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
        // Index 0 is also valid for a parameter with one value.
        if place > 0 {
            let at = described.entries.split(place, self.dof()).ok_or(ParameterError::NoSuchEntry)?;
            value = self.look(configuration, kind, parameter, at).and_then(|(_, value)| value);
        }
        value.ok_or(UNKNOWN)
    }

    /// Returns a parameter and its value in one visit, for an axis and an index.
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

    /// Returns the number of values of a parameter, the axis that holds the value at a place, and its index
    /// there; for all values the first axis. One value if the parameter does not exist.
    #[inline(never)]
    pub(super) fn locate(
        &self,
        kind: KindId,
        parameter: u8,
        place: Option<u8>,
    ) -> Result<(ParameterShape, u8, Option<u8>), ParameterError> {
        let found = self.kinds().describe_parameter(kind, parameter);
        let entries = found.map_or(ParameterShape::ONE, |found| found.entries);
        let Some(place) = place else { return Ok((entries, 0, None)) };
        let (axis, element) = entries.split(place, self.dof()).ok_or(ParameterError::NoSuchEntry)?;
        Ok((entries, axis, element))
    }

    /// Returns the ports of a module with its current parameters, in the pending scheme while a transaction
    /// is open; with default parameters if the instance does not exist.
    #[must_use]
    pub fn ports(&self, module: ModuleRef) -> Option<Vec<PortSpec, MAX_PORTS>> {
        let mut specs = Vec::new();
        self.declare(self.edited(), module, &mut specs).then_some(specs)
    }

    /// Returns one of the [`ports`](Self::ports).
    #[inline(never)]
    pub(crate) fn port(&self, module: ModuleRef, index: u8) -> Option<PortSpec> {
        let mut specs = Vec::new();
        self.declare(self.edited(), module, &mut specs).then_some(())?;
        specs.get(usize::from(index)).copied()
    }

    /// Returns the signal that a command has bound to a port, for the same scheme as [`ports`](Self::ports).
    #[must_use]
    pub fn binding(&self, module: ModuleRef, port_name: &str) -> Option<TypeRef> {
        self.edited().bound(module).signal(port_name)
    }

    /// Collects a module's ports; false if there are too many, or no such kind.
    #[inline(never)]
    pub(super) fn declare(&self, scheme: &Scheme, module: ModuleRef, specs: &mut PortSpecs) -> bool {
        let Some(kind) = self.kind(module.kind) else { return false };
        let settings = self.settings(scheme, module, kind);
        let mut declare =
            Declarations::new(&self.device, self.data_base.programs(), scheme.bound(module), specs);
        kind.ports(&settings, &mut declare, &[const { Cell::new(0) }; MAX_HANDLES]);
        declare.has_all()
    }

    /// Copies a module's settings; default settings if the instance does not exist.
    #[inline(never)]
    pub(super) fn settings(
        &self,
        scheme: &Scheme,
        module: ModuleRef,
        kind: &ModuleKind,
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

    /// Computes the values derived from an instance's parameters and period.
    #[inline(never)]
    pub(super) fn prepare(&mut self, instance: &Instance) {
        if let Some(kind) = self.kind(instance.reference.kind) {
            self.give_defaults_of_law(kind, instance.configuration);
            let device = self.device.with_period_of(instance.every_ticks);
            kind.prepare(&kind.configuration(self.data_base.own(instance.configuration)), &device);
        }
    }
}
