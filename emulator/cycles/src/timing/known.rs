//! What is known of the values that an instruction worked on.

use super::rows;
use crate::instruction::{Instruction, PC, SP, Width};

/// What is known of the values that an instruction worked on; [`Known::default`] is nothing, which costs the most.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Known {
    /// Dividend and divisor of a division.
    pub division: Option<(u32, u32)>,
    /// The (first) access to memory of a load or store. Of one relative to SP or PC enough is known without.
    pub access: Option<Access>,
}

/// Where an access to memory begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Access {
    /// The smallest address it can be.
    pub lowest: u32,
    /// The greatest address it can be.
    pub highest: u32,
    /// 1, 2 or 4: it divides every address it can be.
    pub alignment: u8,
}

impl Access {
    pub(super) const UNKNOWN: Self = Self { lowest: 0, highest: u32::MAX, alignment: 1 };

    /// A known address.
    #[must_use]
    pub fn at(address: u32) -> Self {
        let alignment = if address.is_multiple_of(4) { 4 } else { 2 - (address % 2) as u8 };
        Self { lowest: address, highest: address, alignment }
    }
}

impl Known {
    /// With what is known of the access to memory without: SP is always divisible by 4 and in RAM, PC is known.
    pub(super) fn with_access_of(self, instruction: &Instruction) -> Self {
        let access = self.access.or_else(|| {
            let (base, offset) = rows::immediate_offset(&instruction.operation)?;
            match base {
                PC => {
                    Some(Access::at((instruction.address.wrapping_add(4) & !3).wrapping_add_signed(offset)))
                }
                SP => {
                    let alignment = Access::at(offset.cast_unsigned()).alignment;
                    Some(Access { lowest: RAM, highest: u32::MAX, alignment })
                }
                _ => None,
            }
        });
        Self { access, ..self }
    }
}

/// Where RAM begins in the Armv7-M memory map; below it is code.
pub(super) const RAM: u32 = 0x2000_0000;

impl Access {
    /// Accesses that one of `width` is split into because it is unaligned, less one.
    pub(super) fn further(self, width: Width) -> u32 {
        match (width, self.alignment) {
            (Width::Word, 1) => 2,
            (Width::Word, 2) | (Width::Half, 1) => 1,
            _ => 0,
        }
    }
}
