//! Time budgets of calls.

use super::{Call, Wiring};
use crate::module::ModuleRef;

impl Wiring {
    /// Sets the budget of each call: the cost of its module plus a quarter (costs come from a processor
    /// model), plus `spare_cycles` for interrupts. A call of unknown cost has no limit.
    pub(crate) fn set_budgets(&mut self, costs: &[Option<u32>], spare_cycles: u32, counts_per_cycle: u32) {
        for call in self.calls.iter_mut() {
            let cost = costs.get(usize::from(call.order)).copied().flatten();
            let cycles = cost.map(|cost| cost.saturating_add(cost / 4).saturating_add(spare_cycles));
            call.budget_counts = cycles.map_or(u32::MAX, |cycles| cycles.saturating_mul(counts_per_cycle));
        }
    }

    /// Returns the budget of a module's call.
    pub(crate) fn budget_of(&self, module: ModuleRef) -> u32 {
        let order = self.order_of(module).and_then(|order| u8::try_from(order).ok());
        let call = self.calls.iter().find(|call| Some(call.order) == order);
        call.map_or(u32::MAX, |call: &Call| call.budget_counts)
    }
}
