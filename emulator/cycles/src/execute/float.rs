//! Float instructions: the function and its registers.

use super::Execution;
use super::float_arithmetic::{arithmetic, compared, square_root};
use super::float_convert::convert;
use crate::domain::Domain;
use crate::instruction::{FloatArithmetic, FloatConvert, FloatRegister, FloatUnary};

const SIGN: u32 = 0x8000_0000;

impl<D: Domain, M> Execution<'_, D, M> {
    pub(super) fn float(
        &mut self,
        operator: FloatArithmetic,
        d: FloatRegister,
        n: FloatRegister,
        m: FloatRegister,
    ) {
        let words = [n, m, d].map(|register| self.registers.read_float(register));
        let result = self.domain.apply(words, arithmetic(operator));
        self.registers.write_float(d, result);
    }

    pub(super) fn float_unary(&mut self, operator: FloatUnary, d: FloatRegister, m: FloatRegister) {
        let word = self.registers.read_float(m);
        let result = match operator {
            FloatUnary::Vmov => word,
            FloatUnary::Vabs => self.mask(word, !SIGN),
            FloatUnary::Vneg => {
                let sign = self.domain.constant(SIGN);
                self.domain.exclusive_or(word, sign)
            }
            FloatUnary::Vsqrt => {
                let zero = self.domain.constant(0);
                self.domain.apply([word, zero, zero], square_root)
            }
        };
        self.registers.write_float(d, result);
    }

    pub(super) fn float_compare(&mut self, d: FloatRegister, m: Option<FloatRegister>) {
        let zero = self.domain.constant(0);
        let other = m.map_or(zero, |m| self.registers.read_float(m));
        let words = [self.registers.read_float(d), other, zero];
        let flags = self.domain.apply(words, compared);
        self.registers.float_flags = self.domain.flags_from(flags);
    }

    pub(super) fn float_convert(&mut self, kind: FloatConvert, d: FloatRegister, m: FloatRegister) {
        let (function, fraction_bits) = convert(kind);
        let words = [
            self.registers.read_float(m),
            self.domain.constant(u32::from(fraction_bits)),
            self.domain.constant(0),
        ];
        let result = self.domain.apply(words, function);
        self.registers.write_float(d, result);
    }
}
