//! A function that is being executed: where in it, and since when.

use std::rc::Rc;

use super::Key;
use crate::flow::FlowGraph;

/// A call that has not returned.
#[derive(Debug, Clone)]
pub(super) struct Frame {
    pub(super) call: Rc<Call>,
    /// The block that is executed or calls.
    pub(super) block: u32,
    /// Rounds of the loops around it, the outermost first.
    rounds: Vec<u32>,
    /// SP on any path since the call.
    pub(super) lowest: u32,
}

/// What does not change while a function runs.
#[derive(Debug)]
pub(super) struct Call {
    pub(super) flow: Rc<FlowGraph>,
    /// Key of the caller, then the function's entry.
    pub(super) key: Key,
    /// None for a jump to another function: that returns to where its caller would.
    pub(super) returns_to: Option<u32>,
    /// SP at the begin.
    pub(super) stack: u32,
}

impl Frame {
    pub(super) fn new(call: Call) -> Self {
        let (block, lowest) = (call.flow.entry, call.stack);
        let rounds = call.flow.blocks.get(&block).map_or(0, |block| block.loops.len());
        Self { call: Rc::new(call), block, rounds: vec![0; rounds], lowest }
    }

    /// Whether nothing of it has been executed.
    pub(super) fn is_new(&self) -> bool {
        self.block == self.call.flow.entry && self.rounds.iter().all(|round| *round == 0)
    }

    /// Goes on with a block; gives the round of the loop that it begins, if it does.
    pub(super) fn go_to(&mut self, target: u32) -> u32 {
        let blocks = &self.call.flow.blocks;
        let loops = |block: u32| blocks.get(&block).map_or([].as_slice(), |block| block.loops.as_slice());
        let (from, to) = (loops(self.block), loops(target));
        let mut rounds = Vec::with_capacity(to.len());
        let mut is_inside = true;
        for (place, (_, head)) in to.iter().enumerate() {
            is_inside &= from.get(place) == to.get(place);
            let round = self.rounds.get(place).copied().filter(|_| is_inside);
            rounds.push(match round {
                Some(round) if *head == target => round + 1,
                Some(round) => round,
                None => 0,
            });
        }
        let round = rounds.last().copied().unwrap_or(0);
        (self.block, self.rounds) = (target, rounds);
        round
    }

    /// Where it is, among all that can happen.
    pub(super) fn key(&self) -> Key {
        let mut key = self.call.key.clone();
        if let Some(block) = self.call.flow.blocks.get(&self.block) {
            for ((place, _), round) in block.loops.iter().zip(&self.rounds) {
                key.extend([*place, *round]);
            }
            key.push(block.place);
        }
        key
    }

    /// Either of two at the same place.
    pub(super) fn merge(&self, other: &Self) -> Self {
        Self { lowest: self.lowest.min(other.lowest), ..self.clone() }
    }
}
