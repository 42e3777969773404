//! Transactions: the pending scheme is built and checked, and replaces the running scheme atomically between
//! two ticks.

use heapless::Vec;

use super::Engine;
use crate::data_base::{Block, bit};
use crate::limits::MAX_MODULES;
use crate::module::ModuleRef;
use crate::packet::LinkPort;
use crate::scheme::schedule::schedule;
use crate::scheme::wiring::module_bit;
use crate::scheme::{ActiveModule, CommandError, Instance};
use crate::signal::DataType;

/// State of the pending scheme.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Transaction {
    None = 0,
    /// Open for the current command.
    SingleCommand,
    /// Open for any number of commands.
    Open,
    /// As [`Open`](Self::Open); a stopped scheme starts with the commit.
    OpenWithStart,
}

impl Transaction {
    pub(super) fn is_there(self) -> bool {
        self != Self::None
    }

    pub(super) fn is_open(self) -> bool {
        matches!(self, Self::Open | Self::OpenWithStart)
    }
}

impl Engine {
    /// Returns whether a transaction is open.
    #[must_use]
    pub fn is_in_transaction(&self) -> bool {
        self.transaction.is_open()
    }

    pub(super) fn open_transaction(&mut self) -> Result<(), CommandError> {
        if self.transaction.is_open() {
            return Err(CommandError::TransactionOpen);
        }
        self.open(Transaction::Open);
        Ok(())
    }

    /// Opens a transaction with a copy of the running scheme.
    pub(super) fn open(&mut self, transaction: Transaction) {
        self.is_checked = false;
        let (running, pending) = self.schemes.split_mut();
        pending.copy_from(running);
        self.transaction = transaction;
    }

    pub(super) fn abort(&mut self) -> Result<(), CommandError> {
        if !self.transaction.is_open() {
            return Err(CommandError::NoTransaction);
        }
        self.drop_pending();
        Ok(())
    }

    pub(super) fn commit(&mut self) -> Result<(), CommandError> {
        if !self.transaction.is_open() {
            return Err(CommandError::NoTransaction);
        }
        let starts = self.transaction == Transaction::OpenWithStart;
        if self.is_running || starts {
            self.check_all()?;
        }
        self.admit(None)?;
        self.switch();
        if starts && !self.is_running {
            self.start();
        }
        Ok(())
    }

    /// Checks the scheme and starts it; during a transaction, at its commit.
    pub(super) fn check_and_start(&mut self) -> Result<(), CommandError> {
        self.check_all()?;
        if self.transaction.is_open() {
            self.transaction = Transaction::OpenWithStart;
        } else if !self.is_running {
            self.start();
        }
        Ok(())
    }

    /// Returns an error if the edited scheme has a fault. An unchanged pending scheme is not checked again.
    fn check_all(&mut self) -> Result<(), CommandError> {
        if self.is_checked {
            return Ok(());
        }
        let (_, faults) = self.finding(0);
        self.is_checked = faults == 0 && self.transaction.is_open();
        if faults > 0 { Err(CommandError::HasFaults { faults }) } else { Ok(()) }
    }

    /// Stops the scheme; a commit does not restart it.
    pub(super) fn stop(&mut self) {
        self.is_running = false;
        if self.transaction == Transaction::OpenWithStart {
            self.transaction = Transaction::Open;
        }
    }

    /// Starts with reset states and signals, as after power-up: old values are invalid.
    fn start(&mut self) {
        self.reset();
        self.data_base.zero_signals();
        self.data_base.links().iter().for_each(LinkPort::forget_received);
        self.is_running = true;
    }

    /// Returns the module to name when the pending scheme takes too long: one of unknown cost, or the most
    /// expensive new module, or the most expensive of all.
    fn dearest_new_module(&self) -> Option<ModuleRef> {
        let (running, pending) = (self.schemes.running(), &self.schemes.pending().wiring);
        let dearness = |plugged: &&ActiveModule| {
            let cycles = self.cycles_in(pending, plugged);
            (cycles.is_none(), !running.is_plugged_in(plugged.module), cycles)
        };
        pending.modules().iter().max_by_key(dearness).map(|plugged| plugged.module)
    }

