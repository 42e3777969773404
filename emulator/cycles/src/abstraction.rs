//! The domain of partially known words: each word has a set of possible values.
//!
//! A word is a *symbol* plus a number. A symbol represents one value of the program: an input, a result, or
//! the contents of a memory location where two paths merge. Each symbol has the [`Values`] that are possible
//! on any path. A branch condition adds a *fact* to its path: the fact holds for every copy of the symbol in
//! registers and memory, and for every word computed from it. A merge keeps the facts that hold on both
//! paths.

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

/// The domain of partially known words, with the facts of the current path.
#[derive(Debug)]
pub(crate) struct Abstract {
    symbols: Vec<Symbol>,
    /// Number of merges so far.
    joins: u32,
    /// Words derived from one word, by that word and the function's name.
    derived: HashMap<(Word, (u8, u32)), Word>,
    /// Numbers that words were compared with: candidates for the limit of a growing value.
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
    /// Possible values of a word on the current path.
    pub(crate) fn values(&self, word: Word) -> Values {
        self.values_by(word, &self.facts)
    }

    /// A new word with these possible values.
    pub(crate) fn unknown(&mut self, values: Values) -> Word {
        self.new_symbol(values, Origin::Given)
    }

    /// A word that is one of two, depending on the path taken to the merge.
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
