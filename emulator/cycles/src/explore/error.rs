//! Errors of the worst-case analysis.

use crate::execute::ExecuteError;

/// The reason that no bound was found, and the location.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{place}{}: {reason}", called_from(callers))]
pub struct BoundError {
    /// Address of the instruction.
    pub address: u32,
    /// The function and the offset from its start.
    pub place: String,
    /// Calling blocks, innermost first.
    pub callers: Vec<String>,
    /// The reason.
    pub reason: Reason,
}

/// The reason that no bound was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Reason {
    /// An access to memory that is not known precisely enough, or an instruction that is not modelled.
    #[error(transparent)]
    Execute(#[from] ExecuteError),
    /// The program reaches an address without an instruction in the image.
    #[error("no code at this address")]
    NoCode,
    /// A jump with an unknown target.
    #[error("unknown jump target, between {lowest:#010x} and {highest:#010x}")]
    UnknownTarget {
        /// Minimum address.
        lowest: u32,
        /// Maximum address.
        highest: u32,
    },
    /// A function that calls itself, directly or indirectly.
    #[error("recursion: the function at {function:#010x} calls itself, directly or indirectly")]
    Recursion {
        /// Address of the function.
        function: u32,
    },
    /// A loop without a known bound.
    #[error("unbounded loop: no exit found within {rounds} iterations")]
    Unbounded {
        /// Number of explored iterations.
        rounds: u32,
    },
    /// A backward jump to a block that is not a loop head.
    #[error("irreducible control flow: a computed jump back to a block that is not a loop head")]
    Irreducible,
    /// The instruction requires a debugger, an operating system or an interrupt.
    #[error("trap: requires a debugger, an operating system or an interrupt")]
    Trap,
    /// The stack pointer is unknown.
    #[error("unknown stack pointer")]
    UnknownStack,
    /// Exploration takes too long.
    #[error("analysis stopped after {steps} instructions")]
    TooLong {
        /// Number of instructions.
        steps: u64,
    },
    /// No path leads to the return.
    #[error("the function never returns")]
    NoReturn,
    /// Memory does not converge over repeated calls.
    #[error("memory still changes after {rounds} rounds of calls, at {lowest:#010x} or above")]
    NotConverged {
        /// Number of rounds.
        rounds: u32,
        /// The lowest address that still changes.
        lowest: u32,
    },
}

fn called_from(callers: &[String]) -> String {
    callers.iter().map(|caller| format!(", called from {caller}")).collect()
}
