//! What a scheme may take on a board: the boards' budgets.

use serde::Deserialize;

/// A line per file of `boards/budgets`.
const BUDGETS: &[(&str, &str)] = &[
    ("mps2-an386", include_str!("../../boards/budgets/mps2-an386.toml")),
    ("nucleo-g474re", include_str!("../../boards/budgets/nucleo-g474re.toml")),
    ("b-g431b-esc1", include_str!("../../boards/budgets/b-g431b-esc1.toml")),
];

/// What a board's processor and a tick have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub struct Budget {
    /// Of the processor.
    pub clock_hz: u32,
    /// Ticks per second.
    pub tick_hz: u32,
    /// What a tick of a scheme may take; firmware refuses a module that could make it longer.
    pub tick_cycles: u32,
}

/// Why there is no budget.
#[derive(Debug, thiserror::Error)]
pub enum BudgetError {
    /// No board of this name.
    #[error("'{name}' is not a board; the boards are {}", names().join(", "))]
    Unknown {
        /// What was asked for.
        name: String,
    },
    /// Its file is wrong.
    #[error("boards/budgets/{name}.toml: {source}")]
    Wrong {
        /// The board.
        name: &'static str,
        /// What is wrong with it.
        source: toml::de::Error,
    },
}

impl Budget {
    /// Of a board.
    ///
    /// # Errors
    /// [`BudgetError`] when there is no such board.
    pub fn of(board: &str) -> Result<Self, BudgetError> {
        let found = BUDGETS.iter().find(|(name, _)| *name == board);
        let (name, text) = found.ok_or_else(|| BudgetError::Unknown { name: board.to_owned() })?;
        toml::from_str(text).map_err(|source| BudgetError::Wrong { name, source })
    }

    /// From one tick to the next, cycles.
    #[must_use]
    pub fn period_cycles(&self) -> u32 {
        self.clock_hz / self.tick_hz.max(1)
    }
}

/// Every board that has a budget.
#[must_use]
pub fn names() -> Vec<&'static str> {
    BUDGETS.iter().map(|(name, _)| *name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_is_a_board_whose_ticks_fit_into_their_time() {
        let files = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../boards/budgets")).unwrap();
        let files = files.map(|file| file.unwrap().path().file_stem().unwrap().to_str().unwrap().to_owned());
        let mut files: Vec<String> = files.collect();
        let mut names = names();
        files.sort_unstable();
        names.sort_unstable();
        assert_eq!(files, names);
        for name in names {
            let budget = Budget::of(name).unwrap();
            assert!(budget.tick_cycles > 0 && budget.tick_cycles <= budget.period_cycles(), "{name}");
        }
    }

    #[test]
    fn a_board_that_does_not_exist_is_told_with_those_that_do() {
        let message = Budget::of("nucleo").unwrap_err().to_string();
        assert!(
            message.contains("'nucleo' is not a board") && message.contains("nucleo-g474re"),
            "{message}"
        );
    }
}
