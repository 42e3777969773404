//! The stack use and the calls of a function, read from its code.
//!
//! Follows every path through a function and tracks the stack pointer, the registers that the function must
//! restore, and the addresses that it loads. Outlined code (`OUTLINED_FUNCTION_n`, a piece of a function that
//! the compiler moved elsewhere) counts as part of the function.

mod origin;
mod slots;
mod walk;

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use crate::execute::ExecuteError;
use crate::image::Image;
use crate::instruction::{Register, Undecoded};

/// Name prefixes of outlined pieces, and of the linker's thunks for pieces out of branch range.
const OUTLINED: [&str; 2] = ["OUTLINED_FUNCTION_", "__Thumbv7ABSLongThunk_OUTLINED_FUNCTION_"];

/// The analysis of one function.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Frame {
    /// Start address.
    pub address: u32,
    /// Maximum number of bytes that the function's own instructions put on the stack.
    pub own_bytes: u32,
    /// The same, including outlined pieces.
    pub bytes: u32,
    /// Calls, by the address of the instruction; conditional calls count.
    pub calls: BTreeMap<u32, Call>,
    /// Start addresses of its outlined pieces.
    pub outlined_pieces: BTreeSet<u32>,
    /// Whether it can return to its caller.
    pub returns: bool,
    /// Whether it has a float instruction: from then on, an interrupt also saves the float registers.
    pub uses_floats: bool,
    /// Whether it starts by resetting the stack pointer to the top of the stack, like a fault handler.
    pub restarts_stack: bool,
    /// Trapping instructions (`UDF`), for cases that the program assumes to be impossible.
    pub traps: BTreeSet<u32>,
    /// Square root instructions (`VSQRT`).
    pub square_roots: BTreeSet<u32>,
}

/// A call, or a jump to another function that returns in place of this function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Call {
    /// Bytes of this function on the stack at the call.
    pub depth_bytes: u32,
    /// Start address of the called function; `None` if the code does not contain it.
    pub callee: Option<u32>,
}

/// Reason that the analysis of a function failed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// The image has no code at this address.
    #[error("{place}: no instruction at this address; if this is code, give it a function symbol")]
    NoCode {
        /// Location.
        place: String,
    },
    /// An instruction is not modelled.
    #[error("{place}: {instruction}")]
    Undecoded {
        /// Location.
        place: String,
        /// The instruction.
        instruction: Undecoded,
    },
    /// An instruction is not modelled.
    #[error("{place}: {error}")]
    Unmodelled {
        /// Location.
        place: String,
        /// The error.
        error: ExecuteError,
    },
    /// The stack pointer is not its start value plus a known number of bytes.
    #[error("{place}: unknown stack pointer")]
    UnknownStackPointer {
        /// Location.
        place: String,
    },
    /// Two paths merge with different stack depths.
    #[error("{place}: paths merge with different stack depths: {bytes} and {other_bytes} bytes")]
    DepthMismatch {
        /// Location of the merge.
        place: String,
        /// Depth of one path.
        bytes: i64,
        /// Depth of the other path.
        other_bytes: i64,
    },
    /// It returns, or jumps to another function for good, at a stack depth other than its start depth.
    #[error("{place}: unbalanced stack: {bytes} bytes at the function's end")]
    Unbalanced {
        /// Location.
        place: String,
        /// Remaining bytes; negative if the function removed too many.
        bytes: i64,
    },
    /// It returns without restoring a register.
    #[error("{place}: R{register} is not restored at the function's end")]
    NotRestored {
        /// Location.
        place: String,
        /// R4 to R11.
        register: Register,
    },
    /// It continues at an address that is neither its caller nor a function.
    #[error("{place}: unknown jump target")]
    InvalidReturn {
        /// Location.
        place: String,
    },
    /// It jumps into the middle of another function.
    #[error("{place}: jump into the middle of {target}")]
    JumpIntoFunction {
        /// Location.
        place: String,
        /// Target of the jump.
        target: String,
    },
}

/// The functions of an image, each analysed on demand.
#[derive(Debug)]
pub struct Frames<'a> {
    image: &'a Image,
    known: RefCell<Known>,
}

/// Results so far.
#[derive(Debug, Default)]
struct Known {
    frames: BTreeMap<u32, Rc<Frame>>,
    /// Functions in analysis, each called by the previous one.
    followed: Vec<u32>,
    /// Functions in analysis that another function has assumed not to return.
    taken_to_end: BTreeSet<u32>,
    /// Recursive functions that nevertheless return.
    returning: BTreeSet<u32>,
}

impl<'a> Frames<'a> {
    /// Creates the analysis of an image.
    #[must_use]
    pub fn new(image: &'a Image) -> Self {
        Self { image, known: RefCell::default() }
    }

    /// The image.
    #[must_use]
    pub fn image(&self) -> &'a Image {
        self.image
    }

    /// The function at an address.
    ///
    /// # Errors
    /// [`FrameError`], of the function or of one of its callees.
    pub fn of(&self, address: u32) -> Result<Rc<Frame>, FrameError> {
        if let Some(frame) = self.known.borrow().frames.get(&address) {
            return Ok(Rc::clone(frame));
        }
        loop {
            let before: BTreeSet<u32> = {
                let mut known = self.known.borrow_mut();
                known.followed.push(address);
                known.frames.keys().copied().collect()
            };
            let followed = walk::walk(self, address);
            let mut known = self.known.borrow_mut();
            known.followed.pop();
            let frame = Rc::new(followed?);
            if known.taken_to_end.remove(&address) && frame.returns {
                // Results based on that assumption are wrong.
                known.frames.retain(|function, _| before.contains(function));
                known.returning.insert(address);
                continue;
            }
            known.frames.insert(address, Rc::clone(&frame));
            return Ok(frame);
        }
    }

    /// Whether an outlined piece of other functions starts at an address; it is analysed as part of them.
    #[must_use]
    pub fn is_outlined(&self, address: u32) -> bool {
        let function = self.image.functions.get(&address);
        let is_piece = |name: &String| OUTLINED.iter().any(|begin| name.starts_with(begin));
        function.is_some_and(|function| function.names.iter().any(is_piece))
    }

    /// Whether a function can return. A function in analysis counts as not returning unless another of its
    /// paths returns: the smallest solution.
    fn returns(&self, address: u32) -> Result<bool, FrameError> {
        {
            let mut known = self.known.borrow_mut();
            if known.followed.contains(&address) {
                if !known.returning.contains(&address) {
                    known.taken_to_end.insert(address);
                    return Ok(false);
                }
                return Ok(true);
            }
        }
        Ok(self.of(address)?.returns)
    }
}
