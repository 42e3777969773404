//! What a function puts on the stack and what it calls, read from its code.
//!
//! Every path through a function is followed with the stack pointer, the registers that it has to restore, and the
//! addresses that it loads. What the compiler has outlined (`OUTLINED_FUNCTION_n`, a piece of a function that stands
//! elsewhere) is followed as a part of the function.

mod origin;
mod slots;
mod walk;

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use crate::execute::ExecuteError;
use crate::image::Image;
use crate::instruction::{Register, Undecoded};

/// Begins of the names of what the compiler has outlined, and of what the linker puts before it where it is out of reach
/// for a branch.
const OUTLINED: [&str; 2] = ["OUTLINED_FUNCTION_", "__Thumbv7ABSLongThunk_OUTLINED_FUNCTION_"];

/// A function, followed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Frame {
    /// Where it begins.
    pub address: u32,
    /// Bytes that the function's own instructions put on the stack, at most.
    pub own_bytes: u32,
    /// The same with outlined pieces.
    pub bytes: u32,
    /// What it calls, by the address of the instruction; a conditional call counts.
    pub calls: BTreeMap<u32, Call>,
    /// Where the outlined pieces begin that are a part of it.
    pub pieces: BTreeSet<u32>,
    /// Whether it can come back to its caller.
    pub returns: bool,
    /// Whether it has an instruction for floats: an interrupt saves their registers too from then on.
    pub uses_floats: bool,
    /// Whether it begins by setting the stack pointer to the stack's begin, as a fault handler does.
    pub restarts_stack: bool,
    /// Instructions that trap (`UDF`): what the program takes to be impossible.
    pub traps: BTreeSet<u32>,
    /// Instructions that take a square root (`VSQRT`).
    pub square_roots: BTreeSet<u32>,
}

/// A call, or a jump to another function, which returns in this one's place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Call {
    /// Bytes on the stack, of this function, when it happens.
    pub depth_bytes: u32,
    /// Where the called function begins; none if it does not stand in the code.
    pub callee: Option<u32>,
}

/// Why a function cannot be followed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// There is no code.
    #[error("{place}: no instruction is there; if it is code, give it a function's symbol")]
    NoCode {
        /// Where.
        place: String,
    },
    /// An instruction is not modelled.
    #[error("{place}: {instruction}")]
    Undecoded {
        /// Where.
        place: String,
        /// Which.
        instruction: Undecoded,
    },
    /// An instruction is not modelled.
    #[error("{place}: {error}")]
    Unmodelled {
        /// Where.
        place: String,
        /// Why.
        error: ExecuteError,
    },
    /// The stack pointer is not its value at the begin and a known number of bytes.
    #[error("{place}: the stack pointer cannot be followed")]
    LostStack {
        /// Where.
        place: String,
    },
    /// Two paths meet with different depths.
    #[error("{place}: one way there has {bytes} bytes on the stack, another {other_bytes}")]
    Depths {
        /// Where they meet.
        place: String,
        /// One.
        bytes: i64,
        /// The other.
        other_bytes: i64,
    },
    /// It returns, or leaves for another function for good, with something on the stack, or with less than it came with.
    #[error("{place}: the function ends with {bytes} bytes on the stack")]
    Unbalanced {
        /// Where.
        place: String,
        /// Bytes that are left.
        bytes: i64,
    },
    /// It returns without a register as its caller had it.
    #[error("{place}: the function ends without R{register} as it was at its begin")]
    NotRestored {
        /// Where.
        place: String,
        /// R4 to R11.
        register: Register,
    },
    /// It goes on at an address that is neither its caller's nor a function's.
    #[error("{place}: it cannot be seen where this goes")]
    LostReturn {
        /// Where.
        place: String,
    },
    /// It jumps into the middle of another function.
    #[error("{place}: a jump into the middle of {target}")]
    JumpInto {
        /// Where.
        place: String,
        /// Where to.
        target: String,
    },
}

/// The functions of an image, each followed when it is asked for.
#[derive(Debug)]
pub struct Frames<'a> {
    image: &'a Image,
    known: RefCell<Known>,
}

/// What has been found out.
#[derive(Debug, Default)]
struct Known {
    frames: BTreeMap<u32, Rc<Frame>>,
    /// Functions that are being followed, each called by the one before it.
    followed: Vec<u32>,
    /// Of these, the ones that another one took not to return while they were.
    taken_to_end: BTreeSet<u32>,
    /// Functions that call themselves and return all the same.
    returning: BTreeSet<u32>,
}

impl<'a> Frames<'a> {
    /// Of an image.
    #[must_use]
    pub fn new(image: &'a Image) -> Self {
        Self { image, known: RefCell::default() }
    }

    /// The image.
    #[must_use]
    pub fn image(&self) -> &'a Image {
        self.image
    }

    /// The function that begins at an address.
    ///
    /// # Errors
    /// [`FrameError`], of it or of a function that it calls.
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
                // What was found out with that is wrong.
                known.frames.retain(|function, _| before.contains(function));
                known.returning.insert(address);
                continue;
            }
            known.frames.insert(address, Rc::clone(&frame));
            return Ok(frame);
        }
    }

    /// Whether a piece of other functions begins at an address, which is followed as a part of them.
    #[must_use]
    pub fn is_outlined(&self, address: u32) -> bool {
        let function = self.image.functions.get(&address);
        let is_piece = |name: &String| OUTLINED.iter().any(|begin| name.starts_with(begin));
        function.is_some_and(|function| function.names.iter().any(is_piece))
    }

    /// Whether a function can come back. One that is being followed does not, unless another path of it does: the
    /// smallest solution.
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
