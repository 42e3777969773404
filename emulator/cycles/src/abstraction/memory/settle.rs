//! Memory before and after a call: detection of changes, and widening of growing values.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ops::Range;
use std::rc::Rc;

use super::{AbstractMemory, Cell, PAGE_WORDS, Page, cell_of, slots_of};
use crate::abstraction::symbol::{Origin, Slot};
use crate::abstraction::{Abstract, Word};
use crate::instruction::Width;
use crate::values::Values;

impl AbstractMemory {
    /// Makes the values at these addresses unknown and independent of each other.
    pub(crate) fn forget(
        &mut self,
        domain: &mut Abstract,
        addresses: Range<u32>,
        width: Width,
        values: &Values,
    ) {
        let bytes = super::bytes(width);
        let greatest = u32::MAX >> (32 - 8 * u32::from(bytes));
        let is_anything = (values.low(), values.high(), values.step()) == (0, greatest, 1);
        let mut address = addresses.start;
        while address < addresses.end {
            let is_word = is_anything && address.is_multiple_of(4) && addresses.end - address >= 4;
            let (bytes, values) = if is_word { (4, Values::ALL) } else { (bytes, *values) };
            let value = domain.unknown(values);
            self.store_at(domain, address, bytes, value);
            address = address.saturating_add(bytes.into());
        }
    }

    /// Every page with its address.
    fn pages(&self) -> impl Iterator<Item = (u32, &Rc<Page>)> {
        let bytes = u32::try_from(4 * PAGE_WORDS).unwrap_or(u32::MAX);
        self.regions.iter().flat_map(move |region| {
            (0..)
                .zip(&region.pages)
                .map(move |(place, page)| (region.address.saturating_add(bytes * place), page))
        })
    }

    /// The lowest address, outside the given ranges, where `after` is not covered by this memory: a new
    /// value, or two equal values that now differ. `None` if this memory covers `after`.
    pub(crate) fn first_change(&self, domain: &Abstract, after: &Self, given: &[Range<u32>]) -> Option<u32> {
        let mut same: HashMap<u32, (u32, u32)> = HashMap::new();
        for ((start, before), (_, after)) in self.pages().zip(after.pages()) {
            for ((address, before), after) in (start..).step_by(4).zip(before.iter()).zip(after.iter()) {
                for ((address, before), after) in (address..).zip(slots_of(before)).zip(slots_of(after)) {
                    let is_given = given.iter().any(|range| range.contains(&address));
                    if !is_given && !domain.covers(&mut same, before, after) {
                        return Some(address);
                    }
                }
            }
        }
        None
    }

    /// Widens numbers that repeatedly grew in the last merge: to a number from a comparison, finally to the
    /// full range. `growths` counts how often each number grew.
    pub(crate) fn widen(mut self, domain: &mut Abstract, growths: &mut BTreeMap<u32, u32>) -> Self {
        let mut wider = HashMap::new();
        let before = self.clone();
        let pages = Rc::make_mut(&mut self.regions).iter_mut().flat_map(|region| &mut region.pages);
        for ((address, old), page) in before.pages().zip(pages) {
            for (place, (address, cell)) in (address..).step_by(4).zip(old.iter()).enumerate() {
                let slots = slots_of(cell);
                let widened = slots.map(|slot| {
                    let word = domain.widened(&mut wider, slot.word, growths.entry(address).or_default());
                    Slot { word, ..slot }
                });
                if slots != widened
                    && let Some(to) = Rc::make_mut(page).get_mut(place)
                {
                    *to = match (cell, widened) {
                        (Cell::Whole(_), [Slot { word, .. }, ..]) => Cell::Whole(word),
                        (Cell::Parts(_), slots) => cell_of(slots),
                    };
                }
            }
        }
        self
    }
}

impl Abstract {
    /// Whether the byte `before` covers the byte `after`: its possible values and its relations to other
    /// bytes. `same` maps symbols before to symbols after.
    fn covers(&self, same: &mut HashMap<u32, (u32, u32)>, before: Slot, after: Slot) -> bool {
        if before.word == Word::ANYTHING || after.word == Word::ANYTHING {
            return before.word == Word::ANYTHING;
        }
        if before.word.is_constant() {
            let number = |slot: Slot| slot.word.offset >> (8 * u32::from(slot.byte)) & 0xFF;
            return after.word.is_constant() && number(before) == number(after);
        }
        let distance = after.word.offset.wrapping_sub(before.word.offset);
        let tie = (after.word.symbol, distance);
        let values = self.values(before.word);
        before.byte == after.byte
            && *same.entry(before.word.symbol).or_insert(tie) == tie
            && (before == after || values.union(&self.values(after.word)) == values)
    }

    /// A word that covers this word, or more if the word grew. Keeps only the properties that
    /// [`covers`](Self::covers) compares; `wider` preserves relations to other words. Other origins of a
    /// symbol, such as the path taken at a merge, may hold only for the current round.
    fn widened(&mut self, wider: &mut HashMap<u32, Word>, word: Word, growths: &mut u32) -> Word {
        if let Some(widened) = wider.get(&word.symbol) {
            return widened.plus(word.offset);
        }
        let symbol = Word { offset: 0, ..word };
        let now = self.values(symbol);
        let before = match self.symbol(word.symbol).map(|symbol| &symbol.origin) {
            None | Some(Origin::Given) => return word,
            Some(Origin::Joined(joined)) if joined.join == self.joins => joined.left.values,
            Some(_) => now,
        };
        let mut values = now;
        if before.union(&now) != before {
            *growths += 1;
            values = match *growths {
                ..PATIENCE => now,
                PATIENCE..THRESHOLDS => grown(&before, &now, &self.thresholds),
                _ => Values::ALL,
            };
        }
        let widened = self.unknown(values);
        wider.insert(word.symbol, widened);
        widened.plus(word.offset)
    }
}

/// Growths of a number before it is widened to the next threshold.
const PATIENCE: u32 = 3;
/// Growths of a number before it becomes unknown.
const THRESHOLDS: u32 = 7;
/// Limits for growing numbers, in addition to the numbers in comparisons.
const WIDTHS: [u32; 3] = [0xFF, 0xFFFF, 0x7FFF_FFFF];

/// Widens `now` to the next thresholds where it exceeds `before`.
fn grown(before: &Values, now: &Values, thresholds: &BTreeSet<u32>) -> Values {
    let above = |end: u32| {
        let compared = thresholds.range(end..).next().copied();
        WIDTHS.into_iter().filter(|width| *width >= end).chain(compared).min().unwrap_or(u32::MAX)
    };
    let below = |end: u32| thresholds.range(..=end).next_back().copied().unwrap_or(0);
    let step = now.step().max(1);
    let high = if now.high() > before.high() { above(now.high()) } else { now.high() };
    let low = if now.low() < before.low() { below(now.low()) } else { now.low() };
    Values::stepped(now.low() - (now.low() - low) / step * step, high, step)
}
