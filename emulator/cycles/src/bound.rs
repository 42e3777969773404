//! Upper bounds on the cycles and the stack of a function.

mod settle;

use std::collections::{BTreeMap, BTreeSet};
use std::ops::{Range, RangeInclusive};
use std::rc::Rc;

use crate::abstraction::{Abstract, AbstractMemory, Region};
use crate::explore::{Found, Start};
use crate::image::Image;
use crate::instruction::Width;
use crate::machine::Machine;
use crate::timing::Timing;
use crate::values::Values;

pub use crate::explore::{BoundError, Reason};

/// Contents of writable memory before a call: addresses and bytes.
#[derive(Debug, Clone, Default)]
pub struct Snapshot {
    regions: Vec<Region>,
}

impl Snapshot {
    /// Snapshot of these regions; each address must be divisible by 4.
    pub fn new<'a>(regions: impl IntoIterator<Item = (u32, &'a [u8])>) -> Self {
        let region = |(address, bytes): (u32, &[u8])| Region { address, bytes: Rc::new(bytes.to_vec()) };
        Self { regions: regions.into_iter().map(region).collect() }
    }
}

impl From<&Machine> for Snapshot {
    fn from(machine: &Machine) -> Self {
        Self::new(machine.writable_memory())
    }
}

/// Memory with a different value in every call.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Input {
    /// Addresses.
    pub addresses: Range<u32>,
    /// Width of each value.
    pub width: Width,
    /// Possible values.
    pub values: RangeInclusive<u32>,
}

impl Input {
    /// Completely unknown memory.
    #[must_use]
    pub fn unknown_memory(addresses: Range<u32>) -> Self {
        Self { addresses, width: Width::Byte, values: 0..=0xFF }
    }

    /// Unknown words.
    #[must_use]
    pub fn words(addresses: Range<u32>) -> Self {
        Self { addresses, width: Width::Word, values: 0..=u32::MAX }
    }
}

/// A function call.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Call {
    /// Address of the function.
    pub function: u32,
    /// Possible values of R0 to R3.
    pub arguments: [RangeInclusive<u32>; 4],
    /// Unknown memory before the call; later inputs override earlier ones.
    pub inputs: Vec<Input>,
    /// Whether the call may be omitted.
    pub is_optional: bool,
}

impl Call {
    /// A mandatory call with these arguments.
    #[must_use]
    pub fn new(function: u32, arguments: [u32; 4]) -> Self {
        let arguments = arguments.map(|argument| argument..=argument);
        Self { function, arguments, inputs: Vec::new(), is_optional: false }
    }
}

/// The input of the analysis.
#[derive(Debug, Clone)]
pub struct BoundRequest<'a> {
    /// The program.
    pub image: &'a Image,
    /// Timing model of its instructions.
    pub timing: &'a Timing,
    /// Memory before the first call.
    pub memory: &'a Snapshot,
    /// SP before each call.
    pub stack_top: u32,
    /// Sequence of calls.
    pub calls: &'a [Call],
    /// Addresses of functions whose calls are also bounded.
    pub marked: &'a BTreeSet<u32>,
}

/// Worst case of a call of a marked function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CallBound {
    /// Address of the function.
    pub function: u32,
    /// Cycles from the first instruction to the return, including the return.
    pub cycles: u64,
    /// Bytes of stack reserved by the function and its callees.
    pub stack_bytes: u32,
}

/// Worst case of a call.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bound {
    /// Cycles from the first instruction to the return, including the return.
    pub cycles: u64,
    /// Bytes of stack.
    pub stack_bytes: u32,
    /// Every possible call of a marked function, in order.
    pub calls: Vec<CallBound>,
    /// Cycles of the longest path in each function, without callees; by address.
    pub self_cycles: BTreeMap<u32, u64>,
    /// Blocks of the longest path: address and cycles.
    pub path: Vec<(u32, u64)>,
    /// Addresses of all reachable instructions, as far as known.
    pub visited: BTreeSet<u32>,
    /// Words of memory with several possible values before the call: address, minimum, maximum.
    pub unknown: Vec<(u32, u32, u32)>,
    /// Number of rounds of calls until the memory converged.
    pub rounds: u32,
}

impl Bound {
    /// Bounds each call for a single execution of the sequence.
    ///
    /// # Errors
    /// [`BoundError`] if a path cannot be followed.
    pub fn for_one_execution(question: &BoundRequest<'_>) -> Result<Vec<Self>, BoundError> {
        let mut domain = Abstract::default();
        let memory = question.start_memory();
        let round = settle::round(question, &mut domain, memory)?;
        Ok(round.bounds(&mut domain))
    }

    /// Bounds each call for any number of repetitions of the sequence, each with different inputs. Memory
    /// written by the calls persists into the next repetition.
    ///
    /// # Errors
    /// [`BoundError`] if a path cannot be followed or the memory does not converge.
    pub fn for_repeated_execution(question: &BoundRequest<'_>) -> Result<Vec<Self>, BoundError> {
        settle::settle(question)
    }

    fn new(found: &Found) -> Self {
        let mut self_cycles = BTreeMap::new();
        for (function, _, cycles) in &found.path {
            *self_cycles.entry(*function).or_default() += cycles;
        }
        let call = |region: &crate::explore::Region| CallBound {
            function: region.function,
            cycles: region.cycles,
            stack_bytes: region.stack_bytes,
        };
        Self {
            cycles: found.cycles,
            stack_bytes: found.stack_bytes,
            calls: found.regions.iter().map(call).collect(),
            self_cycles,
            path: found.path.iter().map(|(_, block, cycles)| (*block, *cycles)).collect(),
            visited: found.visited.clone(),
            unknown: Vec::new(),
            rounds: 1,
        }
    }
}

impl BoundRequest<'_> {
    fn start<'a>(&'a self, call: &Call) -> Start<'a> {
        let Self { image, timing, stack_top, marked, .. } = *self;
        let arguments = call.arguments.clone().map(|range| Values::between(*range.start(), *range.end()));
        Start { image, timing, function: call.function, arguments, stack_top, marked }
    }

    fn start_memory(&self) -> AbstractMemory {
        let segments = self.image.segments.iter().flat_map(|segment| {
            let bytes = Rc::new(segment.bytes.clone());
            let in_place = (!segment.is_writable).then_some(segment.address);
            let flashed = (segment.load_address != segment.address).then_some(segment.load_address);
            in_place
                .into_iter()
                .chain(flashed)
                .map(move |address| Region { address, bytes: Rc::clone(&bytes) })
        });
        AbstractMemory::new(segments.collect(), &self.memory.regions)
    }
}

/// Words with several possible values.
fn unknown_words(domain: &mut Abstract, memory: &AbstractMemory) -> Vec<(u32, u32, u32)> {
    let words = memory.words(domain);
    let values = words.into_iter().map(|(address, word)| (address, domain.values(word)));
    values
        .filter(|(_, values)| values.single().is_none())
        .map(|(at, all)| (at, all.low(), all.high()))
        .collect()
}
