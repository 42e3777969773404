//! Control laws that come while the controller runs: a program is taken, verified, kept, and run by
//! `ONLINE_MOD`.
//!
//! A program is straight on: no jump, no loop, no address. So what it takes is known before it runs, and it ends.
//! Whatever its words are, running one cannot panic or reach beyond its own registers, parameters and ports; what
//! [`Program::verify`] lets through reads no register that was not written, and writes every output.

mod instruction;
mod interpret;
mod program;
mod programs;
mod verify;

pub use instruction::{Field, Instruction, OPCODES, OWN_AXIS, Opcode, REGISTERS};
pub use interpret::calculate;
pub use interpret::{Registers, Surroundings, run};
pub(crate) use program::PARAMETERS;
pub use program::{
    Header, LawParameter, MAX_INPUTS, MAX_OUTPUTS, MAX_PARAMETERS, MAX_STATES, Program, Section, seal,
};
pub(crate) use programs::ProgramSlot;
pub use programs::{Code, Programs};
pub use programs::{LawRefusal, LawReport};
pub use verify::ProgramError;

/// Version of the format of programs.
pub const PROGRAM_VERSION: u8 = 2;
