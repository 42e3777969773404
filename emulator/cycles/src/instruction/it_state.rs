//! The IT block of an instruction.

use super::Condition;

/// Conditions of the instructions that follow an `IT`: the manual's ITSTATE (B1.4.2, A7.3.2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ItState(u8);

impl ItState {
    /// No IT block.
    pub const NOT_IN_BLOCK: Self = Self(0);

    /// State after an `IT` with this low byte: the first condition and the mask.
    pub(super) fn behind(byte: u8) -> Self {
        Self(byte)
    }

    /// Number of instructions left in the block, 0 to 4.
    #[must_use]
    pub fn length(self) -> u8 {
        match self.0 & 0xF {
            0 => 0,
            mask => [4, 3, 2, 1].get(mask.trailing_zeros() as usize).copied().unwrap_or(0),
        }
    }

    /// Condition of the next instruction; `None` outside of a block.
    #[must_use]
    pub fn condition(self) -> Option<Condition> {
        if self.length() == 0 { None } else { Condition::from_bits(self.0 >> 4) }
    }

    /// State after the next instruction.
    #[must_use]
    pub fn advanced(self) -> Self {
        if self.length() <= 1 { Self(0) } else { Self((self.0 & 0xE0) | ((self.0 << 1) & 0x1F)) }
    }
}
