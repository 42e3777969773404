//! Moves, sums, comparisons and logic.

use super::{Execution, Flow};
use crate::domain::Domain;
use crate::instruction::{Arithmetic, Operand, PC, Register};

impl<D: Domain, M> Execution<'_, D, M> {
    pub(super) fn move_operand(
        &mut self,
        d: Register,
        operand: Operand,
        inverted: bool,
        sets_flags: bool,
    ) -> Flow<D> {
        let (word, carry) = self.operand(operand);
        let result = if inverted { self.domain.not(word) } else { word };
        if sets_flags {
            self.registers.flags = self.domain.flags_of(result, carry, self.registers.flags);
        }
        self.result(d, result)
    }

    pub(super) fn move_top(&mut self, d: Register, value: u16) {
        let below = self.read(d);
        let below = self.mask(below, 0xFFFF);
        let above = self.domain.constant(u32::from(value) << 16);
        let result = self.domain.or(above, below);
        self.write(d, result);
    }

    pub(super) fn arithmetic(
        &mut self,
        operator: Arithmetic,
        d: Option<Register>,
        n: Register,
        operand: Operand,
        sets_flags: bool,
    ) -> Flow<D> {
        let is_adr = matches!(operand, Operand::Immediate { .. });
        let a = if is_adr { self.read_base(n) } else { self.read(n) };
        let (b, shifted_out) = self.operand(operand);
        let flags = self.registers.flags;
        let domain = &mut *self.domain;
        let (result, flags) = match operator {
            Arithmetic::Add => {
                let carry = domain.bit(false);
                domain.add(a, b, carry)
            }
            Arithmetic::AddWithCarry => {
                let carry = domain.carry(flags);
                domain.add(a, b, carry)
            }
            Arithmetic::Subtract => {
                let carry = domain.bit(true);
                domain.subtract(a, b, carry)
            }
            Arithmetic::SubtractWithCarry => {
                let carry = domain.carry(flags);
                domain.subtract(a, b, carry)
            }
            Arithmetic::ReverseSubtract => {
                let carry = domain.bit(true);
                domain.subtract(b, a, carry)
            }
            Arithmetic::And
            | Arithmetic::BitClear
            | Arithmetic::Or
            | Arithmetic::OrNot
            | Arithmetic::ExclusiveOr => {
                let b = match operator {
                    Arithmetic::BitClear | Arithmetic::OrNot => domain.not(b),
                    _ => b,
                };
                let result = match operator {
                    Arithmetic::And | Arithmetic::BitClear => domain.and(a, b),
                    Arithmetic::ExclusiveOr => domain.exclusive_or(a, b),
                    _ => domain.or(a, b),
                };
                (result, domain.flags_of(result, shifted_out, flags))
            }
        };
        if sets_flags {
            self.registers.flags = flags;
        }
        match d {
            Some(d) => self.result(d, result),
            None => Flow::Next,
        }
    }

    /// Writes a result. A write to R15 jumps and ignores bit 0.
    #[inline]
    fn result(&mut self, d: Register, result: D::Word) -> Flow<D> {
        if d == PC {
            let one = self.domain.constant(1);
            return Flow::Indirect(self.domain.or(result, one));
        }
        self.write(d, result);
        Flow::Next
    }
}
