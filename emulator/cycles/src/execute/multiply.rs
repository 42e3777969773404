//! Products and quotients.

use super::Execution;
use super::bits::Q;
use crate::domain::Domain;
use crate::instruction::{Half, LongMultiply, Register};

impl<D: Domain, M> Execution<'_, D, M> {
    pub(super) fn multiply(
        &mut self,
        d: Register,
        (n, m): (Register, Register),
        a: Option<Register>,
        subtracts: bool,
        sets_flags: bool,
    ) {
        let (n, m) = (self.read(n), self.read(m));
        let product = self.domain.multiply(n, m);
        let result = match a.map(|a| self.read(a)) {
            None => product,
            Some(a) if subtracts => self.difference(a, product),
            Some(a) => self.sum(a, product),
        };
        if sets_flags {
            let carry = self.domain.carry(self.registers.flags);
            self.registers.flags = self.domain.flags_of(result, carry, self.registers.flags);
        }
        self.write(d, result);
    }

    pub(super) fn multiply_long(
        &mut self,
        kind: LongMultiply,
        (low, high): (Register, Register),
        (n, m): (Register, Register),
    ) {
        let (n, m) = (self.read(n), self.read(m));
        let before = (self.read(low), self.read(high));
        let zero = self.domain.constant(0);
        let is_signed = matches!(kind, LongMultiply::Smull | LongMultiply::Smlal);
        let upper = if is_signed { upper_signed } else { upper_unsigned };
        let product = (self.domain.multiply(n, m), self.domain.apply([n, m, zero], upper));
        let (lower, upper) = match kind {
            LongMultiply::Umull | LongMultiply::Smull => product,
            LongMultiply::Umlal | LongMultiply::Smlal => self.sum_long(product, before),
            LongMultiply::Umaal => {
                let sum = self.sum_long(product, (before.0, zero));
                self.sum_long(sum, (before.1, zero))
            }
        };
        self.write(low, lower);
        self.write(high, upper);
    }

    /// Sum of two pairs of words, low word first.
    fn sum_long(&mut self, a: (D::Word, D::Word), b: (D::Word, D::Word)) -> (D::Word, D::Word) {
        let none = self.domain.bit(false);
        let (lower, flags) = self.domain.add(a.0, b.0, none);
        let carry = self.domain.carry(flags);
        let (upper, _) = self.domain.add(a.1, b.1, carry);
        (lower, upper)
    }

    pub(super) fn multiply_halves(
        &mut self,
        d: Register,
        n: (Register, Half),
        m: (Register, Half),
        a: Option<Register>,
    ) {
        let (n, m) = (self.half(n), self.half(m));
        let product = self.domain.multiply(n, m);
        self.accumulate(d, product, a);
    }

    pub(super) fn multiply_wide(
        &mut self,
        d: Register,
        n: Register,
        m: (Register, Half),
        a: Option<Register>,
    ) {
        let (n, m, zero) = (self.read(n), self.half(m), self.domain.constant(0));
        let product = self.domain.apply([n, m, zero], |[n, m, _]| low((signed(n) * signed(m)) >> 16));
        self.accumulate(d, product, a);
    }

    /// A sign-extended half of a register.
    fn half(&mut self, (register, half): (Register, Half)) -> D::Word {
        let (word, zero) = (self.read(register), self.domain.constant(0));
        let function: fn([u32; 3]) -> u32 = match half {
            Half::Bottom => |[word, ..]| low(signed(word << 16) >> 16),
            Half::Top => |[word, ..]| low(signed(word) >> 16),
        };
        self.domain.apply([word, zero, zero], function)
    }

    /// The sum wraps; an overflow sets Q.
    fn accumulate(&mut self, d: Register, product: D::Word, a: Option<Register>) {
        let result = match a {
            None => product,
            Some(a) => {
                let (a, zero) = (self.read(a), self.domain.constant(0));
                self.set_q([product, a, zero], |[product, a, _]| {
                    if product.cast_signed().checked_add(a.cast_signed()).is_none() { Q } else { 0 }
                });
                self.sum(product, a)
            }
        };
        self.write(d, result);
    }

    pub(super) fn multiply_top(
        &mut self,
        d: Register,
        (n, m): (Register, Register),
        a: Option<Register>,
        subtracts: bool,
        rounds: bool,
    ) {
        let (n, m) = (self.read(n), self.read(m));
        let a = match a {
            Some(a) => self.read(a),
            None => self.domain.constant(0),
        };
        let function: fn([u32; 3]) -> u32 = match (subtracts, rounds) {
            (false, false) => |words| top(words, false, 0),
            (false, true) => |words| top(words, false, 0x8000_0000),
            (true, false) => |words| top(words, true, 0),
            (true, true) => |words| top(words, true, 0x8000_0000),
        };
        let result = self.domain.apply([n, m, a], function);
        self.write(d, result);
    }

    pub(super) fn divide(&mut self, d: Register, n: Register, m: Register, is_signed: bool) {
        let (n, m) = (self.read(n), self.read(m));
        let quotient = if is_signed {
            let zero = self.domain.constant(0);
            self.domain.apply([n, m, zero], |[n, m, _]| match m {
                0 => 0,
                _ => n.cast_signed().wrapping_div(m.cast_signed()).cast_unsigned(),
            })
        } else {
            self.domain.divide_unsigned(n, m)
        };
        self.write(d, quotient);
    }
}

fn signed(word: u32) -> i64 {
    i64::from(word.cast_signed())
}

#[expect(clippy::cast_possible_truncation, reason = "takes the lower word")]
fn low(value: i64) -> u32 {
    value.cast_unsigned() as u32
}

fn upper_signed([n, m, _]: [u32; 3]) -> u32 {
    low((signed(n) * signed(m)) >> 32)
}

fn upper_unsigned([n, m, _]: [u32; 3]) -> u32 {
    low((u64::from(n) * u64::from(m)).cast_signed() >> 32)
}

/// Upper word of `2^32 a ± n m + rounding`.
fn top([n, m, a]: [u32; 3], subtracts: bool, rounding: i64) -> u32 {
    let product = signed(n) * signed(m);
    let product = if subtracts { product.wrapping_neg() } else { product };
    low((signed(a) << 32).wrapping_add(product).wrapping_add(rounding) >> 32)
}
