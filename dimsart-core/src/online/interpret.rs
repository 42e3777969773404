//! Runs instructions.

use super::instruction::{Field, Instruction, Opcode, REGISTERS};
use crate::math;

/// What a program reads and writes on the axis that is computed. What is not there reads as 0, and what is written to
/// it is dropped.
pub(crate) trait Surroundings {
    fn period_s(&self) -> f32;
    fn input(&self, port: u8, axis: u8) -> f32;
    fn last(&self, port: u8, axis: u8) -> f32;
    fn parameter(&self, number: u8, axis: u8) -> f32;
    fn state(&self, number: u8) -> f32;
    fn remember(&self, number: u8, value: f32);
    fn write(&self, port: u8, axis: u8, value: f32);
}

/// Numbers that instructions work on.
pub(crate) type Registers = [f32; REGISTERS];

/// Runs instructions one behind the other.
#[inline(always)]
pub(crate) fn run(
    instructions: &[u32],
    constants: &[u32],
    registers: &mut Registers,
    around: &impl Surroundings,
) {
    for word in instructions {
        let instruction = Instruction(*word);
        let [a, b, c, d] = instruction.fields();
        let Some(opcode) = instruction.opcode() else { return };
        let value = match opcode {
            Opcode::Constant => f32::from_bits(constants.get(usize::from(b)).copied().unwrap_or(0)),
            Opcode::Period => around.period_s(),
            Opcode::Input => around.input(b, c),
            Opcode::Parameter => around.parameter(b, c),
            Opcode::State => around.state(b),
            Opcode::Last => around.last(b, c),
            Opcode::Remember => {
                around.remember(a, get(registers, b));
                continue;
            }
            Opcode::Output => {
                around.write(a, c, get(registers, b));
                continue;
            }
            Opcode::Add => get(registers, b) + get(registers, c),
            Opcode::Subtract => get(registers, b) - get(registers, c),
            Opcode::Multiply => get(registers, b) * get(registers, c),
            Opcode::Divide => get(registers, b) / get(registers, c),
            Opcode::MultiplyAdd => {
                // Not in one: that has other bits.
                let product = get(registers, b) * get(registers, c);
                product + get(registers, d)
            }
            Opcode::Negate => -get(registers, b),
            Opcode::Absolute => get(registers, b).abs(),
            Opcode::Minimum => math::min(get(registers, b), get(registers, c)),
            Opcode::Maximum => math::max(get(registers, b), get(registers, c)),
            Opcode::Clamp => math::clamp(get(registers, b), get(registers, c), get(registers, d)),
            Opcode::Less => truth(get(registers, b) < get(registers, c)),
            Opcode::LessOrEqual => truth(get(registers, b) <= get(registers, c)),
            #[expect(clippy::float_cmp, reason = "what a law asks for by that name")]
            Opcode::Equal => truth(get(registers, b) == get(registers, c)),
            Opcode::Select if get(registers, b).to_bits() == 0 => get(registers, d),
            Opcode::Select => get(registers, c),
            Opcode::SquareRoot => math::sqrt(get(registers, b)),
            Opcode::Sine => math::sin(get(registers, b)),
            Opcode::Cosine => math::cos(get(registers, b)),
            Opcode::Arctangent => math::atan2(get(registers, b), get(registers, c)),
        };
        if let Some(register) = registers.get_mut(usize::from(a) % REGISTERS) {
            *register = value;
        }
    }
}

#[inline(always)]
fn get(registers: &Registers, number: u8) -> f32 {
    registers.get(usize::from(number) % REGISTERS).copied().unwrap_or(0.0)
}

fn truth(holds: bool) -> f32 {
    if holds { 1.0 } else { 0.0 }
}

/// What an instruction that works on registers alone makes of its arguments; none for any other one, or with other
/// arguments than it takes.
#[must_use]
pub fn calculate(opcode: Opcode, arguments: &[f32]) -> Option<f32> {
    let (first, others) = opcode.fields().split_first()?;
    let is_from = others.iter().all(|field| *field == Field::From);
    if *first != Field::To || !is_from || others.is_empty() || others.len() != arguments.len() {
        return None;
    }
    let mut registers = [0.0; REGISTERS];
    registers.iter_mut().zip(arguments).for_each(|(register, argument)| *register = *argument);
    run(&[Instruction::new(opcode, &[0, 0, 1, 2]).0], &[], &mut registers, &Nowhere);
    registers.first().copied()
}

/// Nothing is there.
struct Nowhere;

impl Surroundings for Nowhere {
    fn period_s(&self) -> f32 {
        0.0
    }
    fn input(&self, _: u8, _: u8) -> f32 {
        0.0
    }
    fn last(&self, _: u8, _: u8) -> f32 {
        0.0
    }
    fn parameter(&self, _: u8, _: u8) -> f32 {
        0.0
    }
    fn state(&self, _: u8) -> f32 {
        0.0
    }
    fn remember(&self, _: u8, _: f32) {}
    fn write(&self, _: u8, _: u8, _: f32) {}
}