    /// Checks that a tick of the pending scheme keeps its limit. Otherwise names this module, or the most
    /// expensive one.
    pub(super) fn admit(&self, module: Option<ModuleRef>) -> Result<(), CommandError> {
        let Some((limit, _)) = self.limit_cycles.zip(self.costs) else { return Ok(()) };
        let wiring = &self.schemes.pending().wiring;
        let tick_cycles = self.cycles_with(wiring);
        if tick_cycles.is_some_and(|cycles| cycles <= limit.get()) {
            return Ok(());
        }
        let Some(module) = module.or_else(|| self.dearest_new_module()) else { return Ok(()) };
        let own = wiring.find(module).and_then(|plugged| self.cycles_in(wiring, plugged));
        let (cycles, tick_cycles) = own.zip(tick_cycles).ok_or(CommandError::CostUnknown(module))?;
        Err(CommandError::TooSlow { module, cycles, tick_cycles, limit_cycles: limit.get() })
    }

    /// Computes the order of calls and the dependencies of the pending scheme.
    pub(super) fn schedule_next(&mut self) {
        let of_device = self.slots_of(self.device.inputs);
        let kinds = self.kinds();
        let wiring = &mut self.schemes.pending_mut().wiring;
        wiring.find_needs(of_device);
        let calls = schedule(wiring);
        wiring.set_calls(calls.into_iter(), |id| kinds.kind(id));
    }

    /// Swaps the schemes. Modules in both keep their state, others are initialised.
    pub(super) fn switch(&mut self) {
        let failed = self.failed;
        let fallen = self.schemes.running().wiring.fall_with(failed);
        let (mut still_failed, mut were_out, mut stay) = (0, 0, 0);
        let (running, pending) = self.schemes.split_mut();
        let modules = (0..).zip(running.wiring.modules());
        let sound = modules.filter(|(order, _)| fallen & module_bit(*order) == 0);
        let written = sound.fold(0, |slots, (_, plugged)| slots | running.wiring.writes(plugged));
        for order in 0..pending.wiring.modules().len() {
            let Some(plugged) = pending.wiring.modules().get(order) else { break };
            let at = running.wiring.order_of(plugged.module);
            let before = at.and_then(|at| running.wiring.modules().get(at));
            let before = before.filter(|there| pending.continues(plugged, running, there));
            let end = plugged.link_end.filter(|_| before.is_none());
            let begins = before.is_none_or(|before| before.begins);
            for (link, port) in (0..).zip(self.data_base.links()) {
                if end.is_some_and(|end| end.receives_from(link)) {
                    port.forget_received();
                }
            }
            let takes_over = before.map_or(self.is_running, |before| before.takes_over);
            let takes_over = takes_over && pending.wiring.writes(plugged) & written != 0;
            let own = u8::try_from(order).map_or(0, module_bit);
            let place = at.filter(|_| before.is_some());
            let place = place.and_then(|place| u8::try_from(place).ok()).map_or(0, module_bit);
            still_failed |= if failed & place == 0 { 0 } else { own };
            stay |= failed & place;
            were_out |= if fallen & place == 0 { 0 } else { own };
            if let Some(plugged) = pending.wiring.at_mut(order) {
                // It is now part of the running scheme.
                plugged.is_alike = true;
                (plugged.begins, plugged.takes_over) = (begins, takes_over);
            }
            self.begins |= begins;
        }
        pending.connect(self.data_base.storage_mut());
        self.weigh_next();
        self.clear_writes(fallen & !stay);
        self.schemes.switch();
        self.contain_anew(still_failed, were_out);
        self.drop_pending();
    }

