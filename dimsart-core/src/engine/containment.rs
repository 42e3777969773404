//! Containment: what a module writes is looked at right behind its call. A module that wrote what its signal cannot be is
//! cut out, with all that depend on it, until a reset or until another scheme has no place for it.

use super::Engine;
use crate::data_base::CheckedWords;
use crate::module::ModuleRef;
use crate::scheme::ActiveModule;
use crate::scheme::wiring::module_bit;
use crate::signal::TypeRef;

/// Why a module was cut out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ModuleFault {
    /// The module.
    pub module: ModuleRef,
    /// What it did that it must not.
    pub cause: FaultCause,
}

/// What a module does that it must not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FaultCause {
    /// It wrote what its signal cannot be: no finite number, or one beyond what its unit [can be](crate::Unit::largest).
    Wrote {
        /// The signal.
        signal: TypeRef,
        /// Which of the signal's words, from 0.
        word: u16,
        /// The word, an `f32` in bits.
        bits: u32,
    },
    /// A call of it took [longer](Engine::time_calls) than it may.
    TookTooLong {
        /// What it may take, in processor cycles.
        budget_cycles: u32,
    },
}

impl Engine {
    /// Modules that have failed, a bit for each place in the plug-in order.
    pub fn failed(&self) -> u32 {
        self.failed
    }

    /// The module that failed, when an input of the device depends on it; the first one in plug-in order of several.
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

    /// What a module wrote that failed, while modules are cut out for that; until a reset, or until a change of the scheme
    /// leaves it out. Whatever does not depend on it runs on. Of several, it is the first one in plug-in order that the
    /// device gets nothing without, or else the first one.
    #[must_use]
    pub fn module_fault(&self) -> Option<ModuleFault> {
        let failed = self.failed;
        let drivers = failed & self.schemes.running().wiring.drives_device();
        self.faults_of(if drivers == 0 { failed } else { drivers }).next()
    }

    /// What each of these modules wrote, a bit for each place in the plug-in order.
    pub fn faults_of(&self, places: u32) -> impl Iterator<Item = ModuleFault> + '_ {
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
        // What it wrote is as it should be: only its time is left.
        let cause = wrong.next().map_or_else(
            || FaultCause::TookTooLong { budget_cycles: self.budget_cycles(plugged) },
            |(signal, word, bits)| FaultCause::Wrote { signal, word, bits },
        );
        ModuleFault { module: plugged.module, cause }
    }

    /// What a call of a module may take, in processor cycles.
    fn budget_cycles(&self, plugged: &ActiveModule) -> u32 {
        let counts_per_cycle = self.counter.map_or(1, |counter| counter.counts_per_cycle());
        self.schemes.running().wiring.budget_of(plugged.module) / counts_per_cycle
    }

    /// Modules that are cut out: those that failed, and all that depend on them.
    pub fn fallen_modules(&self) -> impl Iterator<Item = ModuleRef> + '_ {
        let modules = self.schemes.running().wiring.modules().iter();
        modules.filter(|plugged| plugged.needs & self.failed != 0).map(|plugged| plugged.module)
    }

    /// Begins these modules anew, also those that are cut out, with what fell with them.
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

    /// What these modules wrote becomes zero: nobody is to read it. A bit for each place in the plug-in order.
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

    /// Cuts out those that fall with these modules that have failed, and no other. Those that were cut out before and are
    /// not any more begin. A bit for each place in the plug-in order.
    pub(super) fn contain_anew(&mut self, failed: u32, before: u32) {
        let wiring = &mut self.schemes.running_mut().wiring;
        let back = before & !wiring.fall_with(failed);
        wiring.begin_places(back);
        let returning = (0..).zip(wiring.modules()).filter(|(order, _)| back & module_bit(*order) != 0);
        for end in returning.filter_map(|(_, plugged)| plugged.link_end) {
            // What came while it was cut out may be long past.
            let heard = (0..).zip(self.data_base.links()).filter(|(link, _)| end.listens_to(*link));
            heard.for_each(|(_, port)| port.forget_received());
        }
        self.begins |= back != 0;
        self.failed = failed;
    }
}
