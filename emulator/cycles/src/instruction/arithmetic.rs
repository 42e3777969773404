//! 32-bit data processing with a shifted register or an immediate (A5.3.1, A5.3.3, A5.3.11).

use super::bits::Bits;
use super::{Arithmetic, Operand, Operation, PC, Register, SP, Shift};

/// Whether most 32-bit encodings allow the register.
pub(super) fn is_plain(register: Register) -> bool {
    register != SP && register != PC
}

/// Data processing with a register shifted by a constant.
pub(super) fn shifted_register(code: Bits) -> Option<Operation> {
    if code.is_set(15) {
        return None;
    }
    let amount = code.byte(12, 3) << 2 | code.byte(6, 2);
    let m = code.register(0);
    if code.byte(21, 4) == 6 {
        return pack(code, amount);
    }
    let operand = Operand::shifted(m, code.byte(4, 2), amount);
    let is_simple = matches!(operand, Operand::Register { shift: Shift::Left, amount: 0, .. });
    let n = code.register(16);
    let d = code.register(8);
    // `MOV` of a register allows one stack pointer operand; `ADD` and `SUB` allow it as first source.
    if code.byte(21, 4) == 2 && n == PC && is_simple && !code.is_set(20) {
        let is_allowed = d != PC && m != PC && (d != SP || m != SP);
        return is_allowed.then_some(Operation::Move { d, operand, inverted: false, sets_flags: false });
    }
    let is_small_left = matches!(operand, Operand::Register { shift: Shift::Left, amount: 0..=3, .. });
    if !is_plain(m) || (d == SP && !is_small_left) {
        return None;
    }
    processing(code, operand)
}

/// Data processing with an expanded immediate.
pub(super) fn expanded_immediate(code: Bits) -> Option<Operation> {
    processing(code, Operand::expanded(code)?)
}

/// The common part: operator, flags, first source, destination.
fn processing(code: Bits, operand: Operand) -> Option<Operation> {
    let sets_flags = code.is_set(20);
    let n = code.register(16);
    let d = code.register(8);
    let (operator, comparison) = match code.byte(21, 4) {
        0 => (Arithmetic::And, true),
        1 => (Arithmetic::BitClear, false),
        operator @ (2 | 3) if n == PC => {
            return is_plain(d).then_some(Operation::Move {
                d,
                operand,
                inverted: operator == 3,
                sets_flags,
            });
        }
        2 => (Arithmetic::Or, false),
        3 => (Arithmetic::OrNot, false),
        4 => (Arithmetic::ExclusiveOr, true),
        8 => (Arithmetic::Add, true),
        10 => (Arithmetic::AddWithCarry, false),
        11 => (Arithmetic::SubtractWithCarry, false),
        13 => (Arithmetic::Subtract, true),
        14 => (Arithmetic::ReverseSubtract, false),
        _ => return None,
    };
    let is_sum = matches!(code.byte(21, 4), 8 | 13);
    if n == PC || (n == SP && !is_sum) {
        return None;
    }
    if comparison && d == PC {
        return sets_flags.then_some(Operation::Arithmetic { operator, d: None, n, operand, sets_flags });
    }
    let is_allowed = is_plain(d) || (d == SP && n == SP && is_sum);
    is_allowed.then_some(Operation::Arithmetic { operator, d: Some(d), n, operand, sets_flags })
}

fn pack(code: Bits, amount: u8) -> Option<Operation> {
    let (d, n, m) = (code.register(8), code.register(16), code.register(0));
    let top_first = code.is_set(5);
    let is_allowed = !code.is_set(20) && !code.is_set(4) && [d, n, m].into_iter().all(is_plain);
    let amount = if top_first && amount == 0 { 32 } else { amount };
    is_allowed.then_some(Operation::Pack { d, n, m, amount, top_first })
}

/// Data processing with an immediate of 12 or 16 bits, and bit fields.
pub(super) fn plain_immediate(code: Bits) -> Option<Operation> {
    let d = code.register(8);
    let n = code.register(16);
    let low = code.number(26, 1) << 11 | code.number(12, 3) << 8 | code.number(0, 8);
    match code.byte(20, 5) {
        0b00000 => sum(Arithmetic::Add, d, n, low),
        0b01010 => sum(Arithmetic::Subtract, d, n, low),
        _ if !is_plain(d) => None,
        0b00100 => {
            let operand = Operand::number(code.number(16, 4) << 12 | low);
            Some(Operation::Move { d, operand, inverted: false, sets_flags: false })
        }
        0b01100 => Some(Operation::MoveTop { d, value: Bits(code.number(16, 4) << 12 | low).half() }),
        _ if code.is_set(26) || code.is_set(5) => None,
        field => bit_field(code, field),
    }
}

/// `ADDW`, `SUBW`; with the program counter as base, `ADR`.
fn sum(operator: Arithmetic, d: Register, n: Register, value: u32) -> Option<Operation> {
    let operand = Operand::number(value);
    let is_allowed = is_plain(d) || (d == SP && n == SP);
    is_allowed.then_some(Operation::Arithmetic { operator, d: Some(d), n, operand, sets_flags: false })
}

/// Saturation and bit fields.
fn bit_field(code: Bits, kind: u8) -> Option<Operation> {
    let d = code.register(8);
    let n = code.register(16);
    let amount = code.byte(12, 3) << 2 | code.byte(6, 2);
    let field = code.byte(0, 5);
    match kind {
        0b10110 if n != SP => {
            let width = (field + 1).checked_sub(amount).filter(|&width| width > 0)?;
            Some(Operation::InsertField { d, n: Some(n).filter(|&n| n != PC), min_bit: amount, width })
        }
        _ if !is_plain(n) => None,
        0b10100 | 0b11100 => (amount + field < 32).then_some(Operation::ExtractField {
            d,
            n,
            min_bit: amount,
            width: field + 1,
            is_signed: kind == 0b10100,
        }),
        // A right shift by 0 encodes the 16-bit variants.
        0b10010 | 0b11010 if amount == 0 => None,
        0b10000 | 0b10010 | 0b11000 | 0b11010 => {
            let is_signed = !code.is_set(23);
            Some(Operation::Saturate {
                d,
                bits: if is_signed { field + 1 } else { field },
                is_signed,
                n,
                shift: if code.is_set(21) { Shift::ArithmeticRight } else { Shift::Left },
                amount,
            })
        }
        _ => None,
    }
}
