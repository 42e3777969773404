//! What is learnt of a word, and what follows of others.

use std::rc::Rc;

use super::facts::Choice;
use super::symbol::{Joined, Origin, Side};
use super::{Abstract, Word};
use crate::values::{MAX_SET, Values};

/// Choices, one after the other, under which something is remembered.
const MAX_CHOICES: usize = 5;

impl Abstract {
    /// Takes note that a word is one of `values` on the present path. False when it cannot be: nobody takes this path.
    pub(crate) fn narrow(&mut self, word: Word, values: &Values) -> bool {
        self.narrow_under(&[], word, values)
    }

    /// As [`narrow`](Self::narrow), if these choices were made; false when they cannot have been.
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
            // Of the symbol, it is what is left at both ends of the numbers.
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

    /// What follows of other words when a symbol is one of `now`.
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

    /// Whether a symbol can be one of `now` if one more choice was made; takes note of what follows then.
    fn can_be(&mut self, choices: &[Choice], choice: Choice, side: Side, now: &Values) -> bool {
        let Some(both) = side.values.intersection(now) else { return false };
        if choices.len() >= MAX_CHOICES {
            return true;
        }
        let choices = [choices, &[choice]].concat();
        self.narrow_under(&choices, side.word, &both)
    }

    /// Takes note of which of two paths was taken: what was known in that case is known now.
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
