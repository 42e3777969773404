//! How much stack an image takes: every interrupt at its deepest, one on top of the other.
//!
//! ```text
//! program ◀─ 8 or 26 words ─ interrupt of low priority ◀─ 8 or 26 words ─ ... ◀─ interrupt of high priority
//! ```
//!
//! An interrupt saves 8 words, 26 where the code below it uses floats (room for them is taken even when they are saved
//! late), and up to 4 bytes so that the stack is aligned to 8 (Armv7-M Architecture Reference Manual, B1.5.7).

mod depths;
mod vectors;

use core::cmp::Reverse;
use std::collections::BTreeMap;

use self::depths::Depths;
use crate::declared::Declared;
use crate::graph::{Graph, GraphError};
use crate::image::Image;

const FRAME_BYTES: u32 = 8 * 4 + 4;
const FLOAT_FRAME_BYTES: u32 = 26 * 4 + 4;

/// The stack of an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StackBound {
    /// What is on the stack at its deepest: the program, then what interrupts it, the most urgent last.
    pub levels: Vec<Level>,
    /// All of them on top of each other, with what interrupts save.
    pub bytes: u32,
    /// What the linker has left for it.
    pub available_bytes: u32,
}

/// One priority.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Level {
    /// Smaller is more urgent; none for the program.
    pub priority: Option<i16>,
    /// The handler that goes deepest, or the program's begin.
    pub handler: String,
    /// What is saved when it interrupts the level below it.
    pub saved_bytes: u32,
    /// Bytes that it takes itself.
    pub bytes: u32,
    /// Whether it begins a new stack at the stack's begin: its bytes are not on top of the others then.
    pub restarts_stack: bool,
    /// Its deepest chain of calls: functions, each with the bytes it has on the stack.
    pub chain: Vec<(String, u32)>,
}

/// Why there is no bound, or why it is not kept.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StackError {
    /// Calls cannot be followed.
    #[error(transparent)]
    Graph(#[from] GraphError),
    /// A function calls itself.
    #[error("recursion: {}; declare how often it can nest (`at most N NAME`)", .chain.join(" -> "))]
    Recursion {
        /// The functions, the first one again at the end.
        chain: Vec<String>,
    },
    /// A linker's symbol is missing.
    #[error("the image has no symbol '{name}'")]
    NoSymbol {
        /// Which.
        name: &'static str,
    },
    /// An interrupt's priority is not known.
    #[error("the priority of the interrupt handler {handler} is not declared")]
    NoPriority {
        /// Which.
        handler: String,
    },
    /// An entry of the vector table is no function.
    #[error("vector {vector} is {address:#010x}, where no function begins")]
    NoHandler {
        /// Place in the table.
        vector: usize,
        /// What stands there.
        address: u32,
    },
    /// A function that is declared is not there.
    #[error("no function of the image is '{name}', which is declared")]
    Unmatched {
        /// Its name.
        name: String,
    },
}

/// Bounds the stack of an image whose interrupts have these priorities, by their handlers' names.
///
/// # Errors
/// [`StackError`]. A stack that is too small is none: see [`StackBound::available_bytes`].
pub fn bound(
    image: &Image,
    declared: &Declared,
    priorities: &[(&str, i16)],
) -> Result<StackBound, StackError> {
    let graph = Graph::new(image, declared);
    for name in declared.last.iter().chain(&declared.early) {
        if !image.functions.values().any(|function| name.is_of(function)) {
            return Err(StackError::Unmatched { name: name.to_string() });
        }
    }
    let handlers = vectors::levels(image, priorities)?;
    let end = symbol(image, "_stack_end").or_else(|_| symbol(image, "__sheap"))?;
    let available_bytes = symbol(image, "_stack_start")?.saturating_sub(end);
    let phases = [Phase::Early, Phase::Later].map(|phase| Stack { graph: &graph, phase }.deepest(&handlers));
    let [early, later] = phases;
    let bytes = |levels: &[Level]| sum(levels).max(alone(levels));
    let levels = [early?, later?].into_iter().max_by_key(|levels| bytes(levels)).unwrap_or_default();
    Ok(StackBound { bytes: bytes(&levels), levels, available_bytes })
}

fn symbol(image: &Image, name: &'static str) -> Result<u32, StackError> {
    image.symbols.get(name).copied().ok_or(StackError::NoSymbol { name })
}

