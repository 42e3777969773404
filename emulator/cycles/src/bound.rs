//! The worst case of a function: cycles and stack that no run exceeds.

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

/// Memory that a program writes, as it is before a call: addresses and contents.
#[derive(Debug, Clone, Default)]
pub struct Snapshot {
    regions: Vec<Region>,
}

impl Snapshot {
    /// Of pieces of memory; an address must be divisible by 4.
    pub fn new<'a>(regions: impl IntoIterator<Item = (u32, &'a [u8])>) -> Self {
        let region = |(address, bytes): (u32, &[u8])| Region { address, bytes: Rc::new(bytes.to_vec()) };
        Self { regions: regions.into_iter().map(region).collect() }
    }
}

impl From<&Machine> for Snapshot {
    fn from(machine: &Machine) -> Self {
        Self::new(machine.writable())
    }
}

/// Memory that holds another value in every call.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Input {
    /// Where.
    pub addresses: Range<u32>,
    /// How wide one value is.
    pub width: Width,
    /// What each value can be.
    pub values: RangeInclusive<u32>,
}

impl Input {
    /// Memory of which nothing is known.
    #[must_use]
    pub fn any(addresses: Range<u32>) -> Self {
        Self { addresses, width: Width::Byte, values: 0..=0xFF }
    }

    /// Words that can be anything.
    #[must_use]
    pub fn words(addresses: Range<u32>) -> Self {
        Self { addresses, width: Width::Word, values: 0..=u32::MAX }
    }
}

/// A function that is called.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Call {
    /// Its address.
    pub function: u32,
    /// R0 to R3: what each can be.
    pub arguments: [RangeInclusive<u32>; 4],
    /// What is not known of the memory before; a later one goes over an earlier one.
    pub inputs: Vec<Input>,
    /// Whether it may be left out.
    pub is_optional: bool,
}

impl Call {
    /// A call that takes place, with these arguments.
    #[must_use]
    pub fn new(function: u32, arguments: [u32; 4]) -> Self {
        let arguments = arguments.map(|argument| argument..=argument);
        Self { function, arguments, inputs: Vec::new(), is_optional: false }
    }
}

/// What is to be bounded.
#[derive(Debug, Clone)]
pub struct Question<'a> {
    /// The program.
    pub image: &'a Image,
    /// The cycles of its instructions.
    pub timing: &'a Timing,
    /// Memory before the first call.
    pub memory: &'a Snapshot,
    /// SP before each call.
    pub stack_top: u32,
    /// Calls, one after the other.
    pub calls: &'a [Call],
    /// Addresses of functions whose calls are bounded, too.
    pub marked: &'a BTreeSet<u32>,
}

/// The worst case of a call of a marked function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CallBound {
    /// Its address.
    pub function: u32,
    /// Cycles from its first instruction to its return, that included.
    pub cycles: u64,
    /// Bytes of stack that it and what it calls reserve.
    pub stack_bytes: u32,
}

/// The worst case of a call.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bound {
    /// Cycles from the first instruction to the return, that included.
    pub cycles: u64,
    /// Bytes of stack.
    pub stack_bytes: u32,
    /// Every call of a marked function that there can be, in order.
    pub calls: Vec<CallBound>,
    /// Cycles that the longest path spends in each function, without those that it calls; by address.
    pub shares: BTreeMap<u32, u64>,
    /// Blocks of the longest path: address and cycles.
    pub path: Vec<(u32, u64)>,
    /// Addresses of all instructions that can be executed, as far as is known.
    pub visited: BTreeSet<u32>,
    /// Words of memory of which more than one value was possible before the call: address, smallest, greatest.
    pub unknown: Vec<(u32, u32, u32)>,
    /// How often the calls were followed until memory was like before them.
    pub rounds: u32,
}

impl Bound {
    /// Bounds each call of the question, made once.
    ///
    /// # Errors
    /// [`BoundError`] where a path cannot be followed.
    pub fn of_once(question: &Question<'_>) -> Result<Vec<Self>, BoundError> {
        let mut domain = Abstract::default();
        let memory = question.start_memory();
        let round = settle::round(question, &mut domain, memory)?;
        Ok(round.bounds(&mut domain))
    }

    /// Bounds each call of the question when all of them are made again and again, any number of times and each time
    /// with other inputs: what the calls leave behind in memory is there before the next ones.
    ///
    /// # Errors
    /// [`BoundError`] where a path cannot be followed, or when memory goes on changing.
    pub fn of_every(question: &Question<'_>) -> Result<Vec<Self>, BoundError> {
        settle::settle(question)
    }

    fn new(found: &Found) -> Self {
        let mut shares = BTreeMap::new();
        for (function, _, cycles) in &found.path {
            *shares.entry(*function).or_default() += cycles;
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
            shares,
            path: found.path.iter().map(|(_, block, cycles)| (*block, *cycles)).collect(),
            visited: found.visited.clone(),
            unknown: Vec::new(),
            rounds: 1,
        }
    }
}

impl Question<'_> {
    fn start<'a>(&'a self, call: &Call) -> Start<'a> {
        let Self { image, timing, stack_top, marked, .. } = *self;
        let arguments = call.arguments.clone().map(|range| Values::between(*range.start(), *range.end()));
        Start { image, timing, function: call.function, arguments, stack_top, marked }
    }

    fn start_memory(&self) -> AbstractMemory {
        let segments = self.image.segments.iter().flat_map(|segment| {
            let bytes = Rc::new(segment.bytes.clone());
            let in_place = (!segment.is_writable).then_some(segment.address);
            let flashed = (segment.flashed_at != segment.address).then_some(segment.flashed_at);
            in_place
                .into_iter()
                .chain(flashed)
                .map(move |address| Region { address, bytes: Rc::clone(&bytes) })
        });
        AbstractMemory::new(segments.collect(), &self.memory.regions)
    }
}

/// Words that can be more than one number.
fn unknown_words(domain: &mut Abstract, memory: &AbstractMemory) -> Vec<(u32, u32, u32)> {
    let words = memory.words(domain);
    let values = words.into_iter().map(|(address, word)| (address, domain.values(word)));
    values
        .filter(|(_, values)| values.single().is_none())
        .map(|(at, all)| (at, all.low(), all.high()))
        .collect()
}
