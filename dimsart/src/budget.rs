//! Time budgets of boards: the limit of a tick.

use boards::BOARDS;
use serde::Deserialize;

/// Clock, tick rate and limit of a tick on a board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    /// Clock of the processor, Hz.
    pub clock_hz: u32,
    /// Ticks per second.
    pub tick_hz: u32,
    /// Limit of a tick, per cent of its period; the stamp of an image can override it.
    pub tick_percent: u32,
}

/// The keys used here of a file of `boards/budgets`.
#[derive(Deserialize)]
struct BudgetFile {
    tick_percent: u32,
}

/// Error of [`Budget::of`].
#[derive(Debug, thiserror::Error)]
pub enum BudgetError {
    /// Unknown board.
    #[error("unknown board '{name}'; known boards: {}", names())]
    UnknownBoard {
        /// The name.
        name: String,
    },
    /// The budget file of the board is invalid.
    #[error("invalid budget file boards/budgets/{name}.toml: {source}")]
    Invalid {
        /// The board.
        name: &'static str,
        /// The error.
        source: toml::de::Error,
    },
}

impl Budget {
    /// Returns the budget of a board.
    ///
    /// # Errors
    /// [`BudgetError`] if the board is unknown or its file is invalid.
    pub fn of(board: &str) -> Result<Self, BudgetError> {
        let found = BOARDS.iter().find(|known| known.name == board);
        let board = found.ok_or_else(|| BudgetError::UnknownBoard { name: board.to_owned() })?;
        let BudgetFile { tick_percent } = toml::from_str(board.budget)
            .map_err(|source| BudgetError::Invalid { name: board.name, source })?;
        let boards::catalogue::ToolData { clock_hz, tick_hz, .. } = board.tooling;
        Ok(Self { clock_hz, tick_hz, tick_percent })
    }

    /// Returns the limit of a tick, cycles.
    #[must_use]
    pub fn tick_cycles(&self) -> u32 {
        share(self.period_cycles(), self.tick_percent)
    }

    /// Returns the period of a tick, cycles.
    #[must_use]
    pub fn period_cycles(&self) -> u32 {
        self.clock_hz / self.tick_hz.max(1)
    }
}

/// Returns `percent` per cent of `cycles`.
#[must_use]
pub fn share(cycles: u32, percent: u32) -> u32 {
    u32::try_from(u64::from(cycles) * u64::from(percent) / 100).unwrap_or(u32::MAX)
}

/// The names of all boards.
pub(crate) fn names() -> String {
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
        assert!(message.contains("unknown board 'nucleo'") && message.contains("nucleo-g474re"), "{message}");
    }
}
