//! Cost of interrupt entry and exit, which are not instructions.

use ::cycles::timing::{self, Column, Timing};

use super::figures::Row;
use super::statistics::{Inputs, Statistics};
use super::worst::Most;

/// Exception frame: 8 words, 18 for floats, up to one for alignment.
const EXCEPTION_FRAME_BYTES: u32 = 4 * (8 + 18 + 1);

/// Costs of entry, exit and float registers, from the table.
///
/// Maximum flash reads with wait states: the current read, then the handler's address and first line, or the line to return to.
pub(super) fn interrupt(timing: &Timing, budget_cycles: u64) -> Vec<Row> {
    let rows = [
        ("interrupt entry", timing::Row::ExceptionEntry, 3, EXCEPTION_FRAME_BYTES),
        ("interrupt exit", timing::Row::ExceptionExit, 2, 0),
        ("float registers at entry", timing::Row::LazyStacking, 0, 0),
    ];
    let row = |(name, row, reads, stack_bytes): (&str, timing::Row, u32, u32)| {
        let [typical, upper] = [Column::Likely, Column::Upper].map(|column| u64::from(row.cost().of(column)));
        let upper = upper + u64::from(timing.max_wait_cycles(reads));
        let mut statistics = Statistics::default();
        statistics.add(Inputs::Scenario, typical, stack_bytes);
        Row::new(name.to_owned(), &statistics, Some(Most { cycles: upper, stack_bytes }), budget_cycles)
    };
    rows.map(row).into()
}
