//! Stack use of an image: the sum of every interrupt level at its maximum depth.
//!
//! ```text
//! program ◀─ 8 or 26 words ─ interrupt of low priority ◀─ 8 or 26 words ─ ... ◀─ interrupt of high priority
//! ```
//!
//! An interrupt saves 8 words, or 26 if the interrupted code uses floats (their space is reserved even with
//! lazy stacking), and up to 4 bytes to align the stack to 8 (Armv7-M Architecture Reference Manual, B1.5.7).

mod depths;
mod vectors;

use core::cmp::Reverse;
use std::collections::BTreeMap;

use self::depths::Depths;
use crate::declarations::CallDeclarations;
use crate::graph::{Graph, GraphError};
use crate::image::Image;

const FRAME_BYTES: u32 = 8 * 4 + 4;
const FLOAT_FRAME_BYTES: u32 = 26 * 4 + 4;

/// The stack of an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StackBound {
    /// The deepest stack: the program, followed by the interrupts above it, the most urgent last.
    pub levels: Vec<Level>,
    /// Total bytes, including the frames saved by interrupts.
    pub bytes: u32,
    /// Bytes of stack that the linker reserved.
    pub available_bytes: u32,
}

/// A priority level.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Level {
    /// Priority, a smaller number is more urgent; `None` for the program.
    pub priority: Option<i16>,
    /// The deepest handler, or the program's entry.
    pub handler: String,
    /// Bytes saved when it interrupts the level below.
    pub context_bytes: u32,
    /// Bytes of the handler itself.
    pub bytes: u32,
    /// Whether it resets the stack pointer to the top of the stack: its bytes then do not add to the other
    /// levels.
    pub restarts_stack: bool,
    /// Its deepest call chain: functions, each with its bytes on the stack.
    pub chain: Vec<(String, u32)>,
}

/// Reason that the stack cannot be bounded.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StackError {
    /// Calls cannot be followed.
    #[error(transparent)]
    Graph(#[from] GraphError),
    /// A function calls itself.
    #[error("recursion: {}; declare how often the function can nest (`at most N NAME`)", .chain.join(" -> "))]
    Recursion {
        /// The functions in call order; the last entry repeats the first.
        chain: Vec<String>,
    },
    /// A linker's symbol is missing.
    #[error("the image has no symbol '{name}'")]
    NoSymbol {
        /// Name of the symbol.
        name: &'static str,
    },
    /// The priority of an interrupt is unknown.
    #[error("unknown priority of interrupt handler {handler}: declare its priority")]
    NoPriority {
        /// Name of the handler.
        handler: String,
    },
    /// An entry of the vector table does not point to a function.
    #[error("vector {vector} points to {address:#010x}, where no function starts")]
    NoHandler {
        /// Index in the vector table.
        vector: usize,
        /// The entry.
        address: u32,
    },
    /// A declared function is missing.
    #[error("no function in the image matches the declaration '{name}': correct the declaration")]
    Unmatched {
        /// Name of the function.
        name: String,
    },
}

/// Bounds the stack of an image with these interrupt priorities, by handler name.
///
/// # Errors
/// [`StackError`]. A stack that is too small is not an error: see [`StackBound::available_bytes`].
pub fn bound(
    image: &Image,
    declared: &CallDeclarations,
    priorities: &[(&str, i16)],
) -> Result<StackBound, StackError> {
    let graph = Graph::new(image, declared);
    for name in declared.last.iter().chain(&declared.early) {
        if !image.functions.values().any(|function| name.matches(function)) {
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
    levels.iter().map(|level| level.context_bytes + if level.restarts_stack { 0 } else { level.bytes }).sum()
}

/// Maximum bytes of the levels that reset the stack pointer.
fn alone(levels: &[Level]) -> u32 {
    levels.iter().filter(|level| level.restarts_stack).map(|level| level.bytes).max().unwrap_or(0)
}

/// Phase of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// The early functions run; late handlers do nothing.
    Early,
    /// The rest of the program.
    Later,
}

/// One phase of a program.
struct Stack<'g, 'a> {
    graph: &'g Graph<'a>,
    phase: Phase,
}

impl Stack<'_, '_> {
    /// The deepest stack of this phase.
    fn deepest(&self, handlers: &[(Option<i16>, u32)]) -> Result<Vec<Level>, StackError> {
        let mut by_priority: BTreeMap<Option<Reverse<i16>>, Vec<u32>> = BTreeMap::new();
        for (priority, handler) in handlers {
            by_priority.entry(priority.map(Reverse)).or_default().push(*handler);
        }
        // For each level, the deepest stack up to it that higher levels can still interrupt.
        let mut below: Vec<Level> = Vec::new();
        let mut deepest: Vec<Level> = Vec::new();
        let [mut context_bytes, mut max_saved_bytes] = [0; 2];
        for (priority, handlers) in by_priority {
            let handlers: Vec<u32> = handlers.into_iter().filter(|handler| self.runs(*handler)).collect();
            let [mut top, mut level] = [None::<Level>, None::<Level>];
            let mut uses_floats = false;
            for handler in handlers {
                for (is_last, kept) in [(true, &mut top), (false, &mut level)] {
                    let (found, floats) = self.level(priority, handler, context_bytes, is_last)?;
                    uses_floats |= floats;
                    if kept.as_ref().is_none_or(|kept| kept.bytes < found.bytes) {
                        *kept = Some(found);
                    }
                }
            }
            let (Some(top), Some(level)) = (top, level) else { continue };
            let is_fixed = priority.is_some_and(|Reverse(priority)| priority < 0);
            if is_fixed {
                // It can interrupt any level, including code that masks interrupts.
                deepest.push(Level { context_bytes: max_saved_bytes, ..top });
            } else {
                let with_top: Vec<Level> = below.iter().cloned().chain([top]).collect();
                if sum(&with_top) >= sum(&deepest) {
                    deepest = with_top;
                }
                below.push(level);
            }
            // In a handler, the float registers are not in use before its first float instruction (B1.5.7).
            context_bytes = if uses_floats { FLOAT_FRAME_BYTES } else { FRAME_BYTES };
            max_saved_bytes = max_saved_bytes.max(context_bytes);
        }
        Ok(deepest)
    }

    /// Whether a handler does anything in this phase.
    fn runs(&self, handler: u32) -> bool {
        let mut late = self.graph.declared.late.iter();
        self.phase == Phase::Later || !late.any(|name| self.graph.has_name(handler, name))
    }

    /// A handler, and whether it uses floats. `is_last` includes the callees of `last` functions, which
    /// nothing interrupts. The frames of the `last` functions themselves always count: they mask interrupts
    /// only after their start.
    fn level(
        &self,
        priority: Option<Reverse<i16>>,
        handler: u32,
        context_bytes: u32,
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
            handler: self.graph.image().location(handler),
            context_bytes,
            bytes,
            restarts_stack: self.graph.frames.of(handler).map_err(GraphError::from)?.restarts_stack,
            chain: depths.chain(),
        };
        // Float registers stay in use after their first use, even if that was in functions left out here.
        let mut uses_floats = false;
        for function in self.graph.reached(handler)?.into_keys() {
            uses_floats |= self.graph.frames.of(function).map_err(GraphError::from)?.uses_floats;
        }
        Ok((level, uses_floats))
    }
}
