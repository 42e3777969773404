//! Parts of words, and words composed of parts.

use super::{Cell, slots_of};
use crate::abstraction::symbol::{Function, Joined, Origin, Side, Slot};
use crate::abstraction::{Abstract, Word};
use crate::domain::Domain as _;
use crate::instruction::Shift;
use crate::values::Values;

/// Maximum depth of nested merges when deriving a part.
const JOINS: u32 = 6;
/// Number that identifies parts among the functions of one word.
const PART: u8 = 9;
/// A byte that is zero.
const NOTHING: Slot = Slot { word: Word { symbol: 0, offset: 0 }, byte: 0 };

impl Abstract {
    /// `bytes` bytes of a word from byte `first`, as a number. The same part always yields the same word.
    pub(in crate::abstraction) fn part(&mut self, word: Word, first: u8, bytes: u8) -> Word {
        if bytes == 4 {
            return word;
        }
        let function = Function::Part(first, bytes);
        if let Some(number) = self.known(word) {
            return Word::constant(function.at(number));
        }
        let values = self.values(word);
        if first == 0 && values.high() <= function.at(u32::MAX) {
            return word;
        }
        if word == Word::ANYTHING {
            return self.unknown(function.image(&Values::ALL));
        }
        self.part_everywhere(word, (first, bytes), JOINS)
    }

    /// Like [`part`](Self::part), but for all paths: does not use facts of the current path.
    fn part_everywhere(&mut self, word: Word, (first, bytes): (u8, u8), joins: u32) -> Word {
        let function = Function::Part(first, bytes);
        if word.is_constant() {
            return Word::constant(function.at(word.offset));
        }
        let everywhere = self.everywhere(word);
        if first == 0 && everywhere.high() <= function.at(u32::MAX) {
            return word;
        }
        let key = (word, (PART, u32::from(first) << 8 | u32::from(bytes)));
        if let Some(part) = self.derived.get(&key) {
            return *part;
        }
        let image = function.image(&everywhere);
        let part = match self.symbol(word.symbol).map(|symbol| &symbol.origin) {
            Some(Origin::Joined(joined)) if joins > 0 => {
                let Joined { join, left, right } = **joined;
                let sides = [left, right].map(|side| Side {
                    word: self.part_everywhere(side.word.plus(word.offset), (first, bytes), joins - 1),
                    values: function.image(&side.values.add(&Values::one(word.offset))),
                });
                let sides = sides.map(|side| {
                    let everywhere = self.everywhere(side.word);
                    Side { values: everywhere.intersection(&side.values).unwrap_or(everywhere), ..side }
                });
                self.joined(join, sides)
            }
            _ => match self.part_of_bytes(word, (first, bytes), joins) {
                Some(part) => part,
                None => self.new_symbol(image, Origin::Derived(word, function)),
            },
        };
        self.derived.insert(key, part);
        part
    }

    /// Values of a word that are possible on any path.
    pub(in crate::abstraction) fn everywhere(&self, word: Word) -> Values {
        let values = self.symbol(word.symbol).map_or(Values::ALL, |symbol| symbol.values);
        values.add(&Values::one(word.offset))
    }

    /// Part of a word composed of bytes, if the selected bytes belong to one word.
    fn part_of_bytes(&mut self, word: Word, (first, bytes): (u8, u8), joins: u32) -> Option<Word> {
        let slots = self.bytes_of(word, |domain, word| domain.everywhere(word));
        let from = usize::from(first);
        let [Slot { word: other, byte }, rest @ ..] = slots.get(from..from + usize::from(bytes))? else {
            return None;
        };
        if *other == word {
            return None;
        }
        let rest_is =
            |expected: &dyn Fn(u8) -> Slot| (1..).zip(rest).all(|(place, slot)| *slot == expected(place));
        if rest_is(&|_| NOTHING) {
            return Some(self.part_everywhere(*other, (*byte, 1), joins));
        }
        let is_run = rest_is(&|place| Slot { word: *other, byte: byte.wrapping_add(place) });
        is_run.then(|| self.part_everywhere(*other, (*byte, bytes), joins))
    }

    /// The word to which all these slots belong, if its other bytes are zero.
    fn one_word(&self, slots: &[Slot]) -> Option<Word> {
        let word = slots.first()?.word;
        let is_one = (0..).zip(slots).all(|(byte, slot)| *slot == Slot { word, byte });
        let greatest = u32::MAX.checked_shr(32 - 8 * u32::try_from(slots.len()).ok()?)?;
        (is_one && self.values(word).high() <= greatest).then_some(word)
    }

