//! What a tick may take, and what its modules add to it.

use core::num::NonZeroU32;

use super::Engine;
use crate::device::Counter;
use crate::module::{BoundReport, Costs, KindId};
use crate::scheme::{ActiveModule, Wiring};

impl Engine {
    /// What a tick may take, in processor cycles: a module that could make it longer is not plugged in, as soon as
    /// [costs](Self::set_costs) are known. None, as at first: as long as it likes. Modules that are plugged in stay.
    pub fn limit_cycles(&mut self, limit: Option<NonZeroU32>) {
        self.limit_cycles = limit;
    }

    /// What a tick and each kind of module cost. None, as at first: it is not known, and no module is refused for it.
    pub fn set_costs(&mut self, costs: Option<Costs>) {
        self.costs = costs;
    }

    /// Times each call of a module from the next change of the scheme on. A module whose call takes longer than its
    /// [cost](Self::set_costs), a quarter of it and `spare_cycles` more, is cut out, in that very tick, with all that
    /// depends on it. `spare_cycles` are for interrupts above the tick. A module whose cost is not known may take as long
    /// as it likes.
    // A call keeps the compiler from returning conditionally around it, which the stack's bound cannot follow.
    #[inline(never)]
    pub fn time_calls(&mut self, counter: Counter, spare_cycles: u32) {
        (self.counter, self.spare_cycles) = (Some(counter), spare_cycles);
    }

    /// What a tick takes at most with the modules that are plugged in, in processor cycles: its own
    /// [cost](crate::Cost) and that of each. None if one's is not known.
    #[must_use]
    pub fn tick_cycles(&self) -> Option<u32> {
        self.cycles_with(&self.schemes.running().wiring)
    }

    /// The same, and what it may take; none if it is not known.
    pub fn bound(&self) -> Option<BoundReport> {
        Some(BoundReport { cycles: self.tick_cycles()?, limit_cycles: self.limit_cycles })
    }

    pub(super) fn cycles_with(&self, wiring: &Wiring) -> Option<u32> {
        let mut costs = wiring.modules().iter().map(|plugged| self.cycles_in(wiring, plugged));
        let own = self.costs?.tick()?.cycles(self.device.dof());
        costs.try_fold(own, |sum, cycles| Some(sum.saturating_add(cycles?)))
    }

    /// What a module adds to a tick as it is wired: a signal of more words than there are axes costs what one of a
    /// device with as many axes does, for every word is passed on by the same code.
    pub(super) fn cycles_in(&self, wiring: &Wiring, plugged: &ActiveModule) -> Option<u32> {
        let signals = wiring.ports(plugged).iter().filter(|port| !port.is_memory());
        let words = signals.map(|port| self.data_base.words(port.slot).len()).max().unwrap_or(0);
        let own = self.costs?.kind(plugged.module.kind)?.cycles(words.max(self.device.dof()));
        if plugged.program == 0 {
            return Some(own);
        }
        Some(own.saturating_add(self.law_cycles(plugged.program)?))
    }

    /// What a module of a kind adds to a tick of this device, in processor cycles, with signals of at most one word per
    /// axis; none if that is not known.
    #[must_use]
    pub fn cycles_of(&self, kind: KindId) -> Option<u32> {
        Some(self.costs?.kind(kind)?.cycles(self.device.dof()))
    }
}
