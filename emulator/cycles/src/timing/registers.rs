//! Registers that an instruction reads and writes, as far as a later instruction waits for them.

use crate::instruction::{
    Address, AddressMode, FloatArithmetic, FloatRegister, FloatUnary, Offset, Operation, PC, Register,
};

/// Core registers in the address of an access; bit n for Rn. Excludes PC, which is never late.
pub(super) fn of_address(operation: &Operation) -> u16 {
    let registers = match *operation {
        Operation::Load { ref address, .. }
        | Operation::Store { ref address, .. }
        | Operation::LoadPair { ref address, .. }
        | Operation::StorePair { ref address, .. } => {
            bit(address.base)
                | match address.offset {
                    Offset::Register(register, _) => bit(register),
                    Offset::Immediate(_) => 0,
                }
        }
        Operation::LoadMultiple { n, .. }
        | Operation::StoreMultiple { n, .. }
        | Operation::LoadExclusive { n, .. }
        | Operation::StoreExclusive { n, .. }
        | Operation::FloatLoadMultiple { n, .. }
        | Operation::FloatStoreMultiple { n, .. } => bit(n),
        Operation::FloatLoad { base, .. } | Operation::FloatStore { base, .. } => bit(base),
        Operation::TableBranch { n, m, .. } => bit(n) | bit(m),
        _ => 0,
    };
    registers & 0x7FFF
}

/// Core registers that the instruction computes: includes an updated base, excludes loaded registers.
pub(super) fn computed(operation: &Operation) -> u16 {
    match *operation {
        Operation::Move { d, .. }
        | Operation::MoveTop { d, .. }
        | Operation::Multiply { d, .. }
        | Operation::MultiplyHalves { d, .. }
        | Operation::MultiplyWide { d, .. }
        | Operation::MultiplyTop { d, .. }
        | Operation::Divide { d, .. }
        | Operation::Extend { d, .. }
        | Operation::ExtractField { d, .. }
        | Operation::InsertField { d, .. }
        | Operation::Bits { d, .. }
        | Operation::Saturate { d, .. }
        | Operation::Pack { d, .. }
        | Operation::Parallel { d, .. }
        | Operation::ReadSpecial { d, .. } => bit(d),
        Operation::Arithmetic { d, .. } => d.map_or(0, bit),
        Operation::MultiplyLong { low, high, .. } => bit(low) | bit(high),
        Operation::FloatToCore { t, .. } | Operation::FloatStatusRead { t } => bit(t),
        Operation::FloatPairToCore { t, t2, .. } => bit(t) | bit(t2),
        Operation::Load { ref address, .. }
        | Operation::Store { ref address, .. }
        | Operation::LoadPair { ref address, .. }
        | Operation::StorePair { ref address, .. } => written_back(address),
        _ => 0,
    }
}

/// Core registers that an operation writes, early or late; `None` if it may jump.
pub(crate) fn written(operation: &Operation) -> Option<u16> {
    let others = match *operation {
        Operation::Branch { .. }
        | Operation::BranchLink { .. }
        | Operation::BranchRegister { .. }
        | Operation::BranchLinkRegister { .. }
        | Operation::CompareBranch { .. }
        | Operation::TableBranch { .. }
        | Operation::SupervisorCall(_)
        | Operation::Breakpoint(_)
        | Operation::Undefined(_) => return None,
        Operation::LoadPair { t, t2, .. } => bit(t) | bit(t2),
        Operation::LoadMultiple { n, registers, writes_back, .. } => {
            registers | if writes_back { bit(n) } else { 0 }
        }
        Operation::StoreMultiple { n, writes_back: true, .. }
        | Operation::FloatLoadMultiple { n, writes_back: true, .. }
        | Operation::FloatStoreMultiple { n, writes_back: true, .. } => bit(n),
        _ => 0,
    };
    Some(computed(operation) | loaded(operation) | others).filter(|written| written & bit(PC) == 0)
}

fn written_back(address: &Address) -> u16 {
    if address.mode == AddressMode::Offset { 0 } else { bit(address.base) }
}

/// Core registers written by a load that other accesses pipeline with.
pub(super) fn loaded(operation: &Operation) -> u16 {
    match *operation {
        Operation::Load { t, .. } | Operation::LoadExclusive { t, .. } => bit(t),
        Operation::StoreExclusive { d, .. } => bit(d),
        _ => 0,
    }
}

/// Float registers that an instruction reads, bit n for Sn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FloatSources {
    /// Read at the start.
    pub(super) read: u32,
    /// Read one cycle later: the addend of a multiply-accumulate.
    pub(super) addend: u32,
}

/// Float registers that a floating-point instruction reads; `None` for other instructions.
pub(super) fn float_sources(operation: &Operation) -> Option<FloatSources> {
    let mut addend = 0;
    let read = match *operation {
        Operation::Float { operator, d, n, m } => {
            if accumulates(operator) {
                addend = float_bits(d, 1);
            }
            float_bits(n, 1) | float_bits(m, 1)
        }
        Operation::FloatUnary { m, .. }
        | Operation::FloatConvert { m, .. }
        | Operation::FloatToCore { m, .. } => float_bits(m, 1),
        Operation::FloatCompare { d, m, .. } => float_bits(d, 1) | m.map_or(0, |m| float_bits(m, 1)),
        Operation::FloatStore { d, is_double, .. } => float_bits(d, if is_double { 2 } else { 1 }),
        Operation::FloatStoreMultiple { d, count, .. } => float_bits(d, count),
        Operation::FloatPairToCore { m, .. } => float_bits(m, 2),
        Operation::FloatImmediate { .. }
        | Operation::FloatLoad { .. }
        | Operation::FloatLoadMultiple { .. }
        | Operation::FloatFromCore { .. }
        | Operation::FloatPairFromCore { .. }
        | Operation::FloatStatusRead { .. }
        | Operation::FloatStatusWrite { .. } => 0,
        _ => return None,
    };
    Some(FloatSources { read, addend })
}

/// The float register with the late result of arithmetic or a conversion.
pub(super) fn float_result(operation: &Operation) -> u32 {
    match *operation {
        Operation::Float { d, .. }
        | Operation::FloatConvert { d, .. }
        | Operation::FloatUnary { operator: FloatUnary::Vsqrt, d, .. } => float_bits(d, 1),
        _ => 0,
    }
}

/// Whether the operator adds to its destination.
pub(super) fn accumulates(operator: FloatArithmetic) -> bool {
    use FloatArithmetic::{Vfma, Vfms, Vfnma, Vfnms, Vmla, Vmls, Vnmla, Vnmls};
    matches!(operator, Vmla | Vmls | Vnmla | Vnmls | Vfma | Vfms | Vfnma | Vfnms)
}

pub(crate) fn bit(register: Register) -> u16 {
    1_u16.checked_shl(register.into()).unwrap_or(0)
}

fn float_bits(first: FloatRegister, count: u8) -> u32 {
    let ones = 1_u32.checked_shl(count.into()).map_or(u32::MAX, |end| end - 1);
    ones.checked_shl(first.into()).unwrap_or(0)
}
