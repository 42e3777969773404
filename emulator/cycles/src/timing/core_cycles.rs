//! Cycles of an instruction without waiting for flash: the rows that it pays.

use super::pipeline::{Pipeline, PrecedingLoad};
use super::{Access, Column, Known, Outcome, Row, Timing, registers, rows};
use crate::instruction::{Instruction, Operation, PC};

impl Timing {
    /// Cycles without waiting for flash.
    pub(super) fn core_cycles(
        &self,
        pipeline: &mut Pipeline,
        instruction: &Instruction,
        outcome: Outcome,
        known: Known,
    ) -> u32 {
        let operation = &instruction.operation;
        pipeline.float_busy = pipeline.float_busy.min(self.longest_busy);
        let longest_result = u32::from(self.longest_busy) + self.row(Row::FloatResult);
        pipeline.float_results_after =
            pipeline.float_results_after.min(u8::try_from(longest_result).unwrap_or(u8::MAX));

        // The floating-point unit is taken to stand still in stalls. If it did not, a path that stalls early, where its
        // result is waited for anyway, could overtake one that stalls later: joined pipelines would bound neither.
        let mut stalls = self.fetch_stall(pipeline, instruction);
        if matches!(operation, Operation::IfThen { .. }) {
            // It may be folded away: what is before it is then right before the next instruction. If it takes its time, two
            // loads around it do not pipeline.
            let own = self.row(Row::IfThen);
            if own > 0 {
                pipeline.load = None;
            }
            pipeline.pass(own);
            return stalls + own;
        }
        if outcome == Outcome::Skipped {
            (pipeline.computed, pipeline.load) = (0, None);
            let own = self.row(Row::Skipped);
            pipeline.pass(own);
            return stalls + own;
        }
        if pipeline.computed & registers::of_address(operation) != 0 {
            stalls += self.row(Row::AddressDependent);
        }
        let mut own = float_wait(pipeline, operation) + self.own_cycles(pipeline, instruction, known);
        if outcome == Outcome::Taken {
            let is_load = rows::loaded_bytes(operation).is_some();
            own += self.row(if is_load { Row::RefillBehindLoad } else { Row::Refill });
            pipeline.jumped = !is_load;
        }

        pipeline.computed = registers::computed(operation);
        pipeline.load = rows::pipelines(operation).then(|| PrecedingLoad {
            registers: registers::loaded(operation),
            is_float: matches!(operation, Operation::FloatLoad { .. }),
        });
        pipeline.pass(own);
        let result = registers::float_result(operation);
        if result != 0 {
            let (_, busy) = self.overlapped(rows::base(operation));
            pipeline.float_busy = busy;
            pipeline.float_results = result;
            let after = u32::from(busy) + self.row(Row::FloatResult);
            pipeline.float_results_after = u8::try_from(after).unwrap_or(u8::MAX);
        }
        stalls + own
    }

    /// What the place of a four-byte instruction costs.
    fn fetch_stall(&self, pipeline: &mut Pipeline, instruction: &Instruction) -> u32 {
        let is_misaligned = instruction.bytes == 4 && !instruction.address.is_multiple_of(4);
        let mut cycles = 0;
        if std::mem::take(&mut pipeline.jumped) && is_misaligned {
            cycles += self.row(Row::MisalignedTarget);
        }
        let (run, stalls) = pipeline.misaligned.next(is_misaligned, self.column);
        pipeline.misaligned = run;
        if stalls {
            cycles += self.row(Row::MisalignedRun);
        }
        cycles
    }

    /// An instruction's own cycles, behind a load that it may be pipelined behind.
    fn own_cycles(&self, pipeline: &Pipeline, instruction: &Instruction, known: Known) -> u32 {
        let operation = &instruction.operation;
        let base = rows::base(operation);
        let (mut cycles, _) = self.overlapped(base);
        if let Some((each, count)) = rows::each(operation) {
            cycles += self.row(each) * count;
        }
        if let Operation::Divide { is_signed, .. } = *operation {
            cycles += self.quotient_cycles(known.division, is_signed);
        }
        if is_literal(operation) {
            cycles += self.row(Row::LoadLiteral);
        }
        if let Some((row, width)) = rows::unaligned(operation) {
            let access = known.access_of(instruction).unwrap_or(Access::UNKNOWN);
            cycles += self.row(row) * access.further(width);
        }
        if let Some(load) = pipeline.load
            && (base == Row::StoreRegister || rows::pipelines(operation))
            && load.registers & registers::of_address(operation) == 0
        {
            let is_float = load.is_float || base == Row::FloatLoad;
            cycles =
                cycles.saturating_sub(self.row(if is_float { Row::FloatPipelined } else { Row::Pipelined }));
        }
        cycles
    }

    /// What a quotient's length adds. Arm says only that leading zeros and ones shorten a division: in the upper
    /// column none do.
    fn quotient_cycles(&self, division: Option<(u32, u32)>, is_signed: bool) -> u32 {
        let most = self.row(Row::DivideQuotient);
        let Some((dividend, divisor)) = division.filter(|_| self.column == Column::Likely) else {
            return most;
        };
        let magnitude = |word: u32| if is_signed { word.cast_signed().unsigned_abs() } else { word };
        let (dividend, divisor) = (magnitude(dividend), magnitude(divisor));
        if divisor == 0 || dividend < divisor {
            return 0;
        }
        let bits = divisor.leading_zeros() - dividend.leading_zeros() + 1;
        (most * bits).div_ceil(u32::BITS)
    }

    /// Cycles that a row takes at once, and those that it leaves to the floating-point unit alone.
    pub(super) fn overlapped(&self, row: Row) -> (u32, u8) {
        let cycles = self.row(row);
        let overlaps = matches!(row, Row::FloatMultiplyAccumulate | Row::FloatDivide);
        let at_once = if overlaps && self.column == Column::Likely { cycles.min(1) } else { cycles };
        (at_once, u8::try_from(cycles - at_once).unwrap_or(u8::MAX))
    }
}

/// Cycles until the floating-point unit is free and has what the instruction reads; 0 for any other instruction.
fn float_wait(pipeline: &Pipeline, operation: &Operation) -> u32 {
    let Some(sources) = registers::float_sources(operation) else { return 0 };
    let mut wait = pipeline.float_busy;
    if pipeline.float_results & sources.read != 0 {
        wait = wait.max(pipeline.float_results_after);
    } else if pipeline.float_results & sources.addend != 0 {
        wait = wait.max(pipeline.float_results_after.saturating_sub(1));
    }
    wait.into()
}

fn is_literal(operation: &Operation) -> bool {
    let is_single = matches!(rows::base(operation), Row::Load | Row::FloatLoad);
    is_single && rows::immediate_offset(operation).is_some_and(|(base, _)| base == PC)
}
