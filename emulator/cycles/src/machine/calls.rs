//! Calls of marked functions: when they begin, when they return.

use std::collections::BTreeSet;

use super::stack::Stack;
use crate::concrete::Concrete;
use crate::instruction::{LR, SP};
use crate::state::Registers;

/// A call of a marked function, from its first instruction to its return, that included.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Call {
    /// Its address.
    pub function: u32,
    /// Cycles of the timing model, those of functions that it calls included.
    pub cycles: u64,
    /// Instructions, likewise.
    pub instructions: u64,
    /// Bytes of stack that it and what it calls reserved at most.
    pub stack_bytes: u32,
}

/// How far a run is.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Moment {
    pub(super) cycles: u64,
    pub(super) instructions: u64,
}

/// A call that has not returned.
#[derive(Debug, Clone)]
struct Open {
    /// Its place among all calls.
    index: usize,
    function: u32,
    /// With bit 0, as in LR.
    returns_to: u32,
    /// SP at its begin and after its return.
    stack: u32,
    began: Moment,
    /// Lowest SP of what encloses it until it began.
    lowest_around: u32,
}

/// What a call is does not depend on how the jump there is written: it ends when the program comes to where LR pointed
/// when it began, with the stack as it was then. A tail call's caller therefore ends with it.
#[derive(Debug, Clone, Default)]
pub(super) struct Calls {
    marked: BTreeSet<u32>,
    open: Vec<Open>,
    calls: Vec<Call>,
}

impl Calls {
    pub(super) fn mark(&mut self, functions: impl IntoIterator<Item = u32>) {
        self.marked.extend(functions.into_iter().map(|address| address & !1));
    }

    pub(super) fn begin(&mut self) {
        self.open.clear();
        self.calls.clear();
    }

    /// All calls of a run that is over.
    pub(super) fn take(&mut self) -> Vec<Call> {
        std::mem::take(&mut self.calls)
    }

    /// The program has jumped to an address.
    #[inline]
    pub(super) fn jumped(
        &mut self,
        address: u32,
        registers: &Registers<Concrete>,
        stack: &mut Stack,
        now: Moment,
    ) {
        let pointer = registers.read(SP);
        while let Some(open) =
            self.open.pop_if(|open| open.returns_to & !1 == address && open.stack == pointer)
        {
            if let Some(call) = self.calls.get_mut(open.index) {
                call.cycles = now.cycles - open.began.cycles;
                call.instructions = now.instructions - open.began.instructions;
                call.stack_bytes = stack.leave(pointer, open.lowest_around);
            }
        }
        if self.marked.contains(&address) {
            self.enter(address, registers, stack, now);
        }
    }

    fn enter(&mut self, function: u32, registers: &Registers<Concrete>, stack: &mut Stack, began: Moment) {
        let (pointer, returns_to) = (registers.read(SP), registers.read(LR));
        // A loop whose first instruction is the function's own.
        let goes_on = self.open.last().is_some_and(|open| {
            (open.function, open.returns_to, open.stack) == (function, returns_to, pointer)
        });
        if goes_on {
            return;
        }
        let index = self.calls.len();
        self.calls.push(Call { function, ..Call::default() });
        let lowest_around = stack.enter(pointer);
        self.open.push(Open { index, function, returns_to, stack: pointer, began, lowest_around });
    }
}
