//! Explores all paths of a program at once: paths merge where they meet, and the longest path is kept.
//!
//! Waiting states are sorted by their position in program order: the active calls and, in each function, the
//! place of the block in the function's [order](crate::flow) with the iteration number of every enclosing
//! loop. Every step leads to a later position. All paths to a block are therefore known and merged before it
//! executes, loops unroll as far as their conditions allow, and the result is the longest path through an
//! acyclic graph.

mod error;
mod frame;
mod step;

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

pub use error::{BoundError, Reason};
use frame::Frame;

use crate::abstraction::{Abstract, AbstractMemory, Facts, Join, Word};
use crate::flow::FlowGraph;
use crate::image::Image;
use crate::instruction::{LR, SP};
use crate::state::Registers;
use crate::timing::{Pipeline, Timing};
use crate::values::Values;

/// Return address of the explored function: no memory is mapped there.
const RETURN: u32 = 0xF000_0000;
/// Maximum number of iterations of a loop; beyond it, the loop counts as unbounded.
const MAX_ROUNDS: u32 = 100_000;
/// Maximum number of instructions; beyond it, exploration stops.
const MAX_STEPS: u64 = 50_000_000;

/// A position in program order.
type Key = Vec<u32>;

/// The state before a block.
#[derive(Debug, Clone)]
struct State {
    registers: Registers<Abstract>,
    memory: AbstractMemory,
    facts: Facts,
    frames: Vec<Frame>,
    /// Cycles of the longest path to this state.
    cycles: u64,
    pipeline: Pipeline,
    /// The last block of the longest path.
    node: usize,
}

/// A block on a longest path.
#[derive(Debug, Clone, Copy)]
struct Node {
    before: usize,
    function: u32,
    block: u32,
    /// Cycles at its start.
    cycles: u64,
}

/// A call of a marked function, over all paths.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Region {
    pub(crate) function: u32,
    began: u64,
    pub(crate) cycles: u64,
    pub(crate) stack_bytes: u32,
}

/// The result of exploration.
#[derive(Debug)]
pub(crate) struct Found {
    pub(crate) cycles: u64,
    pub(crate) stack_bytes: u32,
    pub(crate) regions: Vec<Region>,
    /// Blocks of the longest path: function, address, cycles.
    pub(crate) path: Vec<(u32, u32, u64)>,
    pub(crate) visited: BTreeSet<u32>,
    /// Memory and facts at the end.
    pub(crate) memory: AbstractMemory,
    pub(crate) facts: Facts,
}

/// The initial state of a program.
pub(crate) struct Start<'a> {
    pub(crate) image: &'a Image,
    pub(crate) timing: &'a Timing,
    pub(crate) function: u32,
    pub(crate) arguments: [Values; 4],
    pub(crate) stack_top: u32,
    pub(crate) marked: &'a BTreeSet<u32>,
}

/// Explores a function from its first instruction to its return.
pub(crate) fn explore(
    start: &Start<'_>,
    domain: &mut Abstract,
    memory: AbstractMemory,
    facts: Facts,
) -> Result<Found, BoundError> {
    let mut registers = Registers::new(domain);
    for register in registers.core.iter_mut().chain(&mut registers.float) {
        *register = domain.unknown(Values::ALL);
    }
    for (register, argument) in (0..).zip(start.arguments) {
        registers.write(register, domain.unknown(argument));
    }
    registers.write(SP, constant(domain, start.stack_top));
    registers.write(LR, constant(domain, RETURN | 1));
    let state = State {
        registers,
        memory,
        facts,
        frames: Vec::new(),
        cycles: 0,
        pipeline: Pipeline::worst(),
        node: 0,
    };
    domain.facts = Facts::default();
    let mut explorer = Explorer {
        start,
        domain,
        flows: BTreeMap::new(),
        waiting: BTreeMap::new(),
        regions: BTreeMap::new(),
        nodes: vec![Node { before: 0, function: start.function, block: start.function, cycles: 0 }],
        visited: BTreeSet::new(),
        steps: 0,
        address: start.function,
        end: None,
    };
    explorer.call(state, start.function & !1, Some(RETURN))?;
    explorer.run()
}

fn constant(domain: &mut Abstract, number: u32) -> Word {
    crate::domain::Domain::constant(domain, number)
}

struct Explorer<'a> {
    start: &'a Start<'a>,
    domain: &'a mut Abstract,
    flows: BTreeMap<u32, Rc<FlowGraph>>,
    waiting: BTreeMap<Key, State>,
    regions: BTreeMap<Key, Region>,
    nodes: Vec<Node>,
    visited: BTreeSet<u32>,
    steps: u64,
    /// Address of the instruction in execution.
    address: u32,
    /// The state after the return, with the lowest SP.
    end: Option<(State, u32)>,
}

impl Explorer<'_> {
    fn run(mut self) -> Result<Found, BoundError> {
        while let Some((_, state)) = self.waiting.pop_first() {
            self.block(state)?;
        }
        let Some((state, lowest)) = self.end else {
            return Err(self.error(&[], Reason::NoReturn));
        };
        let mut path = Vec::new();
        let (mut at, mut until) = (state.node, state.cycles);
        while let Some(node) = self.nodes.get(at).filter(|_| at > 0) {
            path.push((node.function, node.block, until - node.cycles));
            (at, until) = (node.before, node.cycles);
        }
        path.reverse();
        Ok(Found {
            cycles: state.cycles,
            stack_bytes: self.start.stack_top - lowest,
            regions: self.regions.into_values().collect(),
            path,
            visited: self.visited,
            memory: state.memory,
            facts: state.facts,
        })
    }

    /// Queues a state. Merges it with a state that already waits at the same position.
    fn wait(&mut self, key: Key, state: State) {
        let state = match self.waiting.remove(&key) {
            Some(other) => self.merge(other, state),
            None => state,
        };
        self.waiting.insert(key, state);
    }

    /// The state that covers both states.
    fn merge(&mut self, left: State, right: State) -> State {
        let mut join = Join::new(self.domain, &left.facts, &right.facts);
        let registers = join.registers(&left.registers, &right.registers);
        let memory = join.memory(&left.memory, &right.memory);
        let facts = join.facts();
        let longer = if left.cycles >= right.cycles { &left } else { &right };
        let frames = left.frames.iter().zip(&right.frames).map(|(left, right)| left.merge(right));
        State {
            registers,
            memory,
            facts,
            frames: frames.collect(),
            cycles: longer.cycles,
            pipeline: left.pipeline.join(right.pipeline),
            node: longer.node,
        }
    }

    fn flow(&mut self, entry: u32) -> Rc<FlowGraph> {
        let image = self.start.image;
        Rc::clone(self.flows.entry(entry).or_insert_with(|| Rc::new(FlowGraph::of(image, entry))))
    }

    /// An error at the current instruction.
    fn error(&self, frames: &[Frame], reason: Reason) -> BoundError {
        let image = self.start.image;
        let callers = frames.iter().rev().skip(1).map(|frame| image.location(frame.block)).collect();
        BoundError { address: self.address, place: image.location(self.address), callers, reason }
    }
}
