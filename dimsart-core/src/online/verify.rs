//! Verification of an uploaded program, outside the tick.

use serde::{Deserialize, Serialize};

use super::PROGRAM_VERSION;
use super::instruction::{CURRENT_AXIS, Field, Instruction, Opcode, REGISTER_COUNT};
use super::program::{
    Header, MAX_INPUTS, MAX_OUTPUTS, MAX_PARAMETERS, MAX_STATES, Program, Section, program_crc,
};
use crate::limits::{MAX_DOF, PROGRAM_WORDS};
use crate::signal::{Format, Shape, types};

/// Reason why words are not a valid program. `at` is the index of the instruction over all sections, from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ProgramError {
    /// The CRC is wrong.
    Damaged,
    /// Unsupported format version.
    Version {
        /// The version found.
        found: u8,
    },
    /// A size exceeds its maximum, or the number of words does not match the header.
    Size,
    /// The signal of a port has an unknown type, or is not one `f32` per axis.
    Port {
        /// Number of the port, inputs first.
        port: u8,
    },
    /// A parameter has an invalid range, default or unit.
    Parameter {
        /// Number of the parameter.
        parameter: u8,
    },
    /// A constant is NaN or infinite.
    Constant {
        /// Number of the constant.
        constant: u8,
    },
    /// Unknown opcode.
    Opcode {
        /// Index of the instruction.
        at: u8,
    },
    /// A register does not exist, or is read before it is written.
    Register {
        /// Index of the instruction.
        at: u8,
    },
    /// A constant, port, parameter, state or axis does not exist.
    Range {
        /// Index of the instruction.
        at: u8,
    },
    /// An instruction is not allowed in its section: it writes an output before the first tick, or reads
    /// the current axis outside the sections of an axis.
    Place {
        /// Index of the instruction.
        at: u8,
    },
    /// An output is not written for every axis.
    Output {
        /// Number of the output.
        output: u8,
    },
}

impl core::fmt::Display for ProgramError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Damaged => write!(f, "wrong CRC: upload the law again"),
            Self::Version { found } => write!(
                f,
                "the law has format {found}, the image reads {PROGRAM_VERSION}: compile the law with the image's `dimsart`"
            ),
            Self::Size => write!(f, "wrong size of the law: the limit is {PROGRAM_WORDS} words"),
            Self::Port { port } => {
                write!(f, "port {port}: the data type is unknown to the image, or is not one f32 per axis")
            }
            Self::Parameter { parameter } => {
                write!(f, "parameter {parameter}: default out of range, or unknown unit")
            }
            Self::Constant { constant } => write!(f, "constant {constant} is NaN or infinite"),
            Self::Opcode { at } => write!(f, "instruction {at} is unknown to the image"),
            Self::Register { at } => write!(f, "instruction {at} reads an uninitialised register"),
            Self::Range { at } => write!(f, "instruction {at} has an operand out of range"),
            Self::Place { at } => write!(f, "instruction {at} is not allowed in its section"),
            Self::Output { output } => write!(f, "output {output} is not written for every axis"),
        }
    }
}

impl core::error::Error for ProgramError {}

/// Set of written registers, one bit each.
type Written = u32;
const _: () = assert!(REGISTER_COUNT == 32, "one bit per register");
const _: () = assert!(MAX_PARAMETERS + MAX_STATES < REGISTER_COUNT, "no registers left for results");

impl<'a> Program<'a> {
    /// Verifies words and returns the program.
    ///
    /// # Errors
    /// [`ProgramError`] gives the reason.
    pub fn verify(words: &'a [u32]) -> Result<Self, ProgramError> {
        verify(words).map(|header| Self::trusted(words, header))
    }
}

fn verify(words: &[u32]) -> Result<Header, ProgramError> {
    let (crc, content) = words.split_last().ok_or(ProgramError::Size)?;
    let header = Header::of(words).ok_or(ProgramError::Size)?;
    if words.len() > PROGRAM_WORDS {
        return Err(ProgramError::Size);
    }
    if program_crc(content) != *crc {
        return Err(ProgramError::Damaged);
    }
    let [version, ..] = words.first().copied().unwrap_or(0).to_le_bytes();
    if version != PROGRAM_VERSION {
        return Err(ProgramError::Version { found: version });
    }
    let has_room = [
        (header.inputs, MAX_INPUTS),
        (header.outputs, MAX_OUTPUTS),
        (header.parameters, MAX_PARAMETERS),
        (header.states, MAX_STATES),
        (header.axes, MAX_DOF),
    ];
    let fits = has_room.iter().all(|(count, most)| usize::from(*count) <= *most);
    if !fits || header.is_coupled && header.axes == 0 || header.words() != words.len() {
        return Err(ProgramError::Size);
    }
    let program = Program::unverified(words, header);
    check_ports(&program)?;
    check_numbers(&program)?;
    check_instructions(&program)?;
    Ok(header)
}

