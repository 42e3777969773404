//! Short sequences of instructions with their cycles according to the manuals. They check the table of
//! [`timing`](crate::timing), here and on a chip.
//!
//! `sequences.txt` contains one sequence per line: the row that it tests, the cycles in both columns, the
//! code in halfwords, and its text, with the code at `0x1000`. The cycles are derived from the manuals by
//! hand, as noted above the lines, and not from the model.
//!
//! A sequence is a function with `BX LR` and `NOP` appended, at an address divisible by 4. It is called with
//! R0 = the address of [`BUFFER_BYTES`] in RAM (divisible by 8), R1 = 0, R2 = `0xFFFF_FFFF` and R3 = 1. It
//! uses no other registers than R12 and S0 to S15. Its cycles are the difference to a function that contains
//! only `BX LR`.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::image::{Image, Segment};
use crate::instruction::{Instruction, Undecoded, decode_all};
use crate::machine::{Machine, MachineError, Run};
use crate::timing::Timing;

/// Bytes of RAM that a sequence uses.
pub const BUFFER_BYTES: u32 = 64;

const TEXT: &str = include_str!("sequences.txt");
/// Code after a sequence: `BX LR`, and a `NOP` because a load relative to PC reads both.
pub const RETURN: [u16; 2] = [0x4770, 0xBF00];
const CODE: u32 = 0x1000;
const STACK: u32 = 0x2000_0000;
const STACK_END: u32 = 0x2000_0100;

/// A sequence and its expected cycles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sequence {
    /// Name of the row that it tests.
    pub row: &'static str,
    /// Most common number of cycles according to the manuals.
    pub typical: u32,
    /// Maximum cycles according to the manuals.
    pub upper: u32,
    /// Its instructions, for display.
    pub text: &'static str,
    halfwords: &'static str,
}

/// All sequences. Skips comments and lines in another format.
pub fn sequences() -> impl Iterator<Item = Sequence> {
    TEXT.lines().filter_map(|line| {
        let mut columns = line.split('|').map(str::trim);
        let row = columns.next().filter(|row| !row.starts_with('#'))?;
        let (typical, upper) = (columns.next()?.parse().ok()?, columns.next()?.parse().ok()?);
        Some(Sequence { row, typical, upper, halfwords: columns.next()?, text: columns.next()? })
    })
}

impl Sequence {
    /// The code without the appended return.
    pub fn halfwords(&self) -> impl Iterator<Item = u16> {
        self.halfwords.split(' ').filter_map(|halfword| u16::from_str_radix(halfword, 16).ok())
    }

    /// Cost of the sequence in a timing model.
    ///
    /// # Errors
    /// [`SequenceError`]; never for the sequences in this file.
    pub fn count(&self, timing: Timing) -> Result<SequenceCost, SequenceError> {
        let (with, without) = (run(timing, self.halfwords())?, run(timing, std::iter::empty())?);
        Ok(SequenceCost {
            cycles: with.cycles.saturating_sub(without.cycles),
            instructions: with.instructions.saturating_sub(without.instructions),
        })
    }

    /// The instructions.
    ///
    /// # Errors
    /// [`Undecoded`]; never for the sequences in this file.
    pub fn instructions(&self) -> Result<Vec<Instruction>, Undecoded> {
        decode_all(CODE, &bytes(self.halfwords())).collect()
    }
}

/// Cost of a sequence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SequenceCost {
    /// Cycles of the timing model.
    pub cycles: u64,
    /// Instructions, including skipped ones.
    pub instructions: u64,
}

/// Reason that a sequence does not run.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SequenceError {
    /// It cannot be decoded.
    #[error(transparent)]
    Undecoded(#[from] Undecoded),
    /// It cannot be executed.
    #[error(transparent)]
    Machine(#[from] MachineError),
}

fn bytes(halfwords: impl Iterator<Item = u16>) -> Vec<u8> {
    halfwords.flat_map(u16::to_le_bytes).collect()
}

fn run(timing: Timing, halfwords: impl Iterator<Item = u16>) -> Result<Run, SequenceError> {
    let bytes = bytes(halfwords.chain(RETURN));
    let mut code = BTreeMap::new();
    for instruction in decode_all(CODE, &bytes) {
        let instruction = instruction?;
        code.insert(instruction.address, instruction);
    }
    let marks = [
        ("_stack_end", STACK),
        ("_stack_start", STACK_END),
        ("__sdata", STACK_END),
        ("__euninit", STACK_END),
    ];
    let image = Image {
        segments: vec![Segment { address: CODE, load_address: CODE, bytes, is_writable: false }],
        symbols: marks.map(|(name, address)| (name.to_owned(), address)).into(),
        code,
        ..Image::default()
    };
    let mut machine = Machine::new(Arc::new(image), timing)?;
    machine.map(STACK_END, BUFFER_BYTES);
    Ok(machine.call(CODE, [STACK_END, 0, u32::MAX, 1])?)
}
