//! Operations on partially known words.

use super::flags::Flags;
use super::symbol::{Function, Origin};
use super::{Abstract, Word};
use crate::domain::Domain;
use crate::instruction::{Condition, Shift};
use crate::values::Values;

/// A truth value, possibly unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Bit {
    /// Known.
    Known(bool),
    /// True if this condition holds for these flags.
    Holds(Condition, Flags),
    /// Unknown.
    Unknown,
}

impl Abstract {
    /// A function of one unknown word. The same function of the same word yields the same word, so facts
    /// about one computation hold for the next.
    fn derived(&mut self, word: Word, function: Function) -> Word {
        if word == Word::ANYTHING || word.is_constant() {
            return self.unknown(function.image(&self.values(word)));
        }
        let Some(name) = function.name() else {
            let values = function.image(&self.values(word));
            return self.new_symbol(values, Origin::Derived(word, function));
        };
        if let Some(known) = self.derived.get(&(word, name)) {
            return *known;
        }
        // Values possible on any path, because all paths share the result.
        let values = function.image(&self.everywhere(word));
        let result = self.new_symbol(values, Origin::Derived(word, function));
        self.derived.insert((word, name), result);
        result
    }

    fn derived_as(&mut self, word: Word, function: Function, values: Values) -> Word {
        if word == Word::ANYTHING {
            self.unknown(values)
        } else {
            self.new_symbol(values, Origin::Derived(word, function))
        }
    }

    /// The only unknown word among three, with the values of the other two and its position.
    fn only_unknown(&self, words: [Word; 3]) -> Option<(Word, [u32; 3], u8)> {
        let mut numbers = [0; 3];
        let mut unknown = None;
        for ((place, word), number) in (0..).zip(words).zip(&mut numbers) {
            match (self.known(word), unknown) {
                (Some(known), _) => *number = known,
                (None, None) => unknown = Some((word, place)),
                (None, Some(_)) => return None,
            }
        }
        unknown.map(|(word, place)| (word, numbers, place))
    }

    /// As [`Domain::apply`], for results within `bounds`.
    fn function(&mut self, words: [Word; 3], bounds: Values, function: fn([u32; 3]) -> u32) -> Word {
        let values = Values::map(words.map(|word| self.values(word)), function).unwrap_or(bounds);
        match self.only_unknown(words) {
            Some((word, numbers, place)) => {
                self.derived_as(word, Function::Other(function, numbers, place), values)
            }
            None => self.unknown(values),
        }
    }

    /// The word whose bitwise inverse is `word`.
    fn inverted(&self, word: Word) -> Option<Word> {
        match self.symbol(word.symbol).filter(|_| word.offset == 0)?.origin {
            Origin::Derived(source, Function::From(u32::MAX)) => Some(source),
            _ => None,
        }
    }

    /// Sum of two multiples of the same word: compilers multiply by small numbers this way.
    fn sum_of_multiples(&mut self, a: Word, b: Word) -> Option<Word> {
        let ((source, one), (other, two)) = (self.multiple(a), self.multiple(b));
        let sum = |this: &mut Self| this.derived(source, Function::Multiply(one.wrapping_add(two)));
        let is_same = source == other && source != Word::ANYTHING;
        is_same.then(|| sum(self).plus(a.offset.wrapping_add(b.offset)))
    }

    /// The word that `word` is a multiple of, and the factor. Ignores the offset.
    fn multiple(&self, word: Word) -> (Word, u32) {
        match self.symbol(word.symbol).map(|symbol| &symbol.origin) {
            Some(Origin::Derived(source, Function::Multiply(factor))) => (*source, *factor),
            Some(Origin::Derived(source, Function::Shift(Shift::Left, bits @ 1..32))) => (*source, 1 << bits),
            _ => (Word { offset: 0, ..word }, 1),
        }
    }

    fn with_number(&self, a: Word, b: Word) -> Option<(Word, u32)> {
        match (self.known(a), self.known(b)) {
            (_, Some(number)) => Some((a, number)),
            (Some(number), _) => Some((b, number)),
            _ => None,
        }
    }
}

impl Domain for Abstract {
    type Word = Word;
    type Bit = Bit;
    type Flags = Flags;

    fn constant(&mut self, value: u32) -> Word {
        Word::constant(value)
    }

