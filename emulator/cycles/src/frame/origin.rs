//! The domain of words by origin: enough to track the stack pointer and addresses of functions.

use crate::concrete::Concrete;
use crate::domain::Domain;
use crate::instruction::{Condition, Register, Shift};

/// Knowledge about a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Word {
    /// Unknown.
    Unknown,
    /// This number.
    Constant(u32),
    /// The stack pointer at the function's start, plus this many bytes.
    Stack(i32),
    /// The value of this register at the function's start.
    Entry(Register),
}

impl Word {
    /// The knowledge common to both.
    pub(super) fn join(self, other: Self) -> Self {
        if self == other { self } else { Self::Unknown }
    }
}

/// The domain of these words. Flags are unknown.
#[derive(Debug, Clone, Copy)]
pub(super) struct Origins;

fn numbers<const N: usize>(words: [Word; N]) -> Option<[u32; N]> {
    let mut numbers = [0; N];
    for (number, word) in numbers.iter_mut().zip(words) {
        *number = Origins.known(word)?;
    }
    Some(numbers)
}

fn constant(number: Option<u32>) -> Word {
    number.map_or(Word::Unknown, Word::Constant)
}

/// `place + bytes`; a subtraction passes the wrapped negative.
fn moved(place: i32, bytes: u32) -> Word {
    Word::Stack(place.wrapping_add_unsigned(bytes))
}

impl Domain for Origins {
    type Word = Word;
    type Bit = Option<bool>;
    type Flags = ();

    fn constant(&mut self, value: u32) -> Word {
        Word::Constant(value)
    }

    fn known(&self, word: Word) -> Option<u32> {
        match word {
            Word::Constant(value) => Some(value),
            _ => None,
        }
    }

    fn bit(&mut self, value: bool) -> Option<bool> {
        Some(value)
    }

    fn known_bit(&self, bit: Option<bool>) -> Option<bool> {
        bit
    }

    fn add(&mut self, a: Word, b: Word, carry: Option<bool>) -> (Word, ()) {
        let Some(carry) = carry.map(u32::from) else { return (Word::Unknown, ()) };
        let sum = match (a, b) {
            (Word::Constant(a), Word::Constant(b)) => Word::Constant(a.wrapping_add(b).wrapping_add(carry)),
            (Word::Stack(place), Word::Constant(bytes)) | (Word::Constant(bytes), Word::Stack(place)) => {
                moved(place, bytes.wrapping_add(carry))
            }
            _ => Word::Unknown,
        };
        (sum, ())
    }

    fn subtract(&mut self, a: Word, b: Word, carry: Option<bool>) -> (Word, ()) {
        if let (Word::Stack(a), Word::Stack(b), Some(true)) = (a, b, carry) {
            return (Word::Constant(a.wrapping_sub(b).cast_unsigned()), ());
        }
        let negated = self.not(b);
        self.add(a, negated, carry)
    }

    /// The stack pointer is divisible by 8 at a function's start (AAPCS32, 6.2.1.2).
    fn and(&mut self, a: Word, b: Word) -> Word {
        match (a, b) {
            (Word::Constant(a), Word::Constant(b)) => Word::Constant(a & b),
            (Word::Stack(place), Word::Constant(mask)) | (Word::Constant(mask), Word::Stack(place))
                if mask | 7 == u32::MAX =>
            {
                Word::Stack(place & mask.cast_signed())
            }
            _ => Word::Unknown,
        }
    }

    fn or(&mut self, a: Word, b: Word) -> Word {
        constant(numbers([a, b]).map(|[a, b]| a | b))
    }

    fn exclusive_or(&mut self, a: Word, b: Word) -> Word {
        constant(numbers([a, b]).map(|[a, b]| a ^ b))
    }

    fn not(&mut self, a: Word) -> Word {
        constant(self.known(a).map(|a| !a))
    }

    fn shift(&mut self, shift: Shift, a: Word, amount: Word, carry: Option<bool>) -> (Word, Option<bool>) {
        match (numbers([a, amount]), carry) {
            (Some([a, amount]), Some(carry)) => {
                let (shifted, out) = Concrete.shift(shift, a, amount, carry);
                (Word::Constant(shifted), Some(out))
            }
            // Without a known carry flag, only shifts that do not use it.
            (Some([a, amount]), None) if shift != Shift::RotateExtended => {
                (Word::Constant(Concrete.shift(shift, a, amount, false).0), None)
            }
            _ => (Word::Unknown, None),
        }
    }

    fn multiply(&mut self, a: Word, b: Word) -> Word {
        constant(numbers([a, b]).map(|[a, b]| a.wrapping_mul(b)))
    }

    fn divide_unsigned(&mut self, a: Word, b: Word) -> Word {
        constant(numbers([a, b]).map(|[a, b]| a.checked_div(b).unwrap_or(0)))
    }

    fn apply(&mut self, words: [Word; 3], function: fn([u32; 3]) -> u32) -> Word {
        constant(numbers(words).map(function))
    }

    fn apply_below(&mut self, words: [Word; 3], _: u32, function: fn([u32; 3]) -> u32) -> Word {
        self.apply(words, function)
    }

    fn test(&mut self, words: [Word; 3], function: fn([u32; 3]) -> bool) -> Option<bool> {
        numbers(words).map(function)
    }

    fn select(&mut self, condition: Option<bool>, then: Word, otherwise: Word) -> Word {
        match condition {
            Some(true) => then,
            Some(false) => otherwise,
            None => then.join(otherwise),
        }
    }

    fn flags_of(&mut self, _: Word, _: Option<bool>, (): ()) {}

    fn carry(&mut self, (): ()) -> Option<bool> {
        None
    }

    fn flags_from(&mut self, _: Word) {}

    fn flags_word(&mut self, (): ()) -> Word {
        Word::Unknown
    }

    fn holds(&mut self, _: Condition, (): ()) -> Option<bool> {
        None
    }
}
