//! Errors that stop a machine.

use crate::execute::ExecuteError;
use crate::instruction::Operation;
use crate::state::AccessError;

/// Error in the creation of a machine or during a call.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MachineError {
    /// A symbol of the memory layout is missing.
    #[error("image without memory layout symbol {name}: link it with cortex-m-rt's link.x")]
    NoSymbol {
        /// The symbol.
        name: &'static str,
    },
    /// An instruction did something that is not modelled.
    #[error("{place}: {stop}")]
    Stopped {
        /// Address of the instruction.
        address: u32,
        /// The function and the offset from its start.
        place: String,
        /// The reason.
        stop: Stop,
    },
}

/// Reason that a machine stops.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Stop {
    /// The program jumped to an address without an instruction in the image.
    #[error("no code at this address")]
    NoCode,
    /// A jump to Arm code, which a Cortex-M does not support.
    #[error("jump to {target:#010x}, which is not a Thumb address (bit 0 is clear)")]
    NotThumb {
        /// Target of the jump.
        target: u32,
    },
    /// It requires a debugger, an operating system, an interrupt or an enabled float unit.
    #[error("{operation:?}: requires a debugger, an operating system, an interrupt or an enabled float unit")]
    Trap {
        /// The operation.
        operation: Operation,
    },
    /// SP left the stack.
    #[error("stack overflow: SP {pointer:#010x} is below {lowest:#010x}")]
    StackOverflow {
        /// SP.
        pointer: u32,
        /// The lowest valid SP.
        lowest: u32,
    },
    /// The call takes too long.
    #[error("the function has not returned after {instructions} instructions")]
    StepLimit {
        /// The limit.
        instructions: u64,
    },
    /// The instruction cannot be executed.
    #[error(transparent)]
    Execute(#[from] ExecuteError),
}

impl From<AccessError> for Stop {
    fn from(error: AccessError) -> Self {
        Self::Execute(error.into())
    }
}
