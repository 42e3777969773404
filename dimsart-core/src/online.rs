//! Online control laws: programs that are uploaded at run time, verified, stored, and run by `ONLINE_MOD`.
//!
//! A program has no jumps, loops or addresses. So it always ends, and its cost is known before it runs.
//! Whatever its words are, running it cannot panic or access anything outside its own registers, parameters
//! and ports. A program accepted by [`Program::verify`] reads no uninitialised register and writes every
//! output.

mod instruction;
mod interpret;
mod program;
mod programs;
mod verify;

pub use instruction::{CURRENT_AXIS, Field, Instruction, OPCODE_COUNT, Opcode, REGISTER_COUNT};
pub use interpret::calculate;
pub use interpret::{Environment, Registers, run};
pub(crate) use program::PARAMETERS;
pub use program::{
    Header, LawParameter, MAX_INPUTS, MAX_OUTPUTS, MAX_PARAMETERS, MAX_STATES, Program, Section, program_crc,
};
pub(crate) use programs::ProgramSlot;
pub use programs::{Code, Programs};
pub use programs::{LawRefusal, LawReport};
pub use verify::ProgramError;

/// Version of the program format.
pub const PROGRAM_VERSION: u8 = 2;
