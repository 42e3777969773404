//! The memory from which instructions are fetched.

use ::cycles::timing::{Column, Flash, Profile, Timing};
use boards::BOARDS;
use boards::catalogue::CodeMemory;
use clap::ValueEnum;

/// Memory of the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Memory {
    /// Zero wait states.
    #[value(name = "0ws")]
    ZeroWait,
    /// Flash of an STM32G4 at full speed: 4 wait states, caches.
    ///
    /// A bound assumes that every access misses the caches. CCM SRAM has no wait states.
    Flash,
}

impl Memory {
    /// Returns the memory of a board's images; zero wait states for an unknown board.
    #[must_use]
    pub fn of_board(name: &str) -> Self {
        match BOARDS.iter().find(|board| board.name == name).map(|board| board.tooling.memory) {
            Some(CodeMemory::Stm32G4) => Self::Flash,
            Some(CodeMemory::ZeroWaitStates) | None => Self::ZeroWait,
        }
    }

    /// Returns its name in commands and reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::ZeroWait => "0ws",
            Self::Flash => "flash",
        }
    }

    /// Returns its profile in the model.
    #[must_use]
    pub fn profile(self) -> Profile {
        match self {
            Self::ZeroWait => Profile::ZeroWait,
            Self::Flash => Profile::Flash(Flash::STM32G4),
        }
    }

    /// Returns the timing for bounds.
    #[must_use]
    pub fn upper(self) -> Timing {
        Timing::new(self.profile(), Column::Upper)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_has_the_memory_that_its_chip_has() {
        for board in BOARDS {
            let waits = Memory::of_board(board.name) == Memory::Flash;
            assert_eq!(waits, board.tooling.chip.is_some(), "{}", board.name);
        }
        assert_eq!(Memory::of_board("unknown"), Memory::ZeroWait);
    }

    #[test]
    fn its_name_is_the_one_that_a_command_takes() {
        for memory in [Memory::ZeroWait, Memory::Flash] {
            assert_eq!(Memory::from_str(memory.name(), false), Ok(memory));
        }
    }
}
