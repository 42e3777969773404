//! Fault containment: each module's outputs are checked after its call. A module with an invalid output is
//! isolated together with its dependents, until a reset or until a change of the scheme removes it.

use super::Engine;
use crate::data_base::CheckedWords;
use crate::module::ModuleRef;
use crate::scheme::ActiveModule;
use crate::scheme::wiring::module_bit;
use crate::signal::TypeRef;

/// Reason why a module was isolated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ModuleFault {
    /// The module.
    pub module: ModuleRef,
    /// The cause.
    pub cause: FaultCause,
}

/// Cause of a module fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FaultCause {
    /// It wrote NaN, infinity, or a value beyond the [maximum](crate::Unit::max_magnitude) of its signal's unit.
    InvalidOutput {
        /// The signal.
        signal: TypeRef,
        /// Word of the signal, from 0.
        word: u16,
        /// The value, `f32` bits.
        bits: u32,
    },
    /// A call exceeded its [time budget](Engine::set_call_timer).
    TimeExceeded {
        /// The budget, in processor cycles.
        budget_cycles: u32,
    },
}

impl Engine {
    /// Returns the failed modules, one bit per place in the plug-in order.
    pub fn failed(&self) -> u32 {
        self.failed
    }

    /// Returns the first failed module in plug-in order that an input of the device depends on.
    #[inline]
    pub(crate) fn lost_device(&self) -> Option<ModuleRef> {
        if self.failed == 0 {
            return None;
        }
        let wiring = &self.schemes.running().wiring;
        let drivers = self.failed & wiring.drives_device();
        let first = usize::try_from(drivers.trailing_zeros()).ok().filter(|_| drivers != 0)?;
        wiring.modules().get(first).map(|plugged| plugged.module)
    }

    /// Returns the module fault, until a reset or until a change of the scheme removes the module. Modules
    /// that do not depend on it continue. Of several, returns the first in plug-in order that the device
    /// depends on, otherwise the first.
    #[must_use]
    pub fn module_fault(&self) -> Option<ModuleFault> {
        let failed = self.failed;
        let drivers = failed & self.schemes.running().wiring.drives_device();
        self.module_faults(if drivers == 0 { failed } else { drivers }).next()
    }

    /// Returns the faults of these modules, one bit per place in the plug-in order.
    pub fn module_faults(&self, places: u32) -> impl Iterator<Item = ModuleFault> + '_ {
        let modules = (0..).zip(self.schemes.running().wiring.modules());
        let modules = modules.filter(move |(order, _)| places & module_bit(*order) != 0);
        modules.map(|(_, plugged)| self.fault_of(plugged))
    }

    fn fault_of(&self, plugged: &ActiveModule) -> ModuleFault {
        let data_base = &self.data_base;
        let ports = self.schemes.running().wiring.ports(plugged).iter();
        let mut wrong = ports.filter(|port| port.is_written()).filter_map(|port| {
            let span = CheckedWords::new(data_base.storage().block(port.slot), port.largest()?);
            let mut words = (0..).zip(data_base.words(port.slot));
            let (word, bits) = words.find(|(_, word)| span.is_wrong(**word))?;
            Some((data_base.entry(port.slot)?.signal, word, *bits))
        });
        // If the written values are valid, the call took too long.
        let cause = wrong.next().map_or_else(
            || FaultCause::TimeExceeded { budget_cycles: self.budget_cycles(plugged) },
            |(signal, word, bits)| FaultCause::InvalidOutput { signal, word, bits },
        );
        ModuleFault { module: plugged.module, cause }
    }

    /// Returns the budget of a module's call in processor cycles.
    fn budget_cycles(&self, plugged: &ActiveModule) -> u32 {
        let counts_per_cycle = self.counter.map_or(1, |counter| counter.counts_per_cycle());
        self.schemes.running().wiring.budget_of(plugged.module) / counts_per_cycle
    }

    /// Returns the isolated modules: the failed modules and their dependents.
    pub fn isolated_modules(&self) -> impl Iterator<Item = ModuleRef> + '_ {
        let modules = self.schemes.running().wiring.modules().iter();
        modules.filter(|plugged| plugged.needs & self.failed != 0).map(|plugged| plugged.module)
    }

    /// Initialises the selected modules at their next call, including isolated ones and their dependents.
    pub(super) fn begin_anew(&mut self, is_meant: impl Fn(ModuleRef) -> bool) {
        let modules = (0..).zip(self.schemes.running().wiring.modules());
        let meant = modules.filter(|(_, plugged)| is_meant(plugged.module));
        let meant = meant.fold(0, |meant, (order, _)| meant | module_bit(order));
        let fallen = self.schemes.running().wiring.fall_with(self.failed);
        let still_failed = self.failed & !meant;
        self.clear_writes(fallen & !still_failed);
        self.begin(is_meant);
        self.contain_anew(still_failed, fallen);
    }

    /// Zeroes the outputs of these modules. One bit per place in the plug-in order.
    pub(super) fn clear_writes(&mut self, modules: u32) {
        let wiring = &self.schemes.running().wiring;
        for (order, plugged) in (0..).zip(wiring.modules()) {
            if modules & module_bit(order) != 0 {
                for port in wiring.ports(plugged).iter().filter(|port| port.is_written()) {
                    self.data_base.overwrite(port.slot, core::iter::repeat(0));
                }
            }
        }
    }

    /// Isolates these failed modules and their dependents, and no others. Modules in `before` that are no
    /// longer isolated are initialised. One bit per place in the plug-in order.
    pub(super) fn contain_anew(&mut self, failed: u32, before: u32) {
        let wiring = &mut self.schemes.running_mut().wiring;
        let back = before & !wiring.fall_with(failed);
        wiring.begin_places(back);
        let returning = (0..).zip(wiring.modules()).filter(|(order, _)| back & module_bit(*order) != 0);
        for end in returning.filter_map(|(_, plugged)| plugged.link_end) {
            // A packet received in the meantime may be old.
            let heard = (0..).zip(self.data_base.links()).filter(|(link, _)| end.receives_from(*link));
            heard.for_each(|(_, port)| port.forget_received());
        }
        self.begins |= back != 0;
        self.failed = failed;
    }
}
