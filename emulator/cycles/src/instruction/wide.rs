//! 32-bit encodings (A5.3): selection of the table.

use super::bits::Bits;
use super::{Condition, Operation, arithmetic, branch, float, lanes, memory, multiple};

/// The operation, with its own condition if it is a conditional branch.
pub(super) fn decode(code: Bits, address: u32) -> Option<(Condition, Operation)> {
    let operation = match code.byte(25, 4) {
        0b0100 if code.is_set(22) => multiple::pair_or_exclusive(code)?,
        0b0100 => multiple::registers(code)?,
        0b0101 => arithmetic::shifted_register(code)?,
        0b0110 | 0b0111 => float::decode(code)?,
        0b1000..=0b1011 if code.is_set(15) => return branch::decode(code, address),
        0b1000 | 0b1010 => arithmetic::expanded_immediate(code)?,
        0b1001 | 0b1011 => arithmetic::plain_immediate(code)?,
        0b1100 => memory::decode(code)?,
        0b1101 if code.is_set(24) => lanes::multiply(code)?,
        0b1101 => lanes::register(code)?,
        _ => return None,
    };
    Some((Condition::Always, operation))
}
