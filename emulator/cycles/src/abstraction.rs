//! Words of which it is known only what they can be.
//!
//! A word is a *symbol* plus a number. A symbol stands for one value that the program has somewhere on its way (an
//! input, a result, what a place in memory holds where two paths meet); each has the [`Values`] that it can have on
//! any path. What a branch taken says of a symbol is a *fact* of that path: it holds for every copy of the symbol in
//! registers and memory, and for what was computed from it. Where paths meet again, facts that both know are kept.

mod domain;
mod facts;
mod flags;
mod join;
mod memory;
mod narrow;
mod symbol;
#[cfg(test)]
mod tests;

pub(crate) use domain::Bit;
pub(crate) use facts::Facts;
pub(crate) use join::Join;
pub(crate) use memory::{AbstractMemory, Region};
pub(crate) use symbol::Word;

use std::collections::{BTreeSet, HashMap};

use crate::values::Values;
use symbol::{Joined, Origin, Side, Symbol};

/// The domain of words that are known in part, and what is known of them on the present path.
#[derive(Debug)]
pub(crate) struct Abstract {
    symbols: Vec<Symbol>,
    /// Places where two paths met.
    joins: u32,
    /// What was computed from one word, by that word and the function's name.
    derived: HashMap<(Word, (u8, u32)), Word>,
    /// Numbers that words were compared with: where a growing one may come to rest.
    pub(crate) thresholds: BTreeSet<u32>,
    pub(crate) facts: Facts,
}

impl Default for Abstract {
    fn default() -> Self {
        let symbol = |values| Symbol { values, origin: Origin::Given };
        Self {
            symbols: vec![symbol(Values::one(0)), symbol(Values::ALL)],
            joins: 0,
            derived: HashMap::new(),
            thresholds: BTreeSet::new(),
            facts: Facts::default(),
        }
    }
}

impl Abstract {
    /// What a word can be on the present path.
    pub(crate) fn values(&self, word: Word) -> Values {
        self.values_by(word, &self.facts)
    }

    /// A word that can be any of these.
    pub(crate) fn unknown(&mut self, values: Values) -> Word {
        self.new_symbol(values, Origin::Given)
    }

    /// A word that is one or the other, by the path that was taken to the place where they met.
    fn joined(&mut self, join: u32, [left, right]: [Side; 2]) -> Word {
        if left.word == right.word {
            return left.word;
        }
        self.new_symbol(
            left.values.union(&right.values),
            Origin::Joined(Box::new(Joined { join, left, right })),
        )
    }

    fn new_symbol(&mut self, values: Values, origin: Origin) -> Word {
        if let Some(number) = values.single() {
            return Word::constant(number);
        }
        let number = u32::try_from(self.symbols.len()).unwrap_or(u32::MAX);
        self.symbols.push(Symbol { values, origin });
        Word { symbol: number, offset: 0 }
    }
}