fn sum(levels: &[Level]) -> u32 {
    levels.iter().map(|level| level.saved_bytes + if level.restarts_stack { 0 } else { level.bytes }).sum()
}

/// Of those that begin a new stack.
fn alone(levels: &[Level]) -> u32 {
    levels.iter().filter(|level| level.restarts_stack).map(|level| level.bytes).max().unwrap_or(0)
}

/// What the program does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// What is declared to be early: the late handlers do not run.
    Early,
    /// The rest.
    Later,
}

/// One phase of a program.
struct Stack<'g, 'a> {
    graph: &'g Graph<'a>,
    phase: Phase,
}

impl Stack<'_, '_> {
    /// Everything that can be on the stack at once, at its deepest.
    fn deepest(&self, handlers: &[(Option<i16>, u32)]) -> Result<Vec<Level>, StackError> {
        let mut by_priority: BTreeMap<Option<Reverse<i16>>, Vec<u32>> = BTreeMap::new();
        for (priority, handler) in handlers {
            by_priority.entry(priority.map(Reverse)).or_default().push(*handler);
        }
        // Up to a level, each with what can be interrupted in turn.
        let mut below: Vec<Level> = Vec::new();
        let mut deepest: Vec<Level> = Vec::new();
        let [mut saved_bytes, mut max_saved_bytes] = [0; 2];
        for (priority, handlers) in by_priority {
            let handlers: Vec<u32> = handlers.into_iter().filter(|handler| self.runs(*handler)).collect();
            let [mut top, mut level] = [None::<Level>, None::<Level>];
            let mut uses_floats = false;
            for handler in handlers {
                for (is_last, kept) in [(true, &mut top), (false, &mut level)] {
                    let (found, floats) = self.level(priority, handler, saved_bytes, is_last)?;
                    uses_floats |= floats;
                    if kept.as_ref().is_none_or(|kept| kept.bytes < found.bytes) {
                        *kept = Some(found);
                    }
                }
            }
            let (Some(top), Some(level)) = (top, level) else { continue };
            let is_fixed = priority.is_some_and(|Reverse(priority)| priority < 0);
            if is_fixed {
                // It interrupts any of them, and what nothing else does.
                deepest.push(Level { saved_bytes: max_saved_bytes, ..top });
            } else {
                let with_top: Vec<Level> = below.iter().cloned().chain([top]).collect();
                if sum(&with_top) >= sum(&deepest) {
                    deepest = with_top;
                }
                below.push(level);
            }
            // In a handler floats are not in use before it uses them (B1.5.7).
            saved_bytes = if uses_floats { FLOAT_FRAME_BYTES } else { FRAME_BYTES };
            max_saved_bytes = max_saved_bytes.max(saved_bytes);
        }
        Ok(deepest)
    }

    /// Whether a handler does anything in this phase.
    fn runs(&self, handler: u32) -> bool {
        let mut late = self.graph.declared.late.iter();
        self.phase == Phase::Later || !late.any(|name| self.graph.has_name(handler, name))
    }

    /// A handler, with what functions call that nothing interrupts or without; and whether it uses floats. The frames of
    /// these functions are there in any case: interrupts are masked behind their begin.
    fn level(
        &self,
        priority: Option<Reverse<i16>>,
        handler: u32,
        saved_bytes: u32,
        is_last: bool,
    ) -> Result<(Level, bool), StackError> {
        let declared = self.graph.declared;
        let mut depths = Depths::new(self.graph, handler);
        if !is_last {
            depths.last = &declared.last;
        }
        if self.phase == Phase::Later && priority.is_none() {
            depths.left_out = &declared.early;
        }
        let bytes = depths.bytes()?;
        let level = Level {
            priority: priority.map(|Reverse(priority)| priority),
            handler: self.graph.image().place(handler),
            saved_bytes,
            bytes,
            restarts_stack: self.graph.frames.of(handler).map_err(GraphError::from)?.restarts_stack,
            chain: depths.chain(),
        };
        // Once used, the floats' registers are in use: also by what is left out here.
        let mut uses_floats = false;
        for function in self.graph.reached(handler)?.into_keys() {
            uses_floats |= self.graph.frames.of(function).map_err(GraphError::from)?.uses_floats;
        }
        Ok((level, uses_floats))
    }
}
