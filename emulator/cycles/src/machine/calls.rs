//! Calls of marked functions: detection of their start and return.

use std::collections::BTreeSet;

use super::stack::Stack;
use crate::concrete::Concrete;
use crate::instruction::{LR, SP};
use crate::state::Registers;

/// A call of a marked function, from its first instruction to its return, including the return.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Call {
    /// Address of the function.
    pub function: u32,
    /// Cycles of the timing model, including callees.
    pub cycles: u64,
    /// Instructions, including callees.
    pub instructions: u64,
    /// Maximum bytes of stack reserved by the function and its callees.
    pub stack_bytes: u32,
}

/// The progress of a run.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Moment {
    pub(super) cycles: u64,
    pub(super) instructions: u64,
}

/// An active call.
#[derive(Debug, Clone)]
struct Open {
    /// Index among all calls.
    index: usize,
    function: u32,
    /// Return address with bit 0 set, as in LR.
    returns_to: u32,
    /// SP at its start and after its return.
    stack: u32,
    began: Moment,
    /// Lowest SP of the enclosing call before this call.
    lowest_around: u32,
}

/// Detects calls independent of the type of jump instruction: a call ends when the program reaches the
/// address that LR held at its start, with SP as at its start. A caller with a tail call therefore ends
/// together with its callee.
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

    /// All calls of a finished run.
    pub(super) fn take(&mut self) -> Vec<Call> {
        std::mem::take(&mut self.calls)
    }

    /// Handles a jump to an address.
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
        // A loop that jumps back to the function's first instruction is not a new call.
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
