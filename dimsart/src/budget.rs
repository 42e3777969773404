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
    /// What a tick of a scheme may take of the time to the next one, per cent, unless its image's stamp says otherwise.
    pub tick_percent: u32,
}

/// What is read here of a file of `boards/budgets`.
#[derive(Deserialize)]
struct BudgetFile {
    tick_percent: u32,
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
        let BudgetFile { tick_percent } =
            toml::from_str(board.budget).map_err(|source| BudgetError::Wrong { name: board.name, source })?;
        let boards::catalogue::Tooling { clock_hz, tick_hz, .. } = board.tooling;
        Ok(Self { clock_hz, tick_hz, tick_percent })
    }

    /// What a tick of a scheme may take, cycles.
    #[must_use]
    pub fn tick_cycles(&self) -> u32 {
        share(self.period_cycles(), self.tick_percent)
    }

    /// From one tick to the next, cycles.
    #[must_use]
    pub fn period_cycles(&self) -> u32 {
        self.clock_hz / self.tick_hz.max(1)
    }
}

/// So many per cent of some cycles.
#[must_use]
pub fn share(cycles: u32, percent: u32) -> u32 {
    u32::try_from(u64::from(cycles) * u64::from(percent) / 100).unwrap_or(u32::MAX)
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
            let cycles = budget.tick_cycles();
            assert!(cycles > 0 && cycles <= budget.period_cycles(), "{}", board.name);
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
