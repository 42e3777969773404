//! Cycles of an instruction without flash wait states: the rows that apply to it.

use super::pipeline::Pipeline;
use super::price::Price;
use super::{Access, Column, KnownOperands, Outcome, Row, Timing};

impl Timing {
    /// Cycles without flash wait states.
    #[inline]
    pub(super) fn core_cycles(
        &self,
        pipeline: &mut Pipeline,
        price: &Price,
        outcome: Outcome,
        known: KnownOperands,
    ) -> u32 {
        pipeline.float_busy = pipeline.float_busy.min(self.longest_busy);
        pipeline.float_results_after = pipeline.float_results_after.min(self.longest_result);

        // The model assumes that the floating-point unit pauses during stalls. Otherwise, a path that stalls
        // early, while it waits for a float result anyway, could overtake a path with a later stall, and
        // joined pipelines would bound neither.
        let mut stalls = self.fetch_stall(pipeline, price.is_misaligned);
        if price.is_if_then {
            // `IT` may be folded: the preceding instruction then directly precedes the next one. If it takes
            // cycles, the loads around it do not pipeline.
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
        if pipeline.computed & price.address != 0 {
            stalls += self.row(Row::AddressDependent);
        }
        let mut own = float_wait(pipeline, price) + self.own_cycles(pipeline, price, known);
        if outcome == Outcome::Taken {
            own += u32::from(price.refill);
            pipeline.jumped = !price.is_load();
        }

        pipeline.computed = price.computed;
        pipeline.load = price.load;
        pipeline.pass(own);
        let (result, busy, after) = price.float_result;
        if result != 0 {
            pipeline.float_busy = busy;
            pipeline.float_results = result;
            pipeline.float_results_after = after;
        }
        stalls + own
    }

    /// Cycles from the alignment of a four-byte instruction.
    fn fetch_stall(&self, pipeline: &mut Pipeline, is_misaligned: bool) -> u32 {
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

    /// An instruction's own cycles, after a load that it may pipeline with.
    fn own_cycles(&self, pipeline: &Pipeline, price: &Price, known: KnownOperands) -> u32 {
        let mut cycles = u32::from(price.own);
        if let Some(is_signed) = price.division {
            cycles += self.quotient_cycles(known.division, is_signed);
        }
        if let Some((each, width)) = price.unaligned {
            cycles += u32::from(each) * known.access.unwrap_or(Access::UNKNOWN).further(width);
        }
        if let Some(load) = pipeline.load
            && load.registers & price.address == 0
        {
            let [saved, saved_by_float] = price.pipelined;
            cycles = cycles.saturating_sub((if load.is_float { saved_by_float } else { saved }).into());
        }
        cycles
    }

    /// Cycles from the length of the quotient. Arm specifies only that leading zeros and ones shorten a
    /// division; the upper column assumes that they do not.
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

    /// Cycles of a row that block all instructions, and the remaining cycles that block only the
    /// floating-point unit.
    pub(super) fn overlapped(&self, row: Row) -> (u32, u8) {
        let cycles = self.row(row);
        let overlaps = matches!(row, Row::FloatMultiplyAccumulate | Row::FloatDivide);
        let at_once = if overlaps && self.column == Column::Likely { cycles.min(1) } else { cycles };
        (at_once, u8::try_from(cycles - at_once).unwrap_or(u8::MAX))
    }
}

/// Cycles until the floating-point unit is free and the instruction's operands are available; 0 for other
/// instructions.
fn float_wait(pipeline: &Pipeline, price: &Price) -> u32 {
    let Some(sources) = price.float else { return 0 };
    let mut wait = pipeline.float_busy;
    if pipeline.float_results & sources.read != 0 {
        wait = wait.max(pipeline.float_results_after);
    } else if pipeline.float_results & sources.addend != 0 {
        wait = wait.max(pipeline.float_results_after.saturating_sub(1));
    }
    wait.into()
}
