//! The blocks of a function, and the order in which to visit them.

mod order;

use std::collections::{BTreeMap, BTreeSet};

use crate::image::{Image, jump_table};
use crate::instruction::{Condition, Instruction, Operation, PC};

/// A sequence of instructions without jumps in between.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Block {
    /// Address after its last instruction.
    pub(crate) end: u32,
    /// Possible next blocks in the function; a call continues after its return.
    successors: Vec<u32>,
    /// Enclosing loops, outermost first: the place in the order and the head block of each.
    pub(crate) loops: Vec<(u32, u32)>,
    /// Place in the order.
    pub(crate) place: u32,
}

/// The blocks reachable from a function's entry. Every edge leads forward in the order, except edges back to
/// the head of a loop (a weak topological order, Bourdoncle 1993).
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct FlowGraph {
    pub(crate) entry: u32,
    pub(crate) blocks: BTreeMap<u32, Block>,
}

impl FlowGraph {
    /// Follows the jumps from the entry.
    pub(crate) fn of(image: &Image, entry: u32) -> Self {
        let mut begins = BTreeSet::from([entry]);
        let mut visited = BTreeSet::new();
        let mut waiting = vec![entry];
        while let Some(mut address) = waiting.pop() {
            while let Some(instruction) = image.code.get(&address) {
                if !visited.insert(address) {
                    break;
                }
                let Some(followers) = followers(image, entry, instruction) else {
                    address = instruction.next();
                    continue;
                };
                waiting.extend(&followers);
                begins.extend(followers);
                break;
            }
        }
        let block = |begin: &u32| (*begin, block(image, entry, *begin, &begins));
        let mut flow = Self { entry, blocks: begins.iter().map(block).collect() };
        flow.sort();
        flow
    }
}

fn block(image: &Image, entry: u32, begin: u32, begins: &BTreeSet<u32>) -> Block {
    let mut end = begin;
    let mut successors = Vec::new();
    while let Some(instruction) = image.code.get(&end) {
        end = instruction.next();
        if let Some(followers) = followers(image, entry, instruction) {
            successors = followers;
            break;
        }
        if begins.contains(&end) {
            successors.push(end);
            break;
        }
    }
    Block { end, successors, loops: Vec::new(), place: 0 }
}

/// Next addresses in the function after an instruction that ends a block; `None` if it does not end a block.
fn followers(image: &Image, entry: u32, instruction: &Instruction) -> Option<Vec<u32>> {
    let next = instruction.next();
    let is_conditional = instruction.condition != Condition::Always;
    let (mut targets, goes_on) = match instruction.operation {
        Operation::Branch { target } => (vec![target], is_conditional),
        Operation::CompareBranch { target, .. } => (vec![target], true),
        Operation::BranchLink { .. } | Operation::BranchLinkRegister { .. } => (Vec::new(), true),
        Operation::TableBranch { n, half, .. } => {
            (jump_table::targets(image, instruction.address, n, half), is_conditional)
        }
        Operation::Undefined(_) => (Vec::new(), is_conditional),
        _ if leaves(&instruction.operation) => (Vec::new(), is_conditional),
        _ if is_in(image, entry, next) => return None,
        _ => return Some(Vec::new()),
    };
    if goes_on {
        targets.push(next);
    }
    targets.retain(|target| is_in(image, entry, *target));
    targets.sort_unstable();
    targets.dedup();
    Some(targets)
}

/// Whether the instruction writes the program counter.
fn leaves(operation: &Operation) -> bool {
    match operation {
        Operation::BranchRegister { .. } => true,
        Operation::Move { d, .. } | Operation::Arithmetic { d: Some(d), .. } => *d == PC,
        Operation::Load { t, .. } => *t == PC,
        Operation::LoadMultiple { registers, .. } => registers >> PC & 1 == 1,
        _ => false,
    }
}

/// Whether an address is in the function with this `entry`.
fn is_in(image: &Image, entry: u32, address: u32) -> bool {
    let function = |address| image.function_at(address).map(|function| function.address);
    image.code.contains_key(&address) && function(entry) == function(address)
}