    /// The number in the first `bytes` of four bytes.
    pub(in crate::abstraction) fn combine(&mut self, slots: &[Slot; 4], bytes: u8) -> Word {
        let used = slots.get(..usize::from(bytes)).unwrap_or_default();
        if let Some(word) = self.one_word(used) {
            return word;
        }
        if let [Slot { word, byte: first }, ..] = *used
            && (first..).zip(used).all(|(byte, slot)| *slot == Slot { word, byte })
        {
            return self.part(word, first, bytes);
        }
        let mut padded = [Slot { word: Word::constant(0), byte: 0 }; 4];
        padded.iter_mut().zip(used).for_each(|(to, from)| *to = *from);
        let mut values = Values::one(0);
        let mut rest: &[Slot] = used;
        let mut place = 0;
        while let Some(Slot { word, byte: first }) = rest.first().copied() {
            let run =
                (first..).zip(rest).take_while(|(byte, slot)| **slot == Slot { word, byte: *byte }).count();
            let part = self.part(word, first, u8::try_from(run).unwrap_or(4));
            let moved = self.values(part).shift(Shift::Left, &Values::one(8 * place)).unwrap_or(Values::ALL);
            values = values.or(&moved);
            place += u32::try_from(run).unwrap_or(4);
            rest = rest.get(run..).unwrap_or_default();
        }
        self.new_symbol(values, Origin::Bytes(padded))
    }

    /// Bytes of a word; bytes that are always zero become [`NOTHING`]. `values` returns the possible values
    /// of a word.
    fn bytes_of(&self, word: Word, values: impl Fn(&Self, Word) -> Values + Copy) -> [Slot; 4] {
        let whole = [0, 1, 2, 3].map(|byte| Slot { word, byte });
        if word.is_constant() {
            return whole.map(|slot| Slot { word: self.byte_of(slot), byte: 0 });
        }
        let mut slots = self.structure(word, values).unwrap_or(whole);
        let used = 4 - values(self, word).high().leading_zeros() / 8;
        slots.iter_mut().skip(usize::try_from(used).unwrap_or(4)).for_each(|slot| *slot = NOTHING);
        slots
    }

    /// Bytes of a word, derived from its origin.
    fn structure(&self, word: Word, values: impl Fn(&Self, Word) -> Values + Copy) -> Option<[Slot; 4]> {
        if word.offset != 0 {
            // Adding an offset keeps the bytes separate only where it adds to zero bytes.
            let mut slots = self.bytes_of(Word { offset: 0, ..word }, values);
            for (slot, added) in
                slots.iter_mut().zip(word.offset.to_le_bytes()).filter(|(_, added)| *added != 0)
            {
                if *slot != NOTHING {
                    return None;
                }
                *slot = Slot { word: Word::constant(added.into()), byte: 0 };
            }
            return Some(slots);
        }
        match &self.symbol(word.symbol)?.origin {
            Origin::Bytes(slots) => Some(*slots),
            Origin::Derived(source, Function::And(mask)) => {
                let mut slots = self.bytes_of(*source, values);
                for (slot, kept) in slots.iter_mut().zip(mask.to_le_bytes()) {
                    match kept {
                        0xFF => {}
                        0 => *slot = NOTHING,
                        _ => return None,
                    }
                }
                Some(slots)
            }
            Origin::Derived(source, Function::Shift(Shift::Left, bits)) => {
                let [a, b, c, _] = self.bytes_of(*source, values);
                match bits {
                    8 => Some([NOTHING, a, b, c]),
                    16 => Some([NOTHING, NOTHING, a, b]),
                    24 => Some([NOTHING, NOTHING, NOTHING, a]),
                    _ => None,
                }
            }
            _ => None,
        }
    }

    /// A known byte as a separate word.
    fn byte_of(&self, slot: Slot) -> Word {
        Word::constant(Function::Part(slot.byte, 1).at(slot.word.offset))
    }

    /// The sum of two words without a common nonzero byte.
    pub(in crate::abstraction) fn beside(&mut self, a: Word, b: Word) -> Option<Word> {
        let values = |domain: &Self, word| domain.values(word);
        let mut slots = self.bytes_of(a, values);
        for (slot, other) in slots.iter_mut().zip(self.bytes_of(b, values)) {
            match (*slot == NOTHING, other == NOTHING) {
                (true, _) => *slot = other,
                (false, true) => {}
                (false, false) => return None,
            }
        }
        Some(self.combine(&slots, 4))
    }

    /// A cell read as a word.
    pub(in crate::abstraction) fn whole(&mut self, cell: &Cell) -> Word {
        match cell {
            Cell::Whole(word) => *word,
            Cell::Parts(_) => self.combine(&slots_of(cell), 4),
        }
    }
}
