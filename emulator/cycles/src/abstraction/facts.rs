//! Facts about words on one path, and their consequences.

use std::collections::BTreeMap;
use std::rc::Rc;

use super::symbol::{Origin, Side, Symbol};
use super::{Abstract, Word};
use crate::values::Values;

/// The path taken to a merge: the number of the merge, and whether the right path was taken.
pub(super) type Choice = (u32, bool);

/// Facts about symbols on one path. Cheap to clone.
#[derive(Debug, Clone, Default)]
pub(crate) struct Facts {
    pub(super) values: Rc<BTreeMap<u32, Values>>,
    /// For each merge, whether the right path was taken.
    pub(super) sides: Rc<BTreeMap<u32, bool>>,
    /// Additional facts that hold under a choice.
    pub(super) under: Rc<BTreeMap<Choice, Self>>,
}

impl Facts {
    /// Facts that hold on both paths.
    pub(super) fn common(&self, other: &Self) -> Self {
        fn common<K: Ord + Copy, V: Clone>(
            [left, right]: [&Rc<BTreeMap<K, V>>; 2],
            both: impl Fn(&V, &V) -> Option<V>,
        ) -> Rc<BTreeMap<K, V>> {
            if Rc::ptr_eq(left, right) {
                return Rc::clone(left);
            }
            let both = left.iter().filter_map(|(key, value)| Some((*key, both(value, right.get(key)?)?)));
            Rc::new(both.collect())
        }
        Self {
            values: common([&self.values, &other.values], |left, right| Some(left.union(right))),
            sides: common([&self.sides, &other.sides], |left, right| (left == right).then_some(*left)),
            under: common([&self.under, &other.under], |left, right| Some(left.common(right))),
        }
    }

    /// Facts that hold under this sequence of choices.
    pub(super) fn at_mut(&mut self, choices: &[Choice]) -> &mut Self {
        match choices.split_first() {
            None => self,
            Some((first, rest)) => Rc::make_mut(&mut self.under).entry(*first).or_default().at_mut(rest),
        }
    }
}

/// Facts that hold together, the most recent first.
#[derive(Clone, Copy)]
pub(super) struct Context<'a> {
    facts: &'a Facts,
    outer: Option<&'a Context<'a>>,
}

impl<'a> Context<'a> {
    pub(super) fn new(facts: &'a Facts) -> Self {
        Self { facts, outer: None }
    }

    fn all(&'a self) -> impl Iterator<Item = &'a Facts> {
        std::iter::successors(Some(self), |context| context.outer).map(|context| context.facts)
    }

    fn side(&self, join: u32) -> Option<bool> {
        self.all().find_map(|facts| facts.sides.get(&join)).copied()
    }

    /// Calls `then` with the facts that also hold under these choices.
    pub(super) fn within<T>(&self, choices: &[Choice], then: &mut dyn FnMut(&Context<'_>) -> T) -> T {
        let Some((first, rest)) = choices.split_first() else { return then(self) };
        let facts: Vec<&Facts> = self.all().filter_map(|facts| facts.under.get(first)).collect();
        self.with(&facts, &mut |context| context.within(rest, then))
    }

    fn with<T>(&self, facts: &[&Facts], then: &mut dyn FnMut(&Context<'_>) -> T) -> T {
        match facts.split_first() {
            None => then(self),
            Some((first, rest)) => Context { facts: first, outer: Some(self) }.with(rest, then),
        }
    }
}

/// Maximum number of steps from a word back to its sources.
const DEPTH: u32 = 5;

impl Abstract {
    pub(super) fn values_by(&self, word: Word, facts: &Facts) -> Values {
        self.values_within(word, &Context::new(facts), DEPTH)
    }

    /// Possible values of a word under these choices.
    pub(super) fn values_under(&self, word: Word, choices: &[Choice]) -> Values {
        Context::new(&self.facts).within(choices, &mut |context| self.values_within(word, context, DEPTH))
    }

    /// The path taken to a merge, under these choices.
    pub(super) fn side_under(&self, join: u32, choices: &[Choice]) -> Option<bool> {
        let chosen = choices.iter().find(|(other, _)| *other == join).map(|(_, side)| *side);
        chosen.or_else(|| Context::new(&self.facts).within(choices, &mut |context| context.side(join)))
    }

    fn values_within(&self, word: Word, context: &Context<'_>, depth: u32) -> Values {
        if word.is_constant() {
            return Values::one(word.offset);
        }
        let Some(symbol) = self.symbol(word.symbol) else { return Values::ALL };
        let mut values = symbol.values;
        for known in context.all().filter_map(|facts| facts.values.get(&word.symbol)) {
            values = values.intersection(known).unwrap_or(values);
        }
        if depth > 0
            && let Some(known) = self.followed(symbol, context, depth - 1)
        {
            values = values.intersection(&known).unwrap_or(values);
        }
        if word.offset == 0 { values } else { values.add(&Values::one(word.offset)) }
    }

    /// Possible values of a symbol, derived from its origin.
    fn followed(&self, symbol: &Symbol, context: &Context<'_>, depth: u32) -> Option<Values> {
        match &symbol.origin {
            Origin::Derived(source, function) => {
                Some(function.image(&self.values_within(*source, context, depth)))
            }
            Origin::Joined(joined) => {
                let side = |side: &Side, is_right: bool| {
                    context.within(&[(joined.join, is_right)], &mut |context| {
                        side.values.intersection(&self.values_within(side.word, context, depth))
                    })
                };
                match context.side(joined.join) {
                    Some(true) => side(&joined.right, true),
                    Some(false) => side(&joined.left, false),
                    None => match (side(&joined.left, false), side(&joined.right, true)) {
                        (Some(left), Some(right)) => Some(left.union(&right)),
                        (left, right) => left.or(right),
                    },
                }
            }
            Origin::Given | Origin::Bytes(_) => None,
        }
    }

    pub(super) fn symbol(&self, number: u32) -> Option<&Symbol> {
        self.symbols.get(usize::try_from(number).unwrap_or(usize::MAX))
    }
}
