//! What calls may take, where somebody has a counter.

use super::{Call, Wiring};
use crate::module::ModuleRef;

impl Wiring {
    /// Each call may take what its module costs, a quarter more, for costs are those of a model of the processor, and
    /// what interrupts may take meanwhile. Where a cost is not known, as long as it likes.
    pub(crate) fn set_budgets(&mut self, costs: &[Option<u32>], spare_cycles: u32, counts_per_cycle: u32) {
        for call in self.calls.iter_mut() {
            let cost = costs.get(usize::from(call.order)).copied().flatten();
            let cycles = cost.map(|cost| cost.saturating_add(cost / 4).saturating_add(spare_cycles));
            call.budget_counts = cycles.map_or(u32::MAX, |cycles| cycles.saturating_mul(counts_per_cycle));
        }
    }

    /// What a call of a module may take.
    pub(crate) fn budget_of(&self, module: ModuleRef) -> u32 {
        let order = self.order_of(module).and_then(|order| u8::try_from(order).ok());
        let call = self.calls.iter().find(|call| Some(call.order) == order);
        call.map_or(u32::MAX, |call: &Call| call.budget_counts)
    }
}
