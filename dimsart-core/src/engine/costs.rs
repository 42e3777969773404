//! Cycle limit of a tick and cycle costs of its modules.

use core::num::NonZeroU32;

use super::Engine;
use crate::device::Counter;
use crate::module::{BoundReport, Costs, KindId};
use crate::scheme::{ActiveModule, Wiring};

impl Engine {
    /// Limits the cycles of a tick: once [costs](Self::set_costs) are known, a module that could exceed the
    /// limit is not plugged in. None, the default, is no limit. Modules already plugged in are kept.
    pub fn set_cycle_limit(&mut self, limit: Option<NonZeroU32>) {
        self.limit_cycles = limit;
    }

    /// Sets the costs of a tick and of each module kind. None, the default: costs are unknown and no module
    /// is refused.
    pub fn set_costs(&mut self, costs: Option<Costs>) {
        self.costs = costs;
    }

    /// Limits the time of each module call, from the next change of the scheme on. A call may take the
    /// module's [cost](Self::set_costs) plus a quarter plus `spare_cycles` for interrupts; a module that
    /// exceeds it is isolated in the same tick, together with its dependents. Modules of unknown cost have no
    /// limit.
    // A call prevents a conditional return around it, which the stack analysis cannot follow.
    #[inline(never)]
    pub fn set_call_timer(&mut self, counter: Counter, spare_cycles: u32) {
        (self.counter, self.spare_cycles) = (Some(counter), spare_cycles);
    }

    /// Returns the maximum cycles of a tick: the tick's own [cost](crate::Cost) and all modules' costs.
    /// None if a cost is unknown.
    #[must_use]
    pub fn tick_cycles(&self) -> Option<u32> {
        self.cycles_with(&self.schemes.running().wiring)
    }

    /// Returns these cycles with the limit; none if unknown.
    pub fn tick_bound(&self) -> Option<BoundReport> {
        Some(BoundReport { cycles: self.tick_cycles()?, limit_cycles: self.limit_cycles })
    }

    pub(super) fn cycles_with(&self, wiring: &Wiring) -> Option<u32> {
        let mut costs = wiring.modules().iter().map(|plugged| self.cycles_in(wiring, plugged));
        let own = self.costs?.tick()?.cycles(self.device.dof());
        costs.try_fold(own, |sum, cycles| Some(sum.saturating_add(cycles?)))
    }

    /// Returns the cycles that a module adds to a tick as it is wired. A signal with more words than axes
    /// costs as much as on a device with that many axes.
    pub(super) fn cycles_in(&self, wiring: &Wiring, plugged: &ActiveModule) -> Option<u32> {
        let signals = wiring.ports(plugged).iter().filter(|port| !port.is_memory());
        let words = signals.map(|port| self.data_base.words(port.slot).len()).max().unwrap_or(0);
        let own = self.costs?.kind(plugged.module.kind)?.cycles(words.max(self.device.dof()));
        if plugged.program == 0 {
            return Some(own);
        }
        Some(own.saturating_add(self.law_cycles(plugged.program)?))
    }

    /// Returns the cycles that a module of a kind adds to a tick of this device, with signals of at most one
    /// word per axis; none if unknown.
    #[must_use]
    pub fn module_cycles(&self, kind: KindId) -> Option<u32> {
        Some(self.costs?.kind(kind)?.cycles(self.device.dof()))
    }
}