    fn known(&self, word: Word) -> Option<u32> {
        if word.is_constant() { Some(word.offset) } else { self.values(word).single() }
    }

    fn bit(&mut self, value: bool) -> Bit {
        Bit::Known(value)
    }

    fn known_bit(&self, bit: Bit) -> Option<bool> {
        match bit {
            Bit::Known(value) => Some(value),
            Bit::Holds(condition, flags) => flags.decide(condition),
            Bit::Unknown => None,
        }
    }

    fn add(&mut self, a: Word, b: Word, carry: Bit) -> (Word, Flags) {
        let carry = self.known_bit(carry);
        let sum = match (carry, self.known(a), self.known(b)) {
            (Some(carry), _, Some(number)) => a.plus(number.wrapping_add(u32::from(carry))),
            (Some(carry), Some(number), _) => b.plus(number.wrapping_add(u32::from(carry))),
            _ => match self
                .beside(a, b)
                .or_else(|| self.sum_of_multiples(a, b))
                .filter(|_| carry == Some(false))
            {
                Some(sum) => sum,
                None => {
                    let carry =
                        carry.map_or_else(|| Values::between(0, 1), |carry| Values::one(carry.into()));
                    let values = self.values(a).add(&self.values(b)).add(&carry);
                    self.unknown(values)
                }
            },
        };
        let flags = self.flags_of_sum(a, b, carry, &self.values(sum));
        (sum, flags)
    }

    fn subtract(&mut self, a: Word, b: Word, carry: Bit) -> (Word, Flags) {
        if self.known_bit(carry) != Some(true) {
            let b = self.not(b);
            return self.add(a, b, carry);
        }
        let is_same = a.symbol == b.symbol && a != Word::ANYTHING;
        let difference = match (self.known(a), self.known(b)) {
            _ if is_same => Word::constant(a.offset.wrapping_sub(b.offset)),
            (_, Some(number)) => a.plus(number.wrapping_neg()),
            (Some(number), _) => self.derived(b, Function::From(number)),
            _ => {
                let values = self.values(a).subtract(&self.values(b));
                self.unknown(values)
            }
        };
        let result = self.values(difference);
        let flags = self.flags_of_difference(a, b, &result);
        (difference, flags)
    }

    fn and(&mut self, a: Word, b: Word) -> Word {
        match self.with_number(a, b) {
            _ if a == b => a,
            Some((_, 0)) => Word::constant(0),
            Some((word, u32::MAX)) => word,
            Some((word, 0xFF)) => self.part(word, 0, 1),
            Some((word, 0xFFFF)) => self.part(word, 0, 2),
            Some((word, mask)) => match self.inverted(word) {
                // Relates the bits of the inverse to the bits of the source.
                Some(source) => {
                    let bits = self.derived(source, Function::And(mask));
                    self.derived(bits, Function::ExclusiveOr(mask))
                }
                None => self.derived(word, Function::And(mask)),
            },
            None => {
                let values = self.values(a).and(&self.values(b));
                self.unknown(values)
            }
        }
    }

    fn or(&mut self, a: Word, b: Word) -> Word {
        if let Some(beside) = self.beside(a, b).filter(|_| a != b) {
            return beside;
        }
        match self.with_number(a, b) {
            _ if a == b => a,
            Some((word, bits)) => self.derived(word, Function::Or(bits)),
            None => {
                let values = self.values(a).or(&self.values(b));
                self.unknown(values)
            }
        }
    }

    fn exclusive_or(&mut self, a: Word, b: Word) -> Word {
        match self.with_number(a, b) {
            _ if a == b && a != Word::ANYTHING => Word::constant(0),
            Some((word, 0)) => word,
            Some((word, bits)) => self.derived(word, Function::ExclusiveOr(bits)),
            None => {
                let values = self.values(a).exclusive_or(&self.values(b));
                self.unknown(values)
            }
        }
    }

    fn not(&mut self, a: Word) -> Word {
        match self.known(a) {
            Some(number) => Word::constant(!number),
            None => self.derived(a, Function::From(u32::MAX)),
        }
    }

