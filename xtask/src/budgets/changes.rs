//! Differences between images and their boards' budget files.

use std::collections::BTreeMap;
use std::fmt;

use boards::catalogue::BoardInfo;

use crate::budget_file::{self, Part, Parts};

/// Differences up to this percentage of cycles or stack are ignored.
const TOLERANCE_PERCENT: u64 = 5;

/// Messages about differences.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Changes {
    /// Increases, new parts and missing parts.
    pub(super) wrong: Vec<String>,
    /// Decreases.
    pub(super) gained: Vec<String>,
}

impl Changes {
    /// Compares a side's results with the board's file.
    pub(super) fn add(
        &mut self,
        board: &BoardInfo,
        side: &str,
        known: &BTreeMap<String, Part>,
        found: &Parts,
    ) {
        let (board, file) = (board.name, budget_file::name(board));
        for (name, part) in found {
            let place = format!("{board} {side}: {name}");
            let Some(known) = known.get(name) else {
                let Part { cycles, stack_bytes } = part;
                self.wrong.push(format!(
                    "{place} takes up to {cycles} cycles and {stack_bytes} bytes of stack but has no entry in {file}"
                ));
                continue;
            };
            let quantities = [
                ("cycles", part.cycles, known.cycles),
                ("bytes of stack", part.stack_bytes, known.stack_bytes),
            ];
            for (unit, found, known) in quantities {
                if 100 * found.abs_diff(known) <= TOLERANCE_PERCENT * known {
                    continue;
                }
                let (lines, direction) =
                    if found > known { (&mut self.wrong, "more") } else { (&mut self.gained, "less") };
                let percent = 100.0 * found.abs_diff(known) as f64 / known.max(1) as f64;
                lines.push(format!(
                    "{place} takes up to {found} {unit}, {percent:.1} % {direction} than the {known} in {file}"
                ));
            }
        }
        let gone = known.keys().filter(|known| found.iter().all(|(name, _)| name != *known));
        let gone = gone
            .map(|name| format!("{board} {side}: {name} has an entry in {file} but is not in the scheme"));
        self.wrong.extend(gone);
    }
}

impl fmt::Display for Changes {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.wrong.iter().chain(&self.gained).try_for_each(|line| writeln!(formatter, "{line}"))
    }
}

#[cfg(test)]
mod tests {
    use boards::BOARDS;

    use super::*;

    const KNOWN: [(&str, u64, u64); 3] =
        [("tick", 3000, 240), ("PDCTRL_MOD", 1000, 40), ("COMM_TXMOD", 400, 0)];

    fn parts(parts: &[(&str, u64, u64)]) -> Parts {
        let part = |(name, cycles, stack_bytes): &(&str, u64, u64)| {
            ((*name).to_owned(), Part { cycles: *cycles, stack_bytes: *stack_bytes })
        };
        parts.iter().map(part).collect()
    }

    /// Compares with [`KNOWN`], after replacing parts of the same name.
    fn changes(others: &[(&str, u64, u64)]) -> Changes {
        let other = |known: (&'static str, u64, u64)| {
            others.iter().copied().find(|other| other.0 == known.0).unwrap_or(known)
        };
        of(&KNOWN.map(other))
    }

    fn of(found: &[(&str, u64, u64)]) -> Changes {
        let mut changes = Changes::default();
        let board = BOARDS.iter().find(|board| board.name == "nucleo-g474re").unwrap();
        changes.add(board, "slave", &parts(&KNOWN).into_iter().collect(), &parts(found));
        changes
    }

    fn wrong(line: &str) -> Changes {
        Changes { wrong: vec![line.to_owned()], ..Changes::default() }
    }

    #[test]
    fn up_to_5_per_cent_either_way_is_silent() {
        assert_eq!(of(&KNOWN), Changes::default());
        assert_eq!(changes(&[("PDCTRL_MOD", 1050, 42), ("tick", 2850, 228)]), Changes::default());
    }

    #[test]
    fn a_module_that_takes_more_is_named_with_both_numbers() {
        let line = "nucleo-g474re slave: PDCTRL_MOD takes up to 1051 cycles, 5.1 % more than the 1000 in \
                    boards/budgets/nucleo-g474re.toml";
        assert_eq!(changes(&[("PDCTRL_MOD", 1051, 40)]), wrong(line));
        let line = "nucleo-g474re slave: tick takes up to 256 bytes of stack, 6.7 % more than the 240 in \
                    boards/budgets/nucleo-g474re.toml";
        assert_eq!(changes(&[("tick", 3000, 256)]), wrong(line));
        let first_bytes = changes(&[("COMM_TXMOD", 400, 8)]).wrong;
        assert!(first_bytes[0].contains("COMM_TXMOD takes up to 8 bytes of stack"), "{first_bytes:?}");
    }

    #[test]
    fn each_that_takes_more_has_its_line() {
        let Changes { wrong, gained } = changes(&[("tick", 4000, 480), ("COMM_TXMOD", 1400, 0)]);
        assert_eq!((wrong.len(), gained.len()), (3, 0), "{wrong:?}");
    }

    #[test]
    fn what_takes_less_is_told_and_is_not_dearer() {
        let line = "nucleo-g474re slave: COMM_TXMOD takes up to 379 cycles, 5.2 % less than the 400 in \
                    boards/budgets/nucleo-g474re.toml";
        let gained = Changes { gained: vec![line.to_owned()], ..Changes::default() };
        assert_eq!(changes(&[("COMM_TXMOD", 379, 0)]), gained);
    }

    #[test]
    fn a_module_without_a_line_and_a_line_without_a_module_are_told() {
        let [tick, pd_control, _] = KNOWN;
        let Changes { wrong, gained } = of(&[tick, pd_control, ("PCTRL_MOD.2", 90, 24)]);
        assert_eq!(gained, Vec::<String>::new());
        assert_eq!(
            wrong,
            [
                "nucleo-g474re slave: PCTRL_MOD.2 takes up to 90 cycles and 24 bytes of stack but has no entry in \
                 boards/budgets/nucleo-g474re.toml",
                "nucleo-g474re slave: COMM_TXMOD has an entry in boards/budgets/nucleo-g474re.toml but is not in the \
                 scheme",
            ]
        );
    }
}
