//! 32-bit data processing of registers only, including lanes; multiplication and division (A5.3.12 to
//! A5.3.17).

use super::arithmetic::is_plain;
use super::bits::Bits;
use super::{
    BitOperation, Extend, Half, LongMultiply, Operand, Operation, PC, Parallel, Register, SP, Shift,
};

/// Shifts by a register, extensions, lanes, bit operations.
pub(super) fn register(code: Bits) -> Option<Operation> {
    let (d, n, m) = (code.register(8), code.register(16), code.register(0));
    if code.byte(12, 4) != 15 || !is_plain(d) || !is_plain(m) {
        return None;
    }
    let kind = code.byte(20, 4);
    match (kind >> 3, code.byte(4, 4)) {
        (0, 0) => {
            let shift = match kind >> 1 {
                0 => Shift::Left,
                1 => Shift::LogicalRight,
                2 => Shift::ArithmeticRight,
                _ => Shift::RotateRight,
            };
            is_plain(n).then_some(Operation::Move {
                d,
                operand: Operand::ShiftedBy { register: n, shift, amount: m },
                inverted: false,
                sets_flags: kind & 1 == 1,
            })
        }
        (0, 8..=11) if n != SP => {
            let kind = match kind {
                0 => Extend::Sxth,
                1 => Extend::Uxth,
                2 => Extend::Sxtb16,
                3 => Extend::Uxtb16,
                4 => Extend::Sxtb,
                5 => Extend::Uxtb,
                _ => return None,
            };
            let n = Some(n).filter(|&n| n != PC);
            Some(Operation::Extend { kind, d, n, m, rotation: code.byte(4, 2) * 8 })
        }
        (1, _) if !is_plain(n) => None,
        (1, group @ 0..=7) => parallel(kind & 7, group).map(|kind| Operation::Parallel { kind, d, n, m }),
        (1, group @ 8..=11) => bits(kind & 7, group & 3, d, n, m),
        _ => None,
    }
}

/// Addition and subtraction in lanes (A5.3.13, A5.3.14). Exchanging and halving variants are not modelled.
fn parallel(kind: u8, group: u8) -> Option<Parallel> {
    Some(match (group, kind) {
        (0, 0) => Parallel::Sadd8,
        (0, 1) => Parallel::Sadd16,
        (0, 4) => Parallel::Ssub8,
        (0, 5) => Parallel::Ssub16,
        (1, 0) => Parallel::Qadd8,
        (1, 1) => Parallel::Qadd16,
        (1, 4) => Parallel::Qsub8,
        (1, 5) => Parallel::Qsub16,
        (4, 0) => Parallel::Uadd8,
        (4, 1) => Parallel::Uadd16,
        (4, 4) => Parallel::Usub8,
        (4, 5) => Parallel::Usub16,
        (5, 0) => Parallel::Uqadd8,
        (5, 1) => Parallel::Uqadd16,
        (5, 4) => Parallel::Uqsub8,
        (5, 5) => Parallel::Uqsub16,
        _ => return None,
    })
}

/// Saturating sums, selection, bit reversal and counting (A5.3.15).
fn bits(kind: u8, variant: u8, d: Register, n: Register, m: Register) -> Option<Operation> {
    let parallel = |kind| Some(Operation::Parallel { kind, d, n, m });
    // The encoding contains the source register twice.
    let bits = |kind| (n == m).then_some(Operation::Bits { kind, d, m });
    match (kind, variant) {
        (0, 0) => parallel(Parallel::Qadd),
        (0, 1) => parallel(Parallel::Qdadd),
        (0, 2) => parallel(Parallel::Qsub),
        (0, _) => parallel(Parallel::Qdsub),
        (1, 0) => bits(BitOperation::Rev),
        (1, 1) => bits(BitOperation::Rev16),
        (1, 2) => bits(BitOperation::Rbit),
        (1, _) => bits(BitOperation::Revsh),
        (2, 0) => parallel(Parallel::Sel),
        (3, 0) => bits(BitOperation::Clz),
        _ => None,
    }
}

/// Multiplication with results of 32 and 64 bits, and division. Dual products are not modelled.
pub(super) fn multiply(code: Bits) -> Option<Operation> {
    let (d, n, m) = (code.register(8), code.register(16), code.register(0));
    if ![d, n, m].into_iter().all(is_plain) {
        return None;
    }
    if code.is_set(23) { multiply_long(code, d, n, m) } else { multiply_short(code, d, n, m) }
}

fn multiply_short(code: Bits, d: Register, n: Register, m: Register) -> Option<Operation> {
    let half = |bit| if code.is_set(bit) { Half::Top } else { Half::Bottom };
    let a = Some(code.register(12)).filter(|&a| a != PC);
    if a.is_some_and(|a| !is_plain(a)) {
        return None;
    }
    match (code.byte(20, 3), code.byte(4, 4)) {
        (0, 0) => Some(Operation::Multiply { d, n, m, a, subtracts: false, sets_flags: false }),
        (0, 1) => Some(Operation::Multiply { d, n, m, a: Some(a?), subtracts: true, sets_flags: false }),
        (1, 0..=3) => Some(Operation::MultiplyHalves { d, n: (n, half(5)), m: (m, half(4)), a }),
        (3, 0 | 1) => Some(Operation::MultiplyWide { d, n, m: (m, half(4)), a }),
        (5, rounding @ (0 | 1)) => {
            Some(Operation::MultiplyTop { d, n, m, a, subtracts: false, rounds: rounding == 1 })
        }
        (6, rounding @ (0 | 1)) => {
            Some(Operation::MultiplyTop { d, n, m, a: Some(a?), subtracts: true, rounds: rounding == 1 })
        }
        _ => None,
    }
}

fn multiply_long(code: Bits, high: Register, n: Register, m: Register) -> Option<Operation> {
    let low = code.register(12);
    let kind = match (code.byte(20, 3), code.byte(4, 4)) {
        (division @ (1 | 3), 15) => {
            let is_signed = division == 1;
            return (low == PC).then_some(Operation::Divide { d: high, n, m, is_signed });
        }
        (0, 0) => LongMultiply::Smull,
        (2, 0) => LongMultiply::Umull,
        (4, 0) => LongMultiply::Smlal,
        (6, 0) => LongMultiply::Umlal,
        (6, 6) => LongMultiply::Umaal,
        _ => return None,
    };
    (is_plain(low) && low != high).then_some(Operation::MultiplyLong { kind, low, high, n, m })
}