    fn shift(&mut self, shift: Shift, a: Word, amount: Word, carry: Bit) -> (Word, Bit) {
        let by = self.known(amount).map(|amount| amount & 0xFF);
        if shift == Shift::RotateExtended {
            let top = self
                .known_bit(carry)
                .map_or_else(|| Values::between(0, 1), |carry| Values::one(carry.into()));
            let values = self.values(a);
            let top = top.multiply(&Values::one(1 << 31));
            let halved = values.shift(Shift::LogicalRight, &Values::one(1)).unwrap_or(Values::ALL);
            let out = carry_out(shift, &values, 1);
            return (self.unknown(halved.or(&top)), out);
        }
        match by {
            Some(0) => (a, carry),
            Some(bits) => {
                let out = carry_out(shift, &self.values(a), bits);
                let word = match (shift, bits) {
                    _ if self.known(a).is_some() => self.derived(a, Function::Shift(shift, bits)),
                    (Shift::LogicalRight, 16) => self.part(a, 2, 2),
                    (Shift::LogicalRight, 24) => self.part(a, 3, 1),
                    _ => self.derived(a, Function::Shift(shift, bits)),
                };
                (word, out)
            }
            None => {
                let values = self.values(a).shift(shift, &self.values(amount)).unwrap_or(Values::ALL);
                (self.unknown(values), Bit::Unknown)
            }
        }
    }

    fn multiply(&mut self, a: Word, b: Word) -> Word {
        match self.with_number(a, b) {
            Some((word, 1)) => word,
            Some((word, factor)) => self.derived(word, Function::Multiply(factor)),
            None => {
                let values = self.values(a).multiply(&self.values(b));
                self.unknown(values)
            }
        }
    }

    fn divide_unsigned(&mut self, a: Word, b: Word) -> Word {
        let values = self.values(a).divide(&self.values(b));
        self.unknown(values)
    }

    fn apply(&mut self, words: [Word; 3], function: fn([u32; 3]) -> u32) -> Word {
        self.function(words, Values::ALL, function)
    }

    fn apply_below(&mut self, words: [Word; 3], greatest: u32, function: fn([u32; 3]) -> u32) -> Word {
        self.function(words, Values::between(0, greatest), function)
    }

    fn test(&mut self, words: [Word; 3], function: fn([u32; 3]) -> bool) -> Bit {
        let values = words.map(|word| self.values(word));
        match Values::map(values, |words| u32::from(function(words))).and_then(|truth| truth.single()) {
            Some(truth) => Bit::Known(truth == 1),
            None => Bit::Unknown,
        }
    }

    fn select(&mut self, condition: Bit, then: Word, otherwise: Word) -> Word {
        match self.known_bit(condition) {
            Some(true) => then,
            Some(false) => otherwise,
            None if then == otherwise => then,
            None => {
                let values = self.values(then).union(&self.values(otherwise));
                self.unknown(values)
            }
        }
    }

    fn flags_of(&mut self, result: Word, carry: Bit, before: Flags) -> Flags {
        let carry = self.known_bit(carry);
        Flags::of_result(result, &self.values(result), carry, before)
    }

    fn carry(&mut self, flags: Flags) -> Bit {
        self.holds(Condition::CarrySet, flags)
    }

    fn flags_from(&mut self, word: Word) -> Flags {
        Flags::from_bits(&self.values(word))
    }

    fn flags_word(&mut self, flags: Flags) -> Word {
        self.unknown(flags.bits())
    }

    fn holds(&mut self, condition: Condition, flags: Flags) -> Bit {
        match flags.decide(condition) {
            Some(truth) => Bit::Known(truth),
            None => Bit::Holds(condition, flags),
        }
    }
}

/// The last bit shifted out by a shift of 1 to 255 bits.
fn carry_out(shift: Shift, values: &Values, bits: u32) -> Bit {
    let out = |number: u32| {
        u32::from(match shift {
            Shift::Left => bits <= 32 && number.checked_shr(32 - bits).unwrap_or(0) & 1 == 1,
            Shift::LogicalRight => number.checked_shr(bits - 1).unwrap_or(0) & 1 == 1,
            Shift::ArithmeticRight => (number.cast_signed() >> (bits - 1).min(31)) & 1 == 1,
            Shift::RotateRight => number.rotate_right(bits) >> 31 == 1,
            Shift::RotateExtended => number & 1 == 1,
        })
    };
    let none = Values::one(0);
    match Values::map([*values, none, none], |[number, ..]| out(number)).and_then(|out| out.single()) {
        Some(out) => Bit::Known(out == 1),
        None => Bit::Unknown,
    }
}
