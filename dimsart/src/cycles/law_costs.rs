//! Costs of laws: a program with the maximum of ports, parameters and states, plus a cost per instruction.

use dimsart_core::online::{
    CURRENT_AXIS, Field, Header, Instruction, LawParameter, MAX_INPUTS, MAX_OUTPUTS, MAX_PARAMETERS,
    MAX_STATES, Opcode, program_crc,
};
use dimsart_core::{Command, Cost, ModuleRef, TypeRef, Unit, Value, types};
use hil_sim::law;

/// Copies of an instruction in a program.
const COPIES: u8 = 8;

/// The module that runs laws.
pub(super) const MODULE: ModuleRef = ModuleRef::new(law::MODULE, 1);

/// Loads a law with all ports, parameters and states that writes an input to every output.
pub(super) fn plain() -> Vec<Command> {
    commands(&[])
}

/// Loads the same law with copies of an instruction, if a tick can contain it.
pub(super) fn with(opcode: Opcode) -> Vec<Command> {
    // Fields other than registers are 0; registers read the input.
    let fields: Vec<u8> = opcode
        .fields()
        .iter()
        .map(|field| match field {
            Field::Destination => 1,
            Field::Axis => CURRENT_AXIS,
            _ => 0,
        })
        .collect();
    let copies = vec![Instruction::new(opcode, &fields); COPIES.into()];
    let copies = if opcode == Opcode::Last { Vec::new() } else { copies };
    commands(&copies)
}

fn commands(more: &[Instruction]) -> Vec<Command> {
    let count = |count: usize| u8::try_from(count).unwrap_or(u8::MAX);
    let mut tick = vec![Instruction::new(Opcode::Input, &[0, 0, CURRENT_AXIS])];
    tick.extend(more);
    tick.extend(
        (0..count(MAX_OUTPUTS)).map(|output| Instruction::new(Opcode::Output, &[output, 0, CURRENT_AXIS])),
    );
    let header = Header {
        inputs: count(MAX_INPUTS),
        outputs: count(MAX_OUTPUTS),
        parameters: count(MAX_PARAMETERS),
        states: count(MAX_STATES),
        constants: 1,
        tick: count(tick.len()),
        ..Header::default()
    };
    let numbered = |of: TypeRef, most: usize| (1..=count(most)).map(move |number| TypeRef { number, ..of });
    let ports = numbered(types::POSITION.first(), MAX_INPUTS);
    let ports = ports.chain(numbered(types::DES_FORCE.first(), MAX_OUTPUTS));
    let mut words = header.to_words().to_vec();
    words.extend(ports.map(|port| u32::from(port.id) | u32::from(port.number) << 16));
    let parameter = LawParameter { unit: Unit::One, min: 0.0, max: 1.0, default: 0.5 };
    words.extend([parameter; MAX_PARAMETERS].iter().flat_map(|parameter| parameter.to_words()));
    words.push(1.5_f32.to_bits());
    words.extend(tick.iter().map(|instruction| instruction.0));
    words.push(program_crc(&words));
    let mut commands = law::store_commands(&words, 1);
    commands.push(Command::set(MODULE, 0, Value::Count(1)));
    commands
}

/// Cost of each instruction per axis, from the cycles of the plain law and of laws with its copies on `dof` axes.
pub(super) fn lines(plain: Option<u64>, with: &[Option<u64>], dof: u16) -> Vec<Cost> {
    let lines = with.iter().zip(Opcode::ALL).map(|(bound, opcode)| {
        let more = (*bound)?.saturating_sub(plain?);
        let each = more.div_ceil(u64::from(COPIES) * u64::from(dof));
        u16::try_from(each).ok().filter(|each| *each > 0 || *opcode == Opcode::Last)
    });
    let mut lines: Vec<Option<u16>> = lines.collect();
    // `Last` occurs only at the start of a law; it costs an input and a comparison.
    let input = lines.get(Opcode::Input as usize).copied().flatten();
    if let Some(last) = lines.get_mut(Opcode::Last as usize) {
        *last = input.map(|input| input.saturating_mul(2));
    }
    lines.into_iter().map(|line| line.map_or(Cost::UNKNOWN, |each| Cost::new(each, 0))).collect()
}
