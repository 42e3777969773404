//! Why there is no bound.

use crate::execute::ExecuteError;

/// There is no bound, and where it fails.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{place}{}: {reason}", called_from(callers))]
pub struct BoundError {
    /// Address of the instruction.
    pub address: u32,
    /// The function and the distance from its begin.
    pub place: String,
    /// Blocks that called, the innermost first.
    pub callers: Vec<String>,
    /// What cannot be bounded.
    pub reason: Reason,
}

/// What cannot be bounded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Reason {
    /// An access to memory that is not known well enough, or an instruction that is not modelled.
    #[error(transparent)]
    Execute(#[from] ExecuteError),
    /// The program comes to where the image has no instruction.
    #[error("no code is there")]
    NoCode,
    /// A jump that can go anywhere.
    #[error("a jump to somewhere between {lowest:#010x} and {highest:#010x}: its target is not known")]
    UnknownTarget {
        /// The smallest address.
        lowest: u32,
        /// The greatest address.
        highest: u32,
    },
    /// A function that calls itself, maybe by way of others.
    #[error("recursion: the function at {function:#010x} is called while it runs")]
    Recursion {
        /// Its address.
        function: u32,
    },
    /// A loop whose end is not known.
    #[error("a loop without a known end: not decided after {rounds} rounds")]
    Unbounded {
        /// How far it was followed.
        rounds: u32,
    },
    /// A jump back to where no loop begins.
    #[error("a computed jump back, not to where a loop begins")]
    Irreducible,
    /// It needs a debugger, an operating system or an interrupt.
    #[error("a trap: it asks for what is not there")]
    Trap,
    /// SP is not known.
    #[error("the stack pointer is not known")]
    UnknownStack,
    /// Exploring takes too long.
    #[error("not done after {steps} instructions")]
    TooLong {
        /// How many.
        steps: u64,
    },
    /// No path leads to the return.
    #[error("it never returns")]
    NoReturn,
    /// What one call leaves behind for the next goes on changing.
    #[error("memory still changes after {rounds} calls, at {lowest:#010x} first")]
    Unsettled {
        /// Calls.
        rounds: u32,
        /// The lowest address of what changes.
        lowest: u32,
    },
}

fn called_from(callers: &[String]) -> String {
    callers.iter().map(|caller| format!(", called from {caller}")).collect()
}
