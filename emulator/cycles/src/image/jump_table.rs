//! Jump tables.

use crate::image::Image;
use crate::instruction::{Address, Arithmetic, Instruction, Offset, Operand, Operation, PC, Register};
use crate::timing::registers;

/// Maximum alignment of the code or data after a table.
const ALIGNMENT: u32 = 4;
/// `NOP`, the padding before aligned code.
const NOP: u32 = 0xBF00;

/// Targets of the table branch (`TBB`, or `TBH` if `is_half`) at an address, with its table in `n`. The table
/// follows the branch and ends at the next instruction, constant or target. Empty if the location of the
/// table is unknown. A target may lack decoded code, if its instruction is not modelled.
pub(crate) fn targets(image: &Image, address: u32, n: Register, is_half: bool) -> Vec<u32> {
    let counter = address.wrapping_add(4);
    let Some(start) = table(image, address, n) else { return Vec::new() };
    let bytes = if is_half { 2 } else { 1 };
    let code = image.code.range(start..).next().map(|(address, _)| *address);
    let mut end = code.into_iter().chain(first_constant(image, start)).min().unwrap_or(start);
    let mut targets = Vec::new();
    let mut place = start;
    while place + bytes <= end {
        let entry = match image.bytes(place, if is_half { 2 } else { 1 }) {
            Some([entry]) => u32::from(*entry),
            Some([low, high]) => u32::from(u16::from_le_bytes([*low, *high])),
            _ => break,
        };
        let target = counter.wrapping_add(2 * entry);
        // The table contains no code: an entry that points into it, or that is a `NOP`, is padding. Such an
        // entry is kept anywhere but at the end, where it causes an error.
        let is_filling = (target <= place || entry == NOP) && end - place < ALIGNMENT;
        if !is_filling {
            end = if target > place { end.min(target) } else { end };
            targets.push(target);
        }
        place += bytes;
    }
    targets
}

/// Start of a branch's table: directly after the branch, or, if constants lie in between, the address that a
/// preceding `ADR` loads into `n`. Instructions that write other registers may lie between `ADR` and branch.
fn table(image: &Image, mut address: u32, n: Register) -> Option<u32> {
    if n == PC {
        return Some(address.wrapping_add(4));
    }
    loop {
        let (_, before) =
            image.code.range(..address).next_back().filter(|(_, before)| before.next() == address)?;
        match before.operation {
            Operation::Arithmetic {
                operator: Arithmetic::Add,
                d: Some(d),
                n: PC,
                operand: Operand::Immediate { value, .. },
                ..
            } if d == n => return Some((before.address.wrapping_add(4) & !3).wrapping_add(value)),
            ref other
                if registers::written(other).is_some_and(|written| written & registers::bit(n) == 0) =>
            {
                address = before.address;
            }
            _ => return None,
        }
    }
}

/// The first constant at or after `start` that the enclosing function loads.
fn first_constant(image: &Image, start: u32) -> Option<u32> {
    let function = image.function_at(start)?;
    let code = image.code.range(function.address..function.end());
    code.filter_map(|(_, instruction)| constant(instruction)).filter(|constant| *constant >= start).min()
}

/// The address of the constant that an instruction loads.
fn constant(instruction: &Instruction) -> Option<u32> {
    let offset = match instruction.operation {
        Operation::Load { address: Address { base: PC, offset: Offset::Immediate(offset), .. }, .. }
        | Operation::LoadPair {
            address: Address { base: PC, offset: Offset::Immediate(offset), .. }, ..
        }
        | Operation::FloatLoad { base: PC, offset, .. } => offset,
        _ => return None,
    };
    Some((instruction.address.wrapping_add(4) & !3).wrapping_add_signed(offset))
}