    /// Assigns phases and time budgets to the modules of the pending scheme.
    fn weigh_next(&mut self) {
        let pending = &self.schemes.pending().wiring;
        let costs = pending.modules().iter().map(|plugged| self.cycles_in(pending, plugged));
        let costs = costs.collect::<Vec<_, MAX_MODULES>>();
        let spare_cycles = self.spare_cycles;
        let counts_per_cycle = self.counter.map_or(1, |counter| counter.counts_per_cycle());
        let (running, pending) = self.schemes.split_mut();
        let before = self.is_running.then_some(&running.wiring);
        pending.wiring.spread(before, &costs);
        pending.wiring.set_budgets(&costs, spare_cycles, counts_per_cycle);
    }

    /// Returns whether a module takes over from another one in the next tick.
    pub(crate) fn is_taking_over(&self) -> bool {
        let mut modules = self.schemes.running().wiring.modules().iter();
        self.begins && modules.any(|plugged| plugged.begins && plugged.takes_over)
    }

    /// Discards the pending scheme and frees blocks that the running scheme does not use.
    pub(super) fn drop_pending(&mut self) {
        (self.transaction, self.is_checked) = (Transaction::None, false);
        self.clear_next();
    }

    /// Deletes the modules of the pending scheme.
    fn clear_next(&mut self) {
        while let Some(instance) = self.schemes.pending_mut().instances.pop() {
            let place = self.schemes.pending().instances.len();
            let there = self.schemes.running().instances.get(place);
            // Most modules are in both schemes at the same index.
            if there.is_none_or(|there| there.blocks() != instance.blocks()) {
                self.give_back_blocks(&instance);
            }
        }
        let pending = self.schemes.pending_mut();
        pending.wiring.clear();
        pending.bindings.clear();
        pending.place_before = None;
        self.give_back_slots();
    }

    /// Deletes every module; stops the scheme unless a transaction is open.
    pub(super) fn close_all(&mut self) {
        if self.transaction.is_open() {
            (self.transaction, self.is_checked) = (Transaction::Open, false);
        } else {
            self.is_running = false;
            self.schemes.switch();
            self.failed = 0;
        }
        self.clear_next();
    }

    /// Frees the blocks of a deleted instance that no scheme uses.
    pub(super) fn give_back_blocks(&mut self, instance: &Instance) {
        let [configuration, mut state] = instance.blocks();
        if self.give_back(instance.reference, configuration) && state.offset < configuration.offset {
            state.offset += configuration.words;
        }
        self.give_back(instance.reference, state);
    }

    /// Frees a module's block unless a scheme uses it; returns whether it did.
    fn give_back(&mut self, module: ModuleRef, block: Block) -> bool {
        if block.words == 0 || self.schemes.have(module, block) {
            return false;
        }
        self.data_base.storage_mut().give_back_at_end(block);
        self.schemes.close_gap(block);
        self.has_moved = true;
        true
    }

    /// Frees slots that neither a scheme nor the device uses.
    pub(super) fn give_back_slots(&mut self) {
        let of_device = self.slots_of(self.device.outputs) | self.slots_of(self.device.inputs);
        let of_schemes = self.schemes.running().wiring.slots() | self.schemes.pending().wiring.slots();
        self.has_moved |= self.data_base.keep_only(of_schemes | of_device);
    }

    /// Returns the slots of types of the device, one bit each.
    #[inline(never)]
    fn slots_of(&self, types: &[&DataType]) -> u64 {
        let slots = types.iter().filter_map(|data_type| self.data_base.slot(data_type.first()));
        slots.fold(0, |slots, slot| slots | bit(slot))
    }

    /// Updates handles, calls and containment if words have moved.
    pub(super) fn follow_moves(&mut self) {
        if core::mem::take(&mut self.has_moved) {
            self.schemes.running_mut().connect(self.data_base.storage_mut());
        }
    }
}
