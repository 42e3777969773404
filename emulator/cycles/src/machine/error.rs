//! Why a machine stops.

use crate::execute::ExecuteError;
use crate::instruction::Operation;
use crate::state::AccessError;

/// Why there is no machine, or no end of a call.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MachineError {
    /// The image does not say where its RAM is.
    #[error("the image has no symbol {name}, which says where its RAM is; link it with cortex-m-rt's link.x")]
    NoSymbol {
        /// The symbol.
        name: &'static str,
    },
    /// An instruction did what is not modelled.
    #[error("{place}: {stop}")]
    Stopped {
        /// Its address.
        address: u32,
        /// The function and the distance from its begin.
        place: String,
        /// What it did.
        stop: Stop,
    },
}

/// What a machine stops at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Stop {
    /// The program jumped to where the image has no instruction.
    #[error("no code is there")]
    NoCode,
    /// A jump to a word that says Arm code, which a Cortex-M does not have.
    #[error("a jump to {target:#010x}, which is no address of Thumb code")]
    NotThumb {
        /// The word.
        target: u32,
    },
    /// It needs a debugger, an operating system or an interrupt.
    #[error("{operation:?}, which asks for what is not there")]
    Trap {
        /// The operation.
        operation: Operation,
    },
    /// SP left the stack.
    #[error("stack overflow: SP {pointer:#010x} is below {lowest:#010x}")]
    StackOverflow {
        /// SP.
        pointer: u32,
        /// Where the stack ends.
        lowest: u32,
    },
    /// The call takes too long.
    #[error("no return after {instructions} instructions")]
    StepLimit {
        /// The limit.
        instructions: u64,
    },
    /// It cannot be executed.
    #[error(transparent)]
    Execute(#[from] ExecuteError),
}

impl From<AccessError> for Stop {
    fn from(error: AccessError) -> Self {
        Self::Execute(error.into())
    }
}
