//! Known words, as a processor computes with them.

#[cfg(test)]
mod tests;

use crate::domain::Domain;
use crate::instruction::{Condition, Shift};

/// The domain of 32-bit numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Concrete;

/// N, Z, C and V.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Flags {
    /// N: the result is negative.
    pub negative: bool,
    /// Z: the result is zero.
    pub zero: bool,
    /// C: carry of an unsigned sum, no borrow of a difference, or the last bit shifted out.
    pub carry: bool,
    /// V: signed overflow of a sum or difference.
    pub overflow: bool,
}

impl Flags {
    /// Flags as bits 31 to 28 of a word.
    #[must_use]
    pub fn to_word(self) -> u32 {
        u32::from(self.negative) << 31
            | u32::from(self.zero) << 30
            | u32::from(self.carry) << 29
            | u32::from(self.overflow) << 28
    }

    /// Flags from bits 31 to 28 of a word.
    #[must_use]
    pub fn from_word(word: u32) -> Self {
        let bit = |number: u32| (word >> number) & 1 == 1;
        Self { negative: bit(31), zero: bit(30), carry: bit(29), overflow: bit(28) }
    }

    /// Whether a condition holds.
    #[must_use]
    pub fn satisfy(self, condition: Condition) -> bool {
        let Self { negative, zero, carry, overflow } = self;
        match condition {
            Condition::Equal => zero,
            Condition::NotEqual => !zero,
            Condition::CarrySet => carry,
            Condition::CarryClear => !carry,
            Condition::Minus => negative,
            Condition::Plus => !negative,
            Condition::Overflow => overflow,
            Condition::NoOverflow => !overflow,
            Condition::Higher => carry && !zero,
            Condition::LowerOrSame => !carry || zero,
            Condition::GreaterOrEqual => negative == overflow,
            Condition::Less => negative != overflow,
            Condition::Greater => !zero && negative == overflow,
            Condition::LessOrEqual => zero || negative != overflow,
            Condition::Always => true,
        }
    }
}

/// `a + b + carry` and its flags (DDI 0403E A2.2.1, `AddWithCarry`).
#[inline]
fn add_with_carry(a: u32, b: u32, carry: bool) -> (u32, Flags) {
    let (sum, carried) = a.overflowing_add(b);
    let (sum, carried_again) = sum.overflowing_add(u32::from(carry));
    // Both operands differ in sign from the sum.
    let overflow = (a ^ sum) & (b ^ sum) & 0x8000_0000 != 0;
    let negative = sum.cast_signed() < 0;
    (sum, Flags { negative, zero: sum == 0, carry: carried || carried_again, overflow })
}

impl Domain for Concrete {
    type Word = u32;
    type Bit = bool;
    type Flags = Flags;

    #[inline]
    fn constant(&mut self, value: u32) -> u32 {
        value
    }

    #[inline]
    fn known(&self, word: u32) -> Option<u32> {
        Some(word)
    }

    #[inline]
    fn bit(&mut self, value: bool) -> bool {
        value
    }

    #[inline]
    fn known_bit(&self, bit: bool) -> Option<bool> {
        Some(bit)
    }

    #[inline]
    fn add(&mut self, a: u32, b: u32, carry: bool) -> (u32, Flags) {
        add_with_carry(a, b, carry)
    }

    #[inline]
    fn subtract(&mut self, a: u32, b: u32, carry: bool) -> (u32, Flags) {
        add_with_carry(a, !b, carry)
    }

    #[inline]
    fn and(&mut self, a: u32, b: u32) -> u32 {
        a & b
    }

    #[inline]
    fn or(&mut self, a: u32, b: u32) -> u32 {
        a | b
    }

    #[inline]
    fn exclusive_or(&mut self, a: u32, b: u32) -> u32 {
        a ^ b
    }

    #[inline]
    fn not(&mut self, a: u32) -> u32 {
        !a
    }

    #[inline]
    fn shift(&mut self, shift: Shift, a: u32, amount: u32, carry: bool) -> (u32, bool) {
        let bit = |number: u32| (a >> (number & 31)) & 1 == 1;
        match (shift, amount & 0xFF) {
            (Shift::RotateExtended, _) => (u32::from(carry) << 31 | a >> 1, bit(0)),
            (_, 0) => (a, carry),
            (Shift::Left, amount @ 1..=32) => (a.checked_shl(amount).unwrap_or(0), bit(32 - amount)),
            (Shift::LogicalRight, amount @ 1..=32) => (a.checked_shr(amount).unwrap_or(0), bit(amount - 1)),
            (Shift::Left | Shift::LogicalRight, _) => (0, false),
            (Shift::ArithmeticRight, amount) => {
                ((a.cast_signed() >> amount.min(31)).cast_unsigned(), bit((amount - 1).min(31)))
            }
            (Shift::RotateRight, amount) => (a.rotate_right(amount & 31), bit(amount.wrapping_sub(1))),
        }
    }

    #[inline]
    fn multiply(&mut self, a: u32, b: u32) -> u32 {
        a.wrapping_mul(b)
    }

    #[inline]
    fn divide_unsigned(&mut self, a: u32, b: u32) -> u32 {
        a.checked_div(b).unwrap_or(0)
    }

    #[inline]
    fn apply(&mut self, words: [u32; 3], function: fn([u32; 3]) -> u32) -> u32 {
        function(words)
    }

    #[inline]
    fn apply_below(&mut self, words: [u32; 3], _greatest: u32, function: fn([u32; 3]) -> u32) -> u32 {
        function(words)
    }

    #[inline]
    fn test(&mut self, words: [u32; 3], function: fn([u32; 3]) -> bool) -> bool {
        function(words)
    }

    #[inline]
    fn select(&mut self, condition: bool, then: u32, otherwise: u32) -> u32 {
        if condition { then } else { otherwise }
    }

    #[inline]
    fn flags_of(&mut self, result: u32, carry: bool, before: Flags) -> Flags {
        Flags { negative: result.cast_signed() < 0, zero: result == 0, carry, ..before }
    }

    #[inline]
    fn carry(&mut self, flags: Flags) -> bool {
        flags.carry
    }

    #[inline]
    fn flags_from(&mut self, word: u32) -> Flags {
        Flags::from_word(word)
    }

    #[inline]
    fn flags_word(&mut self, flags: Flags) -> u32 {
        flags.to_word()
    }

    #[inline]
    fn holds(&mut self, condition: Condition, flags: Flags) -> bool {
        flags.satisfy(condition)
    }
}
