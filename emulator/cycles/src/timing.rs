//! Cycles of an instruction on the Cortex-M4F, from Arm's tables.
//!
//! [`Row`] contains the figures with their sources; this module and its submodules select the rows that apply
//! to an instruction. The order of instructions matters, too: a [`Pipeline`] holds the effects of the
//! preceding instructions.

mod core_cycles;
mod flash;
mod known;
mod least_recent;
mod pipeline;
mod price;
pub(crate) mod registers;
mod rows;
mod table;

pub use flash::{Caches, Flash};
pub use known::{Access, KnownOperands};
pub use pipeline::Pipeline;
pub(crate) use price::Price;
pub use table::{Cost, Row};

use crate::instruction::Instruction;

/// Selects the value where Arm specifies a range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Column {
    /// The most common value.
    Likely,
    /// The maximum.
    Upper,
}

/// The memory that contains the code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Profile {
    /// No access waits.
    ZeroWait,
    /// Code and constants in flash.
    Flash(Flash),
}

/// Outcome of an instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Its condition did not hold.
    Skipped,
    /// It executed; the next instruction follows.
    Done,
    /// It jumped.
    Taken,
}

/// The timing model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timing {
    profile: Profile,
    column: Column,
    cycles: [u8; Row::COUNT],
    /// Cycles that the floating-point unit stays busy after the longest instruction that others overlap.
    longest_busy: u8,
    /// Cycles until the latest result of the floating-point unit is available.
    longest_result: u8,
}

impl Timing {
    /// Creates the model for a memory and a column.
    #[must_use]
    pub fn new(profile: Profile, column: Column) -> Self {
        let mut cycles = [0; Row::COUNT];
        for (cycles, row) in cycles.iter_mut().zip(Row::ALL) {
            *cycles = row.cost().of(column);
        }
        Self { profile, column, cycles, longest_busy: 0, longest_result: 0 }.with_longest_busy()
    }

    /// The model with another figure in a row, such as one measured on a chip.
    #[must_use]
    pub fn with_row(mut self, row: Row, cycles: u8) -> Self {
        if let Some(place) = self.cycles.get_mut(row as usize) {
            *place = cycles;
        }
        self.with_longest_busy()
    }

    fn with_longest_busy(mut self) -> Self {
        let overlapped = [Row::FloatMultiplyAccumulate, Row::FloatDivide].map(|row| self.overlapped(row).1);
        self.longest_busy = overlapped.into_iter().max().unwrap_or(0);
        let longest_result = u32::from(self.longest_busy) + self.row(Row::FloatResult);
        self.longest_result = u8::try_from(longest_result).unwrap_or(u8::MAX);
        self
    }

    /// Cycles of a row in the column of this model.
    #[must_use]
    pub fn row(&self, row: Row) -> u32 {
        self.cycles.get(row as usize).map_or(0, |cycles| u32::from(*cycles))
    }

    /// Maximum wait cycles of this number of flash reads, for any cache state.
    #[must_use]
    pub fn max_wait_cycles(&self, reads: u32) -> u32 {
        match &self.profile {
            Profile::ZeroWait => 0,
            Profile::Flash(flash) => reads.saturating_mul(flash.longest_read()),
        }
    }

    /// Cycles of an instruction after `pipeline`, which is updated, for any cache state: every new line,
    /// every jump (after a read in progress) and every load that can be from flash has the full wait states.
    pub fn cycles(
        &self,
        pipeline: &mut Pipeline,
        instruction: &Instruction,
        outcome: Outcome,
        known: KnownOperands,
    ) -> u32 {
        let (price, known) = (self.price(instruction), known.with_access_of(instruction));
        let core = self.core_cycles(pipeline, &price, outcome, known);
        match &self.profile {
            Profile::ZeroWait => core,
            Profile::Flash(flash) => {
                core + flash.max_wait_cycles(&mut pipeline.line, instruction, &price, outcome, known)
            }
        }
    }

    /// Like [`cycles`](Self::cycles), for a run with these caches: never more.
    pub fn cached_cycles(
        &self,
        pipeline: &mut Pipeline,
        caches: &mut Caches,
        instruction: &Instruction,
        outcome: Outcome,
        known: KnownOperands,
    ) -> u32 {
        let known = known.with_access_of(instruction);
        self.cached_cycles_of(pipeline, caches, &self.price(instruction), outcome, known)
    }

    /// The same, for an instruction with a precomputed price and the address of its memory access.
    #[inline]
    pub(crate) fn cached_cycles_of(
        &self,
        pipeline: &mut Pipeline,
        caches: &mut Caches,
        price: &Price,
        outcome: Outcome,
        known: KnownOperands,
    ) -> u32 {
        let core = self.core_cycles(pipeline, price, outcome, known);
        match &self.profile {
            Profile::ZeroWait => core,
            Profile::Flash(flash) => core + caches.waits(flash, price, outcome, known, core),
        }
    }
}
