//! What the words of a machine are: numbers, or all the numbers that they can be.

use crate::instruction::{Condition, Shift};

/// Values that instructions compute with. [`execute`](crate) is written over any domain; what it proves of the concrete
/// one (against an emulator) holds for every other, as long as each method here covers the concrete one.
///
/// A domain is an object, so that it can number the values it makes.
pub trait Domain {
    /// 32 bits.
    type Word: Copy + core::fmt::Debug + PartialEq;
    /// A truth, possibly not known.
    type Bit: Copy + core::fmt::Debug + PartialEq;
    /// N, Z, C and V.
    type Flags: Copy + core::fmt::Debug + PartialEq;

    /// A known word.
    fn constant(&mut self, value: u32) -> Self::Word;
    /// The number a word is, if there is but one.
    fn known(&self, word: Self::Word) -> Option<u32>;
    /// A known truth.
    fn bit(&mut self, value: bool) -> Self::Bit;
    /// The truth, if it is known.
    fn known_bit(&self, bit: Self::Bit) -> Option<bool>;

    /// `a + b + carry`, with the flags that it sets. Subtraction is `a + !b + 1`: a domain may recognise it by
    /// [`subtract`](Self::subtract) instead.
    fn add(&mut self, a: Self::Word, b: Self::Word, carry: Self::Bit) -> (Self::Word, Self::Flags);
    /// `a - b - !carry`, with the flags that it sets (C is "no borrow").
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

    /// Any other function of up to three words: a domain that does not know all of them knows nothing of the result.
    fn apply(&mut self, words: [Self::Word; 3], function: fn([u32; 3]) -> u32) -> Self::Word;
    /// As [`apply`](Self::apply), for functions whose result is at most `greatest` (unsigned) whatever the words.
    fn apply_below(
        &mut self,
        words: [Self::Word; 3],
        greatest: u32,
        function: fn([u32; 3]) -> u32,
    ) -> Self::Word;
    /// A truth about up to three words.
    fn test(&mut self, words: [Self::Word; 3], function: fn([u32; 3]) -> bool) -> Self::Bit;
    /// One of two words.
    fn select(&mut self, condition: Self::Bit, then: Self::Word, otherwise: Self::Word) -> Self::Word;

    /// Flags after an operation on bits: N and Z of `result`, the carry given, V as it was.
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
