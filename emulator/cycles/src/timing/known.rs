//! Known values of an instruction's operands.

use super::rows;
use crate::instruction::{Instruction, PC, SP, Width};

/// Known values of an instruction's operands. In [`KnownOperands::default`], all are unknown, which costs the most.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct KnownOperands {
    /// Dividend and divisor of a division.
    pub division: Option<(u32, u32)>,
    /// The (first) memory access of a load or store. Optional for accesses relative to SP or PC.
    pub access: Option<Access>,
}

/// Start of a memory access.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Access {
    /// Minimum address.
    pub min_address: u32,
    /// Maximum address.
    pub max_address: u32,
    /// 1, 2 or 4: divides all possible addresses.
    pub alignment: u8,
}

impl Access {
    pub(super) const UNKNOWN: Self = Self { min_address: 0, max_address: u32::MAX, alignment: 1 };

    /// A known address.
    #[must_use]
    pub fn at_address(address: u32) -> Self {
        let alignment = if address.is_multiple_of(4) { 4 } else { 2 - (address % 2) as u8 };
        Self { min_address: address, max_address: address, alignment }
    }
}

impl KnownOperands {
    /// Adds the access if it is relative to SP or PC: SP is divisible by 4 and in RAM, PC is known.
    pub(super) fn with_access_of(self, instruction: &Instruction) -> Self {
        let access = self.access.or_else(|| {
            let (base, offset) = rows::immediate_offset(&instruction.operation)?;
            match base {
                PC => Some(Access::at_address(
                    (instruction.address.wrapping_add(4) & !3).wrapping_add_signed(offset),
                )),
                SP => {
                    let alignment = Access::at_address(offset.cast_unsigned()).alignment;
                    Some(Access { min_address: RAM, max_address: u32::MAX, alignment })
                }
                _ => None,
            }
        });
        Self { access, ..self }
    }
}

/// Start of RAM in the Armv7-M memory map; below is code.
pub(super) const RAM: u32 = 0x2000_0000;

impl Access {
    /// Number of additional accesses when an access of `width` is split because it is unaligned.
    pub(super) fn further(self, width: Width) -> u32 {
        match (width, self.alignment) {
            (Width::Word, 1) => 2,
            (Width::Word, 2) | (Width::Half, 1) => 1,
            _ => 0,
        }
    }
}
