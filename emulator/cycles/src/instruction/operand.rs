//! Operands from their encodings.

use super::bits::Bits;
use super::{Condition, Operand, Operation, PC, Register, Shift};

impl Condition {
    /// A four-bit condition; 15 is invalid.
    pub(super) fn from_bits(bits: u8) -> Option<Self> {
        Some(match bits {
            0 => Self::Equal,
            1 => Self::NotEqual,
            2 => Self::CarrySet,
            3 => Self::CarryClear,
            4 => Self::Minus,
            5 => Self::Plus,
            6 => Self::Overflow,
            7 => Self::NoOverflow,
            8 => Self::Higher,
            9 => Self::LowerOrSame,
            10 => Self::GreaterOrEqual,
            11 => Self::Less,
            12 => Self::Greater,
            13 => Self::LessOrEqual,
            14 => Self::Always,
            _ => return None,
        })
    }
}

impl Operand {
    /// A number that does not change the carry.
    pub(super) fn number(value: u32) -> Self {
        Self::Immediate { value, carry: None }
    }

    /// An unshifted register.
    pub(super) fn register(register: Register) -> Self {
        Self::Register { register, shift: Shift::Left, amount: 0 }
    }

    /// A register shifted by a constant: `DecodeImmShift` (A7.4.2).
    pub(super) fn shifted(register: Register, kind: u8, amount: u8) -> Self {
        let (shift, amount) = match (kind, amount) {
            (0, amount) => (Shift::Left, amount),
            (1, 0) => (Shift::LogicalRight, 32),
            (1, amount) => (Shift::LogicalRight, amount),
            (2, 0) => (Shift::ArithmeticRight, 32),
            (2, amount) => (Shift::ArithmeticRight, amount),
            (_, 0) => (Shift::RotateExtended, 1),
            (_, amount) => (Shift::RotateRight, amount),
        };
        Self::Register { register, shift, amount }
    }

    /// `ThumbExpandImm_C` of `i:imm3:imm8` (A5.3.2).
    pub(super) fn expanded(code: Bits) -> Option<Self> {
        let byte = code.number(0, 8);
        let top = code.number(26, 1) << 3 | code.number(12, 3);
        let value = match top {
            0 => byte,
            1..=3 if byte == 0 => return None,
            1 => byte << 16 | byte,
            2 => byte << 24 | byte << 8,
            3 => byte << 24 | byte << 16 | byte << 8 | byte,
            _ => {
                let value = (byte | 0x80).rotate_right(top << 1 | byte >> 7);
                return Some(Self::Immediate { value, carry: Some(value >> 31 == 1) });
            }
        };
        Some(Self::number(value))
    }
}

impl Operation {
    /// Whether the floating-point unit executes it.
    #[must_use]
    pub fn is_float(&self) -> bool {
        matches!(
            self,
            Self::Float { .. }
                | Self::FloatUnary { .. }
                | Self::FloatImmediate { .. }
                | Self::FloatCompare { .. }
                | Self::FloatConvert { .. }
                | Self::FloatLoad { .. }
                | Self::FloatStore { .. }
                | Self::FloatLoadMultiple { .. }
                | Self::FloatStoreMultiple { .. }
                | Self::FloatFromCore { .. }
                | Self::FloatToCore { .. }
                | Self::FloatPairFromCore { .. }
                | Self::FloatPairToCore { .. }
                | Self::FloatStatusRead { .. }
                | Self::FloatStatusWrite { .. }
        )
    }

    /// Whether the program may continue elsewhere than at the next instruction. Ignores the condition; traps
    /// do not count.
    #[must_use]
    pub fn jumps(&self) -> bool {
        match *self {
            Self::Branch { .. }
            | Self::BranchLink { .. }
            | Self::BranchRegister { .. }
            | Self::BranchLinkRegister { .. }
            | Self::CompareBranch { .. }
            | Self::TableBranch { .. } => true,
            Self::Move { d, .. } => d == PC,
            Self::Arithmetic { d, .. } => d == Some(PC),
            Self::Load { t, .. } => t == PC,
            Self::LoadMultiple { registers, .. } => registers >> PC & 1 == 1,
            _ => false,
        }
    }
}