fn check_ports(program: &Program<'_>) -> Result<(), ProgramError> {
    for (port, signal) in (0..).zip(program.ports()) {
        let is_right = types::find_by_id(signal.id).is_some_and(|found| {
            found.format == Format::F32 && found.shape == Shape::Vector && signal.number > 0
        });
        if !is_right {
            return Err(ProgramError::Port { port });
        }
    }
    Ok(())
}

fn check_numbers(program: &Program<'_>) -> Result<(), ProgramError> {
    for number in 0..program.header().parameters {
        let is_right = program.parameter(number).is_some_and(|found| {
            let ends = found.min.is_finite() && found.max.is_finite();
            ends && (found.min..=found.max).contains(&found.default)
        });
        if !is_right {
            return Err(ProgramError::Parameter { parameter: number });
        }
    }
    let wrong = program.constants().iter().position(|bits| !f32::from_bits(*bits).is_finite());
    match wrong {
        None => Ok(()),
        Some(place) => Err(ProgramError::Constant { constant: u8::try_from(place).unwrap_or(u8::MAX) }),
    }
}

fn check_instructions(program: &Program<'_>) -> Result<(), ProgramError> {
    let mut outputs = [0_u8; MAX_OUTPUTS];
    let (mut at, mut once) = (0, 0);
    for section in [Section::Once, Section::Begin, Section::Tick] {
        // Parameters and states are in registers in the sections of an axis.
        let header = program.header();
        let there = if section == Section::Once { 0 } else { header.parameters + header.states };
        let mut written = once | ((1 << there) - 1);
        for word in program.instructions(section) {
            let instruction = Instruction(*word);
            written = check(header, section, instruction, at, written)?;
            if instruction.opcode() == Some(Opcode::Output) {
                let [output, _, axis, _] = instruction.fields();
                if let Some(axes) = outputs.get_mut(usize::from(output)) {
                    *axes |= if axis == CURRENT_AXIS {
                        u8::MAX
                    } else {
                        1_u8.checked_shl(axis.into()).unwrap_or(0)
                    };
                }
            }
            at = at.saturating_add(1);
        }
        if section == Section::Once {
            once = written;
        }
    }
    let header = program.header();
    let every = if header.is_coupled {
        u8::MAX >> (MAX_DOF - usize::from(header.axes).min(MAX_DOF))
    } else {
        u8::MAX
    };
    let axes = outputs.iter().take(header.outputs.into());
    match (0..).zip(axes).find(|(_, axes)| **axes & every != every) {
        None => Ok(()),
        Some((output, _)) => Err(ProgramError::Output { output }),
    }
}

/// Checks an instruction; returns the registers written after it.
fn check(
    header: Header,
    section: Section,
    instruction: Instruction,
    at: u8,
    written: Written,
) -> Result<Written, ProgramError> {
    let opcode = instruction.opcode().ok_or(ProgramError::Opcode { at })?;
    // The sections of an axis have a current axis, unless all axes are computed in one go.
    let has_axis = section != Section::Once && !header.is_coupled;
    let is_in_place = match opcode {
        Opcode::Output => section == Section::Tick,
        Opcode::Last => section == Section::Begin,
        Opcode::Input | Opcode::Parameter | Opcode::Remember => section != Section::Once,
        _ => true,
    };
    if !is_in_place {
        return Err(ProgramError::Place { at });
    }
    let mut behind = written;
    for (field, number) in opcode.fields().iter().zip(instruction.fields()) {
        let bit = 1_u32.checked_shl(number.into());
        let count = match field {
            Field::Destination => {
                behind |= bit.ok_or(ProgramError::Register { at })?;
                continue;
            }
            Field::Source => {
                let bit = bit.ok_or(ProgramError::Register { at })?;
                if written & bit == 0 {
                    return Err(ProgramError::Register { at });
                }
                continue;
            }
            Field::Axis if number == CURRENT_AXIS => {
                if !has_axis {
                    return Err(ProgramError::Place { at });
                }
                continue;
            }
            Field::Axis => header.axes,
            Field::Constant => header.constants,
            Field::Input => header.inputs,
            Field::Output => header.outputs,
            Field::Parameter => header.parameters,
            Field::State => header.states,
        };
        if number >= count {
            return Err(ProgramError::Range { at });
        }
    }
    Ok(behind)
}
