//! Symbols, their values and origins.

use crate::instruction::Shift;
use crate::values::{Values, shifted};

/// A symbol plus a number, wrapping.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Word {
    pub(super) symbol: u32,
    pub(super) offset: u32,
}

/// The symbol 0: a word with this symbol is a constant.
const ZERO: u32 = 0;
/// Represents an unknown value, a different one at each use: facts about it are impossible.
const ANYTHING: u32 = 1;

impl Word {
    pub(super) const ANYTHING: Self = Self { symbol: ANYTHING, offset: 0 };

    pub(super) fn constant(number: u32) -> Self {
        Self { symbol: ZERO, offset: number }
    }

    pub(super) fn is_constant(self) -> bool {
        self.symbol == ZERO
    }

    pub(super) fn plus(self, number: u32) -> Self {
        if self.symbol == ANYTHING {
            return self;
        }
        Self { offset: self.offset.wrapping_add(number), ..self }
    }
}

#[derive(Debug)]
pub(super) struct Symbol {
    /// Values possible on any path.
    pub(super) values: Values,
    pub(super) origin: Origin,
}

/// Origin of a symbol.
#[derive(Debug)]
pub(super) enum Origin {
    Given,
    /// A function of another word.
    Derived(Word, Function),
    /// Four adjacent bytes in memory.
    Bytes([Slot; 4]),
    /// One of two words, depending on the path taken.
    Joined(Box<Joined>),
}

/// A symbol created by a merge of two paths.
#[derive(Debug)]
pub(super) struct Joined {
    pub(super) join: u32,
    pub(super) left: Side,
    pub(super) right: Side,
}

/// The word and values of a symbol on one of the two paths.
#[derive(Debug, Clone, Copy)]
pub(super) struct Side {
    pub(super) word: Word,
    pub(super) values: Values,
}

/// A byte of a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Slot {
    pub(super) word: Word,
    pub(super) byte: u8,
}

/// Functions of one word whose argument can be derived from the result.
#[derive(Debug, Clone, Copy)]
pub(super) enum Function {
    And(u32),
    Or(u32),
    ExclusiveOr(u32),
    /// This number minus the word.
    From(u32),
    Multiply(u32),
    Shift(Shift, u32),
    /// First byte and number of bytes.
    Part(u8, u8),
    /// Any function, with the word as this argument.
    Other(fn([u32; 3]) -> u32, [u32; 3], u8),
}

impl Function {
    /// Unique key of a function; `None` for functions that cannot be compared.
    pub(super) fn name(self) -> Option<(u8, u32)> {
        Some(match self {
            Self::And(mask) => (0, mask),
            Self::Or(bits) => (1, bits),
            Self::ExclusiveOr(bits) => (2, bits),
            Self::From(minuend) => (3, minuend),
            Self::Multiply(factor) => (4, factor),
            Self::Shift(Shift::Left, bits) => (5, bits),
            Self::Shift(Shift::LogicalRight, bits) => (6, bits),
            Self::Shift(Shift::ArithmeticRight, bits) => (7, bits),
            Self::Shift(Shift::RotateRight, bits) => (8, bits),
            Self::Part(first, bytes) => (9, u32::from(first) << 8 | u32::from(bytes)),
            Self::Shift(Shift::RotateExtended, _) | Self::Other(..) => return None,
        })
    }

    /// Applies the function to one number.
    pub(super) fn at(self, number: u32) -> u32 {
        match self {
            Self::And(mask) => number & mask,
            Self::Or(bits) => number | bits,
            Self::ExclusiveOr(bits) => number ^ bits,
            Self::From(minuend) => minuend.wrapping_sub(number),
            Self::Multiply(factor) => number.wrapping_mul(factor),
            Self::Shift(shift, bits) => shifted(shift, number, bits),
            Self::Part(first, bytes) => {
                (number >> (8 * u32::from(first)))
                    & u32::MAX.checked_shr(32 - 8 * u32::from(bytes)).unwrap_or(0)
            }
            Self::Other(function, mut words, place) => {
                if let Some(word) = words.get_mut(usize::from(place)) {
                    *word = number;
                }
                function(words)
            }
        }
    }

    /// Results for all possible values of a word.
    pub(super) fn image(self, values: &Values) -> Values {
        let tried = || Values::map([*values, Values::one(0), Values::one(0)], |[number, ..]| self.at(number));
        match self {
            Self::And(mask) => values.and(&Values::one(mask)),
            Self::Or(bits) => values.or(&Values::one(bits)),
            Self::ExclusiveOr(bits) => values.exclusive_or(&Values::one(bits)),
            Self::From(minuend) => Values::one(minuend).subtract(values),
            Self::Multiply(factor) => values.multiply(&Values::one(factor)),
            Self::Shift(shift, bits) => values.shift(shift, &Values::one(bits)).unwrap_or(Values::ALL),
            Self::Part(first, bytes) => {
                let mask = u32::MAX.checked_shr(32 - 8 * u32::from(bytes)).unwrap_or(0);
                let from = Values::one(8 * u32::from(first));
                let upper = values.shift(Shift::LogicalRight, &from).unwrap_or(Values::ALL);
                upper.and(&Values::one(mask))
            }
            Self::Other(..) => tried().unwrap_or(Values::ALL),
        }
    }

    /// Possible values of the word if the result is one of `results`; `None` if the result does not constrain
    /// them.
    pub(super) fn source(self, results: &Values) -> Option<Values> {
        match self {
            Self::From(minuend) => Some(Values::one(minuend).subtract(results)),
            // The low bits are known, so the values form an arithmetic progression.
            Self::And(mask) => {
                let step = mask.checked_add(1).filter(|step| step.is_power_of_two())?;
                Some(Values::stepped(results.single()?, u32::MAX, step))
            }
            Self::Shift(Shift::Left, bits @ 1..32) => {
                Some(Values::stepped(results.single()? >> bits, u32::MAX, 1 << (32 - bits)))
            }
            Self::Shift(Shift::LogicalRight, bits @ 0..32) => {
                let low = results.low().checked_mul(1 << bits)?;
                let high = results.high().checked_mul(1 << bits)? | ((1 << bits) - 1);
                Some(Values::between(low, high))
            }
            _ => None,
        }
    }
}
