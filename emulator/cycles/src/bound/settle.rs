//! The worst case of repeated calls.

use std::collections::BTreeMap;
use std::ops::Range;

use super::{Bound, BoundError, BoundRequest, unknown_words};
use crate::abstraction::{Abstract, AbstractMemory, Facts, Join};
use crate::explore::{Reason, explore};
use crate::instruction::Width;
use crate::values::Values;

/// Maximum number of rounds.
const MAX_ROUNDS: u32 = 60;

/// All calls, once.
pub(super) struct Round {
    bounds: Vec<Bound>,
    /// Memory and facts before each call.
    before: Vec<(AbstractMemory, Facts)>,
    memory: AbstractMemory,
    facts: Facts,
    /// Maximum stack of any call.
    stack_bytes: u32,
}

impl Round {
    /// Bounds of all calls.
    pub(super) fn bounds(self, domain: &mut Abstract) -> Vec<Bound> {
        let bound = |(bound, (memory, facts))| {
            domain.facts = facts;
            Bound { unknown: unknown_words(domain, &memory), ..bound }
        };
        self.bounds.into_iter().zip(self.before).map(bound).collect()
    }
}

pub(super) fn round(
    question: &BoundRequest<'_>,
    domain: &mut Abstract,
    memory: AbstractMemory,
) -> Result<Round, BoundError> {
    let facts = Facts::default();
    let mut round = Round { bounds: Vec::new(), before: Vec::new(), memory, facts, stack_bytes: 0 };
    for call in question.calls {
        domain.facts = round.facts.clone();
        for input in &call.inputs {
            let values = Values::between(*input.values.start(), *input.values.end());
            round.memory.forget(domain, input.addresses.clone(), input.width, &values);
        }
        round.before.push((round.memory.clone(), round.facts.clone()));
        let found = explore(&question.start(call), domain, round.memory.clone(), round.facts.clone())?;
        round.bounds.push(Bound::new(&found));
        round.stack_bytes = round.stack_bytes.max(found.stack_bytes);
        if call.is_optional {
            let mut join = Join::new(domain, &round.facts, &found.facts);
            let memory = join.memory(&round.memory, &found.memory);
            let facts = join.facts();
            (round.memory, round.facts) = (memory, facts);
        } else {
            (round.memory, round.facts) = (found.memory, found.facts);
        }
    }
    Ok(round)
}

/// Repeats the calls until memory converges. Each round starts with the union of memory before and after the
/// last round.
pub(super) fn settle(question: &BoundRequest<'_>) -> Result<Vec<Bound>, BoundError> {
    let mut domain = Abstract::default();
    let mut memory = question.start_memory();
    let inputs = question.calls.iter().flat_map(|call| &call.inputs);
    let mut given = merged(inputs.map(|input| input.addresses.clone()).collect());
    let mut growths = BTreeMap::new();
    let mut number = 1;
    loop {
        let found = round(question, &mut domain, memory.clone())?;
        let facts = Facts::default();
        let mut after = Join::new(&mut domain, &facts, &found.facts).memory(&memory, &found.memory);
        domain.facts = facts;
        let change = memory.first_change(&domain, &after, &given);
        // In the first round, the inputs and the memory below the stack are not yet unknown.
        let Some(lowest) = change.or((number == 1).then_some(0)) else {
            let bounds = found.bounds(&mut domain).into_iter();
            return Ok(bounds.map(|bound| Bound { rounds: number, ..bound }).collect());
        };
        if number == MAX_ROUNDS {
            let address = question.calls.first().map_or(0, |call| call.function);
            let reason = Reason::NotConverged { rounds: number, lowest };
            let place = question.image.location(address);
            return Err(BoundError { address, place, callers: Vec::new(), reason });
        }
        after = after.widen(&mut domain, &mut growths);
        // Memory below SP is unknown at the start of a call: anything may have written it since the last
        // call.
        given.push(question.stack_top - found.stack_bytes..question.stack_top);
        given = merged(given);
        for range in given.iter().cloned() {
            after.forget(&mut domain, range, Width::Byte, &Values::between(0, 0xFF));
        }
        memory = after;
        number += 1;
    }
}

/// Merges overlapping ranges: every byte of memory is looked up in the ranges, and calls share inputs.
fn merged(mut ranges: Vec<Range<u32>>) -> Vec<Range<u32>> {
    ranges.sort_by_key(|range| range.start);
    let mut all: Vec<Range<u32>> = Vec::new();
    for range in ranges {
        match all.last_mut().filter(|last| range.start <= last.end) {
            Some(last) => last.end = last.end.max(range.end),
            None => all.push(range),
        }
    }
    all
}
