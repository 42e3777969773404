//! The merge of two paths: the state that covers both.

use std::collections::HashMap;
use std::rc::Rc;

use super::facts::Facts;
use super::flags::{Flags, Source};
use super::memory::{Cell, Page, Pages, cell_of, slots_of};
use super::symbol::{Side, Slot};
use super::{Abstract, AbstractMemory, Bit, Word};
use crate::state::Registers;

/// The merge of two paths.
pub(crate) struct Join<'a> {
    domain: &'a mut Abstract,
    left: &'a Facts,
    right: &'a Facts,
    number: u32,
    /// Merged words by the two symbols and the distance of their offsets: the merged word, and the left
    /// word's offset.
    joined: HashMap<(u32, u32, u32), (Word, u32)>,
}

impl<'a> Join<'a> {
    pub(crate) fn new(domain: &'a mut Abstract, left: &'a Facts, right: &'a Facts) -> Self {
        domain.joins += 1;
        let number = domain.joins;
        Self { domain, left, right, number, joined: HashMap::new() }
    }

    /// A word that covers both words. Words with a constant difference on both paths keep it.
    pub(crate) fn word(&mut self, left: Word, right: Word) -> Word {
        if left == right {
            return left;
        }
        if left == Word::ANYTHING || right == Word::ANYTHING {
            return Word::ANYTHING;
        }
        let key = (left.symbol, right.symbol, left.offset.wrapping_sub(right.offset));
        if let Some((word, offset)) = self.joined.get(&key) {
            return word.plus(left.offset.wrapping_sub(*offset));
        }
        let sides = [
            Side { word: left, values: self.domain.values_by(left, self.left) },
            Side { word: right, values: self.domain.values_by(right, self.right) },
        ];
        let word = self.domain.joined(self.number, sides);
        self.joined.insert(key, (word, left.offset));
        word
    }

    /// Registers that cover both paths.
    pub(crate) fn registers(
        &mut self,
        left: &Registers<Abstract>,
        right: &Registers<Abstract>,
    ) -> Registers<Abstract> {
        let mut both = left.clone();
        let pairs = both.core.iter_mut().zip(right.core).chain(both.float.iter_mut().zip(right.float));
        for (to, from) in pairs {
            *to = self.word(*to, from);
        }
        both.flags = self.flags(left.flags, right.flags);
        both.float_flags = self.flags(left.float_flags, right.float_flags);
        both.primask = self.word(left.primask, right.primask);
        both.faultmask = self.word(left.faultmask, right.faultmask);
        both.basepri = self.word(left.basepri, right.basepri);
        both.dsp_flags = self.word(left.dsp_flags, right.dsp_flags);
        both.exclusive = if left.exclusive == right.exclusive { left.exclusive } else { Bit::Unknown };
        both
    }

    fn flags(&mut self, left: Flags, right: Flags) -> Flags {
        let source = match (left.source, right.source) {
            (Source::Difference(a, b), Source::Difference(c, d)) => {
                Source::Difference(self.word(a, c), self.word(b, d))
            }
            (Source::Sum(a, b), Source::Sum(c, d)) => Source::Sum(self.word(a, c), self.word(b, d)),
            (Source::Result(a), Source::Result(b)) => Source::Result(self.word(a, b)),
            _ => Source::Unknown,
        };
        Flags { possible: left.possible | right.possible, source }
    }

    /// Memory that covers both paths.
    pub(crate) fn memory(&mut self, left: &AbstractMemory, right: &AbstractMemory) -> AbstractMemory {
        let mut both = left.clone();
        if Rc::ptr_eq(&left.regions, &right.regions) {
            return both;
        }
        let regions = left.regions.iter().zip(right.regions.iter()).map(|(left, right)| {
            let pages = left.pages.iter().zip(&right.pages).map(|(left, right)| self.page(left, right));
            Pages { pages: pages.collect(), ..*left }
        });
        both.regions = Rc::new(regions.collect());
        both
    }

    fn page(&mut self, left: &Rc<Page>, right: &Rc<Page>) -> Rc<Page> {
        if Rc::ptr_eq(left, right) {
            return Rc::clone(left);
        }
        let mut page = Rc::clone(left);
        for (place, (left, right)) in left.iter().zip(right.iter()).enumerate().filter(|(_, (a, b))| a != b) {
            let cell = self.cell(left, right);
            if let Some(to) = Rc::make_mut(&mut page).get_mut(place) {
                *to = cell;
            }
        }
        page
    }

    fn cell(&mut self, left: &Cell, right: &Cell) -> Cell {
        if let (Cell::Whole(left), Cell::Whole(right)) = (left, right) {
            return Cell::Whole(self.word(*left, *right));
        }
        let ([a, b, c, d], [e, f, g, h]) = (slots_of(left), slots_of(right));
        let ([a, b], [c, d]) = (self.half([a, b], [e, f]), self.half([c, d], [g, h]));
        cell_of([a, b, c, d])
    }

    /// Two bytes, as one number if they form a number on both paths.
    fn half(&mut self, left: [Slot; 2], right: [Slot; 2]) -> [Slot; 2] {
        if left == right {
            return left;
        }
        let is_one = |[a, b]: [Slot; 2]| a.word == b.word && a.byte + 1 == b.byte;
        if is_one(left) && is_one(right) {
            let word = self.part(left, right, 2);
            return [0, 1].map(|byte| Slot { word, byte });
        }
        let [a, b] = left;
        let [c, d] = right;
        [([a, a], [c, c]), ([b, b], [d, d])]
            .map(|(left, right)| Slot { word: self.part(left, right, 1), byte: 0 })
    }

    fn part(&mut self, [left, _]: [Slot; 2], [right, _]: [Slot; 2], bytes: u8) -> Word {
        let parts = [(left, self.left), (right, self.right)].map(|(slot, facts)| {
            let before = std::mem::replace(&mut self.domain.facts, facts.clone());
            let part = self.domain.part(slot.word, slot.byte, bytes);
            self.domain.facts = before;
            part
        });
        let [left, right] = parts;
        self.word(left, right)
    }

    /// Facts that hold on both paths.
    pub(crate) fn facts(&self) -> Facts {
        self.left.common(self.right)
    }
}
