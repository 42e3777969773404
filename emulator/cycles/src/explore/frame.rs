//! A function in execution: the current position and the loop iterations.

use std::rc::Rc;

use super::Key;
use crate::flow::FlowGraph;

/// An active call.
#[derive(Debug, Clone)]
pub(super) struct Frame {
    pub(super) call: Rc<Call>,
    /// The block that executes or calls.
    pub(super) block: u32,
    /// Iteration numbers of the enclosing loops, outermost first.
    rounds: Vec<u32>,
    /// Lowest SP on any path since the call.
    pub(super) lowest: u32,
}

/// Properties that stay constant during a call.
#[derive(Debug)]
pub(super) struct Call {
    pub(super) flow: Rc<FlowGraph>,
    /// Key of the caller, followed by the function's entry.
    pub(super) key: Key,
    /// Return address; `None` for a jump to another function, which returns to the caller of this function.
    pub(super) returns_to: Option<u32>,
    /// SP at the start.
    pub(super) stack: u32,
}

impl Frame {
    pub(super) fn new(call: Call) -> Self {
        let (block, lowest) = (call.flow.entry, call.stack);
        let rounds = call.flow.blocks.get(&block).map_or(0, |block| block.loops.len());
        Self { call: Rc::new(call), block, rounds: vec![0; rounds], lowest }
    }

    /// Whether no block has executed yet.
    pub(super) fn is_new(&self) -> bool {
        self.block == self.call.flow.entry && self.rounds.iter().all(|round| *round == 0)
    }

    /// Moves to a block. Returns the iteration number of the loop that starts there, if any.
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

    /// The position in program order.
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

    /// The frame that covers both frames at the same position.
    pub(super) fn merge(&self, other: &Self) -> Self {
        Self { lowest: self.lowest.min(other.lowest), ..self.clone() }
    }
}
