//! Table rows of an operation: a match over every operation, so that the compiler finds a missing one.

use super::registers::accumulates;
use super::table::Row;
use crate::instruction::{
    Address, AddressMode, FloatArithmetic, FloatUnary, Offset, Operation, Register, Width,
};

/// The row with an operation's own cycles.
pub(super) fn base(operation: &Operation) -> Row {
    match operation {
        Operation::Move { .. }
        | Operation::MoveTop { .. }
        | Operation::Arithmetic { .. }
        | Operation::Extend { .. }
        | Operation::ExtractField { .. }
        | Operation::InsertField { .. }
        | Operation::Bits { .. }
        | Operation::Saturate { .. }
        | Operation::Pack { .. }
        | Operation::Parallel { .. } => Row::Data,
        Operation::Multiply { .. }
        | Operation::MultiplyLong { .. }
        | Operation::MultiplyHalves { .. }
        | Operation::MultiplyWide { .. }
        | Operation::MultiplyTop { .. } => Row::Multiply,
        Operation::Divide { .. } => Row::DivideFewest,
        Operation::IfThen { .. } => Row::IfThen,

        Operation::Load { .. } | Operation::LoadExclusive { .. } | Operation::StoreExclusive { .. } => {
            Row::Load
        }
        Operation::Store { address, .. } => match (address.mode, address.offset) {
            (AddressMode::Offset, Offset::Immediate(_)) => Row::StoreImmediate,
            (AddressMode::Offset, Offset::Register(..)) => Row::StoreRegister,
            (AddressMode::PreIndexed | AddressMode::PostIndexed, _) => Row::StoreWriteBack,
        },
        Operation::LoadPair { .. }
        | Operation::StorePair { .. }
        | Operation::LoadMultiple { .. }
        | Operation::StoreMultiple { .. } => Row::MultipleFirst,
        Operation::ClearExclusive => Row::ClearExclusive,

        Operation::Branch { .. }
        | Operation::BranchLink { .. }
        | Operation::BranchRegister { .. }
        | Operation::BranchLinkRegister { .. }
        | Operation::CompareBranch { .. } => Row::Branch,
        Operation::TableBranch { .. } => Row::TableBranch,

        Operation::Hint | Operation::Wait => Row::Hint,
        Operation::Barrier => Row::Barrier,
        Operation::ChangeState { .. } | Operation::ReadSpecial { .. } | Operation::WriteSpecial { .. } => {
            Row::SpecialRegister
        }
        Operation::SupervisorCall(_) | Operation::Breakpoint(_) | Operation::Undefined(_) => Row::Trap,

        Operation::Float { operator: FloatArithmetic::Vdiv, .. }
        | Operation::FloatUnary { operator: FloatUnary::Vsqrt, .. } => Row::FloatDivide,
        Operation::Float { operator, .. } if accumulates(*operator) => Row::FloatMultiplyAccumulate,
        Operation::Float { .. }
        | Operation::FloatUnary { .. }
        | Operation::FloatImmediate { .. }
        | Operation::FloatCompare { .. }
        | Operation::FloatConvert { .. } => Row::Float,
        Operation::FloatLoad { is_double: false, .. } => Row::FloatLoad,
        Operation::FloatLoad { is_double: true, .. } => Row::FloatLoadDouble,
        Operation::FloatStore { is_double: false, .. } => Row::FloatStore,
        Operation::FloatStore { is_double: true, .. } => Row::FloatStoreDouble,
        Operation::FloatLoadMultiple { .. } | Operation::FloatStoreMultiple { .. } => Row::FloatMultipleFirst,
        Operation::FloatFromCore { .. } | Operation::FloatToCore { .. } => Row::FloatToCore,
        Operation::FloatPairFromCore { .. } | Operation::FloatPairToCore { .. } => Row::FloatPairToCore,
        Operation::FloatStatusRead { .. } | Operation::FloatStatusWrite { .. } => Row::FloatStatus,
    }
}

/// The row for each register of a multiple access, and the number of registers.
pub(super) fn each(operation: &Operation) -> Option<(Row, u32)> {
    match *operation {
        Operation::LoadPair { .. } | Operation::StorePair { .. } => Some((Row::MultipleEach, 2)),
        Operation::LoadMultiple { registers, .. } | Operation::StoreMultiple { registers, .. } => {
            Some((Row::MultipleEach, registers.count_ones()))
        }
        Operation::FloatLoadMultiple { count, .. } | Operation::FloatStoreMultiple { count, .. } => {
            Some((Row::FloatMultipleEach, count.into()))
        }
        _ => None,
    }
}

/// Bytes that an operation loads; `None` if it loads nothing.
pub(super) fn loaded_bytes(operation: &Operation) -> Option<u32> {
    match *operation {
        Operation::Load { width, .. } | Operation::LoadExclusive { width, .. } => Some(width.bytes().into()),
        Operation::LoadPair { .. } => Some(8),
        Operation::LoadMultiple { registers, .. } => Some(4 * registers.count_ones()),
        Operation::TableBranch { half, .. } => Some(if half { 2 } else { 1 }),
        Operation::FloatLoad { is_double, .. } => Some(if is_double { 8 } else { 4 }),
        Operation::FloatLoadMultiple { count, .. } => Some(4 * u32::from(count)),
        _ => None,
    }
}

/// Whether an operation is a load that pipelines with its neighbours: not with an updated base.
pub(super) fn pipelines(operation: &Operation) -> bool {
    match operation {
        Operation::Load { address, .. } => address.mode == AddressMode::Offset,
        Operation::LoadExclusive { .. } | Operation::StoreExclusive { .. } => true,
        Operation::FloatLoad { is_double, .. } => !is_double,
        _ => false,
    }
}

/// The row for each further access if the operation is unaligned, and its width. Other operations must be
/// aligned.
pub(super) fn unaligned(operation: &Operation) -> Option<(Row, Width)> {
    match *operation {
        Operation::Load { width, .. } => Some((Row::UnalignedLoad, width)),
        Operation::Store { width, .. } => Some((Row::UnalignedStore, width)),
        _ => None,
    }
}

/// Base register and offset of the (first) access, for an address without a second register.
pub(super) fn immediate_offset(operation: &Operation) -> Option<(Register, i32)> {
    let of = |address: &Address| match (address.offset, address.mode) {
        (_, AddressMode::PostIndexed) => Some((address.base, 0)),
        (Offset::Immediate(offset), _) => Some((address.base, offset)),
        (Offset::Register(..), _) => None,
    };
    match operation {
        Operation::Load { address, .. }
        | Operation::Store { address, .. }
        | Operation::LoadPair { address, .. }
        | Operation::StorePair { address, .. } => of(address),
        Operation::LoadMultiple { n, .. } | Operation::FloatLoadMultiple { n, .. } => Some((*n, 0)),
        Operation::FloatLoad { base, offset, .. } => Some((*base, *offset)),
        _ => None,
    }
}
