//! The domain of a machine's words: numbers, or sets of possible numbers.

use crate::instruction::{Condition, Shift};

/// Values that instructions compute with. [`execute`](crate) is generic over the domain. Its comparison with
/// an emulator in the concrete domain applies to every other domain, as long as each method here covers the
/// concrete method.
///
/// The domain is an object, so that it can number its values.
pub trait Domain {
    /// 32 bits.
    type Word: Copy + core::fmt::Debug + PartialEq;
    /// A truth value, possibly unknown.
    type Bit: Copy + core::fmt::Debug + PartialEq;
    /// N, Z, C and V.
    type Flags: Copy + core::fmt::Debug + PartialEq;

    /// A known word.
    fn constant(&mut self, value: u32) -> Self::Word;
    /// The value of a word, if only one is possible.
    fn known(&self, word: Self::Word) -> Option<u32>;
    /// A known truth value.
    fn bit(&mut self, value: bool) -> Self::Bit;
    /// The truth value, if known.
    fn known_bit(&self, bit: Self::Bit) -> Option<bool>;

    /// `a + b + carry`, and its flags. Subtraction is `a + !b + 1`; a domain may handle it in
    /// [`subtract`](Self::subtract) instead.
    fn add(&mut self, a: Self::Word, b: Self::Word, carry: Self::Bit) -> (Self::Word, Self::Flags);
    /// `a - b - !carry`, and its flags (C is "no borrow").
    fn subtract(&mut self, a: Self::Word, b: Self::Word, carry: Self::Bit) -> (Self::Word, Self::Flags);
    /// `a & b`.
    fn and(&mut self, a: Self::Word, b: Self::Word) -> Self::Word;
    /// `a | b`.
    fn or(&mut self, a: Self::Word, b: Self::Word) -> Self::Word;
    /// `a ^ b`.
    fn exclusive_or(&mut self, a: Self::Word, b: Self::Word) -> Self::Word;
    /// `!a`.
    fn not(&mut self, a: Self::Word) -> Self::Word;
    /// `a` shifted by the low byte of `amount` (0 to 255; `RotateExtended` by one), and the carry out.
    fn shift(
        &mut self,
        shift: Shift,
        a: Self::Word,
        amount: Self::Word,
        carry: Self::Bit,
    ) -> (Self::Word, Self::Bit);
    /// Low word of `a b`.
    fn multiply(&mut self, a: Self::Word, b: Self::Word) -> Self::Word;
    /// `a / b`, 0 when `b` is 0.
    fn divide_unsigned(&mut self, a: Self::Word, b: Self::Word) -> Self::Word;

    /// Any other function of up to three words. If an argument is unknown, a domain may treat the result as
    /// unknown.
    fn apply(&mut self, words: [Self::Word; 3], function: fn([u32; 3]) -> u32) -> Self::Word;
    /// Like [`apply`](Self::apply), for functions whose result is at most `greatest` (unsigned) for all
    /// arguments.
    fn apply_below(
        &mut self,
        words: [Self::Word; 3],
        greatest: u32,
        function: fn([u32; 3]) -> u32,
    ) -> Self::Word;
    /// A predicate of up to three words.
    fn test(&mut self, words: [Self::Word; 3], function: fn([u32; 3]) -> bool) -> Self::Bit;
    /// One of two words.
    fn select(&mut self, condition: Self::Bit, then: Self::Word, otherwise: Self::Word) -> Self::Word;

    /// Flags after a bitwise operation: N and Z of `result`, the given carry, unchanged V.
    fn flags_of(&mut self, result: Self::Word, carry: Self::Bit, before: Self::Flags) -> Self::Flags;
    /// The carry flag.
    fn carry(&mut self, flags: Self::Flags) -> Self::Bit;
    /// Flags from bits 31 to 28 of a word (`MSR`, `VMRS`).
    fn flags_from(&mut self, word: Self::Word) -> Self::Flags;
    /// Flags as bits 31 to 28 of a word.
    fn flags_word(&mut self, flags: Self::Flags) -> Self::Word;
    /// Whether a condition holds.
    fn holds(&mut self, condition: Condition, flags: Self::Flags) -> Self::Bit;
}
