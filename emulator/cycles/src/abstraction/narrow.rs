//! New facts about a word, and their consequences for other words.

use std::rc::Rc;

use super::facts::Choice;
use super::symbol::{Joined, Origin, Side};
use super::{Abstract, Word};
use crate::values::{MAX_SET, Values};

/// Maximum length of a sequence of choices that has facts.
const MAX_CHOICES: usize = 5;

impl Abstract {
    /// Adds the fact that a word is one of `values` on the current path. Returns false if this is impossible:
    /// the path is unreachable.
    pub(crate) fn narrow(&mut self, word: Word, values: &Values) -> bool {
        self.narrow_under(&[], word, values)
    }

    /// Like [`narrow`](Self::narrow), under these choices. Returns false if these choices are impossible.
    fn narrow_under(&mut self, choices: &[Choice], word: Word, values: &Values) -> bool {
        if word == Word::ANYTHING {
            return true;
        }
        if word.is_constant() {
            return values.contains(word.offset);
        }
        let symbol = Word { offset: 0, ..word };
        let before = self.values_under(symbol, choices);
        let shift = word.offset.wrapping_neg();
        let (low, high) = (values.low().wrapping_add(shift), values.high().wrapping_add(shift));
        let now = if low <= high || values.count() <= MAX_SET as u64 {
            before.intersection(&values.add(&Values::one(shift)))
        } else {
            // The symbol keeps both ends of its range.
            match (before.limit(low, u32::MAX), before.limit(0, high)) {
                (Some(upper), Some(lower)) => Some(upper.union(&lower)),
                (upper, lower) => upper.or(lower),
            }
        };
        match now {
            None => false,
            Some(now) if now == before => true,
            Some(now) => {
                Rc::make_mut(&mut self.facts.at_mut(choices).values).insert(word.symbol, now);
                self.follow(choices, symbol, &now)
            }
        }
    }

    /// Derives facts about other words from a symbol that is one of `now`.
    fn follow(&mut self, choices: &[Choice], symbol: Word, now: &Values) -> bool {
        match self.symbol(symbol.symbol).map(|symbol| &symbol.origin) {
            Some(Origin::Derived(source, function)) => {
                let (source, function) = (*source, *function);
                let before = self.values_under(source, choices);
                let sources = before.retain(|number| now.contains(function.at(number)));
                let Some(mut sources) = sources else { return false };
                if let Some(known) = function.source(now) {
                    let Some(both) = sources.intersection(&known) else { return false };
                    sources = both;
                }
                self.narrow_under(choices, source, &sources)
            }
            Some(Origin::Joined(joined)) => {
                let Joined { join, left, right } = **joined;
                match self.side_under(join, choices) {
                    Some(true) => self.narrow_under(choices, right.word, now),
                    Some(false) => self.narrow_under(choices, left.word, now),
                    None => {
                        let left = self.can_be(choices, (join, false), left, now);
                        let right = self.can_be(choices, (join, true), right, now);
                        match (left, right) {
                            (true, true) => true,
                            (false, false) => false,
                            (_, is_right) => self.choose(choices, (join, is_right)),
                        }
                    }
                }
            }
            _ => true,
        }
    }

    /// Whether a symbol can be one of `now` under one more choice. Adds the resulting facts under that
    /// choice.
    fn can_be(&mut self, choices: &[Choice], choice: Choice, side: Side, now: &Values) -> bool {
        let Some(both) = side.values.intersection(now) else { return false };
        if choices.len() >= MAX_CHOICES {
            return true;
        }
        let choices = [choices, &[choice]].concat();
        self.narrow_under(&choices, side.word, &both)
    }

    /// Adds the path taken to a merge: facts under that choice now hold unconditionally.
    fn choose(&mut self, choices: &[Choice], (join, is_right): Choice) -> bool {
        if let Some(chosen) = self.side_under(join, choices) {
            return chosen == is_right;
        }
        let facts = self.facts.at_mut(choices);
        Rc::make_mut(&mut facts.sides).insert(join, is_right);
        let under = Rc::make_mut(&mut facts.under);
        under.remove(&(join, !is_right));
        let Some(known) = under.remove(&(join, is_right)) else { return true };
        for (choice, facts) in known.under.iter() {
            under.entry(*choice).or_insert_with(|| facts.clone());
        }
        known
            .values
            .iter()
            .all(|(symbol, values)| self.narrow_under(choices, Word { symbol: *symbol, offset: 0 }, values))
            && known.sides.iter().all(|(join, side)| self.choose(choices, (*join, *side)))
    }
}
