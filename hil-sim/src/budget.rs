//! What a scheme may take on a board: the boards' budgets.

use boards::BOARDS;
use serde::Deserialize;

/// What a board's processor and a tick have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    /// Of the processor.
    pub clock_hz: u32,
    /// Ticks per second.
    pub tick_hz: u32,
    /// What a tick of a scheme may take; firmware refuses a module that could make it longer.
    pub tick_cycles: u32,
}

/// What is read here of a file of `boards/budgets`.
#[derive(Deserialize)]
struct BudgetFile {
    tick_cycles: u32,
}

/// Why there is no budget.
#[derive(Debug, thiserror::Error)]
pub enum BudgetError {
    /// No board of this name.
    #[error("'{name}' is not a board; the boards are {}", names())]
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
        let found = BOARDS.iter().find(|known| known.name == board);
        let board = found.ok_or_else(|| BudgetError::Unknown { name: board.to_owned() })?;
        let BudgetFile { tick_cycles } =
            toml::from_str(board.budget).map_err(|source| BudgetError::Wrong { name: board.name, source })?;
        Ok(Self { clock_hz: board.tooling.clock_hz, tick_hz: board.tooling.tick_hz, tick_cycles })
    }

    /// From one tick to the next, cycles.
    #[must_use]
    pub fn period_cycles(&self) -> u32 {
        self.clock_hz / self.tick_hz.max(1)
    }
}

fn names() -> String {
    BOARDS.iter().map(|board| board.name).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_board_s_ticks_fit_into_their_time() {
        for board in BOARDS {
            let budget = Budget::of(board.name).unwrap();
            assert!(budget.tick_cycles > 0 && budget.tick_cycles <= budget.period_cycles(), "{}", board.name);
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
