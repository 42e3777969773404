//! Interpreter of programs.

use super::instruction::{Field, Instruction, Opcode, PLACES, REGISTER_COUNT};
use crate::math;

/// Environment of a program on the current axis. Missing items read 0, and writes to them are dropped.
pub trait Environment {
    /// Returns the module's sample period, `s`.
    fn period_s(&self) -> f32;
    /// Returns the value of an input port.
    fn input(&self, port: u32, axis: u32) -> f32;
    /// Returns the value of an output port after the last tick.
    fn last_output(&self, port: u32, axis: u32) -> f32;
    /// Returns a parameter or a state.
    fn parameter(&self, number: u32, axis: u32) -> f32;
    /// Stores a state.
    fn set_state(&self, number: u32, value: f32);
    /// Writes an output port.
    fn write(&self, port: u32, axis: u32, value: f32);
}

/// Registers of a program.
pub type Registers = [f32; REGISTER_COUNT];

/// Runs instructions in sequence.
#[inline(always)]
pub fn run(instructions: &[u32], constants: &[u32], registers: &mut Registers, around: &impl Environment) {
    for word in instructions {
        // Each operation extracts only the fields that it needs.
        let field = |place: u32| (word >> place) & FIELD;
        let get = |place: u32| read(registers, word >> place);
        let value = match Opcode::of_word(*word) {
            Opcode::Constant => f32::from_bits(constants.get(field(B) as usize).copied().unwrap_or(0)),
            Opcode::Period => around.period_s(),
            Opcode::Input => around.input(field(B), field(C)),
            Opcode::Parameter => around.parameter(field(B), field(C)),
            Opcode::Last => around.last_output(field(B), field(C)),
            Opcode::Remember => {
                around.set_state(field(A), get(B));
                continue;
            }
            Opcode::Output => {
                around.write(field(A), field(C), get(B));
                continue;
            }
            Opcode::Add => get(B) + get(C),
            Opcode::Subtract => get(B) - get(C),
            Opcode::Multiply => get(B) * get(C),
            Opcode::Divide => get(B) / get(C),
            Opcode::MultiplyAdd => {
                // Not fused: a fused multiply-add gives other bits.
                let product = get(B) * get(C);
                product + get(D)
            }
            Opcode::Negate => -get(B),
            Opcode::Absolute => get(B).abs(),
            Opcode::Minimum => math::min(get(B), get(C)),
            Opcode::Maximum => math::max(get(B), get(C)),
            Opcode::Clamp => math::clamp(get(B), get(C), get(D)),
            Opcode::Less => truth(get(B) < get(C)),
            Opcode::LessOrEqual => truth(get(B) <= get(C)),
            #[expect(clippy::float_cmp, reason = "the operation compares exactly")]
            Opcode::Equal => truth(get(B) == get(C)),
            Opcode::Select if get(B).to_bits() == 0 => get(D),
            Opcode::Select => get(C),
            Opcode::SquareRoot => math::sqrt(get(B)),
            Opcode::Sine => math::sin(get(B)),
            Opcode::Cosine => math::cos(get(B)),
            Opcode::Arctangent => math::atan2(get(B), get(C)),
        };
        if let Some(register) = registers.get_mut((word >> A) as usize % REGISTER_COUNT) {
            *register = value;
        }
    }
}

/// First bits of the fields.
const A: u32 = PLACES[0];
const B: u32 = PLACES[1];
const C: u32 = PLACES[2];
const D: u32 = PLACES[3];
const FIELD: u32 = 0x3F;

#[inline(always)]
fn read(registers: &Registers, number: u32) -> f32 {
    registers.get(number as usize % REGISTER_COUNT).copied().unwrap_or(0.0)
}

fn truth(holds: bool) -> f32 {
    if holds { 1.0 } else { 0.0 }
}

/// Computes an instruction that uses registers only; none for other instructions or a wrong number of
/// arguments.
#[must_use]
pub fn calculate(opcode: Opcode, arguments: &[f32]) -> Option<f32> {
    let (first, others) = opcode.fields().split_first()?;
    let is_from = others.iter().all(|field| *field == Field::Source);
    if *first != Field::Destination || !is_from || others.is_empty() || others.len() != arguments.len() {
        return None;
    }
    let mut registers = [0.0; REGISTER_COUNT];
    registers.iter_mut().zip(arguments).for_each(|(register, argument)| *register = *argument);
    run(&[Instruction::new(opcode, &[0, 0, 1, 2]).0], &[], &mut registers, &Nowhere);
    registers.first().copied()
}

/// Empty environment.
struct Nowhere;

impl Environment for Nowhere {
    fn period_s(&self) -> f32 {
        0.0
    }
    fn input(&self, _: u32, _: u32) -> f32 {
        0.0
    }
    fn last_output(&self, _: u32, _: u32) -> f32 {
        0.0
    }
    fn parameter(&self, _: u32, _: u32) -> f32 {
        0.0
    }
    fn set_state(&self, _: u32, _: f32) {}
    fn write(&self, _: u32, _: u32, _: f32) {}
}
