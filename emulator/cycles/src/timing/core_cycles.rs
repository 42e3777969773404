//! Cycles of an instruction without waiting for flash: the rows that it pays.

use super::pipeline::Pipeline;
use super::price::Price;
use super::{Access, Column, Known, Outcome, Row, Timing};

impl Timing {
    /// Cycles without waiting for flash.
    #[inline]
    pub(super) fn core_cycles(
        &self,
        pipeline: &mut Pipeline,
        price: &Price,
        outcome: Outcome,
        known: Known,
    ) -> u32 {
        pipeline.float_busy = pipeline.float_busy.min(self.longest_busy);
        pipeline.float_results_after = pipeline.float_results_after.min(self.longest_result);

        // The floating-point unit is taken to stand still in stalls. If it did not, a path that stalls early, where its
        // result is waited for anyway, could overtake one that stalls later: joined pipelines would bound neither.
        let mut stalls = self.fetch_stall(pipeline, price.is_misaligned);
        if price.is_if_then {
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

    /// What the place of a four-byte instruction costs.
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

    /// An instruction's own cycles, behind a load that it may be pipelined behind.
    fn own_cycles(&self, pipeline: &Pipeline, price: &Price, known: Known) -> u32 {
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
