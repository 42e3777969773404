//! Access of instructions to registers and second operands.

use super::Execution;
use crate::domain::Domain;
use crate::instruction::{Operand, PC, Register, SP, Shift};

impl<D: Domain, M> Execution<'_, D, M> {
    /// A core register; R15 is the instruction's address + 4.
    #[inline]
    pub(super) fn read(&mut self, register: Register) -> D::Word {
        if register == PC {
            let address = self.instruction.address.wrapping_add(4);
            return self.domain.constant(address);
        }
        self.registers.read(register)
    }

    /// Like [`read`](Self::read), with R15 aligned down to 4: the base of `ADR` and literal loads.
    #[inline]
    pub(super) fn read_base(&mut self, register: Register) -> D::Word {
        if register == PC {
            let address = self.instruction.address.wrapping_add(4) & !3;
            return self.domain.constant(address);
        }
        self.registers.read(register)
    }

    /// Sets a core register; the lowest two bits of R13 are always zero.
    #[inline]
    pub(super) fn write(&mut self, register: Register, value: D::Word) {
        let value = if register == SP { self.mask(value, !3) } else { value };
        self.registers.write(register, value);
    }

    /// The bits of a word selected by a mask.
    #[inline]
    pub(super) fn mask(&mut self, word: D::Word, mask: u32) -> D::Word {
        let mask = self.domain.constant(mask);
        self.domain.and(word, mask)
    }

    /// A sum without flags.
    #[inline]
    pub(super) fn sum(&mut self, a: D::Word, b: D::Word) -> D::Word {
        let carry = self.domain.bit(false);
        self.domain.add(a, b, carry).0
    }

    /// A difference without flags.
    #[inline]
    pub(super) fn difference(&mut self, a: D::Word, b: D::Word) -> D::Word {
        let carry = self.domain.bit(true);
        self.domain.subtract(a, b, carry).0
    }

    /// A word plus a signed number of bytes.
    #[inline]
    pub(super) fn displaced(&mut self, word: D::Word, bytes: i32) -> D::Word {
        let distance = self.domain.constant(bytes.unsigned_abs());
        match bytes {
            0 => word,
            1.. => self.sum(word, distance),
            _ => self.difference(word, distance),
        }
    }

    /// A word shifted by a number of bits, without the carry out.
    #[inline]
    pub(super) fn shifted(&mut self, word: D::Word, shift: Shift, amount: u8) -> D::Word {
        if amount == 0 && shift != Shift::RotateExtended {
            return word;
        }
        let amount = self.domain.constant(u32::from(amount));
        let carry = self.domain.carry(self.registers.flags);
        self.domain.shift(shift, word, amount, carry).0
    }

    /// A second operand and its carry out.
    #[inline]
    pub(super) fn operand(&mut self, operand: Operand) -> (D::Word, D::Bit) {
        let carry = self.domain.carry(self.registers.flags);
        match operand {
            Operand::Immediate { value, carry: out } => {
                let out = out.map_or(carry, |out| self.domain.bit(out));
                (self.domain.constant(value), out)
            }
            Operand::Register { register, shift: Shift::Left, amount: 0 } => (self.read(register), carry),
            Operand::Register { register, shift, amount } => {
                let word = self.read(register);
                let amount = self.domain.constant(u32::from(amount));
                self.domain.shift(shift, word, amount, carry)
            }
            Operand::ShiftedBy { register, shift, amount } => {
                let (word, amount) = (self.read(register), self.read(amount));
                self.domain.shift(shift, word, amount, carry)
            }
        }
    }
}
