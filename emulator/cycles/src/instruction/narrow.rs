//! 16-bit encodings (A5.2).

use super::bits::{Bits, sign_extend};
use super::{
    Address, AddressMode, Arithmetic, BitOperation, Condition, Extend, ItState, LR, Offset, Operand,
    Operation, PC, Register, SP, Shift, Width,
};

/// The operation, with its own condition if it is a conditional branch. In an IT block, flags do not change.
pub(super) fn decode(code: Bits, address: u32, in_it_block: bool) -> Option<(Condition, Operation)> {
    let sets_flags = !in_it_block;
    let operation = match code.byte(10, 6) {
        0b00_0000..=0b00_0101 => shift(code, sets_flags)?,
        0b00_0110 | 0b00_0111 => add_or_subtract(code, sets_flags),
        0b00_1000..=0b00_1111 => immediate(code, sets_flags),
        0b01_0000 => arithmetic(code, sets_flags),
        0b01_0001 => high_registers(code)?,
        0b01_0010 | 0b01_0011 => {
            let t = code.byte(8, 3);
            load(t, PC, code.number(0, 8) * 4, Width::Word)
        }
        0b01_0100..=0b01_0111 => register_offset(code),
        0b01_1000..=0b10_0111 => immediate_offset(code),
        0b10_1000..=0b10_1011 => {
            let n = if code.is_set(11) { SP } else { PC };
            add_immediate(Arithmetic::Add, code.byte(8, 3), n, code.number(0, 8) * 4)
        }
        0b10_1100..=0b10_1111 => miscellaneous(code, address)?,
        0b11_0000..=0b11_0011 => multiple(code)?,
        0b11_0100..=0b11_0111 => return branch_or_trap(code, address),
        0b11_1000 | 0b11_1001 => {
            Operation::Branch { target: relative(address, sign_extend(code.number(0, 11) << 1, 12)) }
        }
        _ => return None,
    };
    Some((Condition::Always, operation))
}

/// An address relative to the program counter.
pub(super) fn relative(address: u32, offset: i32) -> u32 {
    address.wrapping_add(4).wrapping_add_signed(offset)
}

fn add_immediate(operator: Arithmetic, d: Register, n: Register, value: u32) -> Operation {
    Operation::Arithmetic { operator, d: Some(d), n, operand: Operand::number(value), sets_flags: false }
}

fn at(base: Register, bytes: u32) -> Address {
    Address { base, offset: Offset::Immediate(bytes.cast_signed()), mode: AddressMode::Offset }
}

fn load(t: Register, base: Register, bytes: u32, width: Width) -> Operation {
    Operation::Load { t, address: at(base, bytes), width, is_signed: false }
}

/// `LSL`, `LSR`, `ASR` by a constant. `MOVS` of a register is `LSL` by 0, and is not allowed in an IT block.
fn shift(code: Bits, sets_flags: bool) -> Option<Operation> {
    let operand = Operand::shifted(code.byte(3, 3), code.byte(11, 2), code.byte(6, 5));
    (sets_flags || code.number(6, 7) != 0).then_some(Operation::Move {
        d: code.byte(0, 3),
        operand,
        inverted: false,
        sets_flags,
    })
}

fn add_or_subtract(code: Bits, sets_flags: bool) -> Operation {
    let field = code.byte(6, 3);
    Operation::Arithmetic {
        operator: if code.is_set(9) { Arithmetic::Subtract } else { Arithmetic::Add },
        d: Some(code.byte(0, 3)),
        n: code.byte(3, 3),
        operand: if code.is_set(10) { Operand::number(field.into()) } else { Operand::register(field) },
        sets_flags,
    }
}

/// `MOV`, `CMP`, `ADD`, `SUB` with an 8-bit immediate.
fn immediate(code: Bits, sets_flags: bool) -> Operation {
    let register = code.byte(8, 3);
    let operand = Operand::number(code.number(0, 8));
    let arithmetic =
        |operator, d, sets_flags| Operation::Arithmetic { operator, d, n: register, operand, sets_flags };
    match code.byte(11, 2) {
        0 => Operation::Move { d: register, operand, inverted: false, sets_flags },
        1 => arithmetic(Arithmetic::Subtract, None, true),
        2 => arithmetic(Arithmetic::Add, Some(register), sets_flags),
        _ => arithmetic(Arithmetic::Subtract, Some(register), sets_flags),
    }
}

/// Data processing of two low registers (A5.2.2).
fn arithmetic(code: Bits, sets_flags: bool) -> Operation {
    let d = code.byte(0, 3);
    let m = code.byte(3, 3);
    let into = |operator| Operation::Arithmetic {
        operator,
        d: Some(d),
        n: d,
        operand: Operand::register(m),
        sets_flags,
    };
    let compare = |operator| Operation::Arithmetic {
        operator,
        d: None,
        n: d,
        operand: Operand::register(m),
        sets_flags: true,
    };
    let shift = |shift| Operation::Move {
        d,
        operand: Operand::ShiftedBy { register: d, shift, amount: m },
        inverted: false,
        sets_flags,
    };
    match code.byte(6, 4) {
        0 => into(Arithmetic::And),
        1 => into(Arithmetic::ExclusiveOr),
        2 => shift(Shift::Left),
        3 => shift(Shift::LogicalRight),
        4 => shift(Shift::ArithmeticRight),
        5 => into(Arithmetic::AddWithCarry),
        6 => into(Arithmetic::SubtractWithCarry),
        7 => shift(Shift::RotateRight),
        8 => compare(Arithmetic::And),
        9 => Operation::Arithmetic {
            operator: Arithmetic::ReverseSubtract,
            d: Some(d),
            n: m,
            operand: Operand::number(0),
            sets_flags,
        },
        10 => compare(Arithmetic::Subtract),
        11 => compare(Arithmetic::Add),
        12 => into(Arithmetic::Or),
        13 => Operation::Multiply { d, n: m, m: d, a: None, subtracts: false, sets_flags },
        14 => into(Arithmetic::BitClear),
        _ => Operation::Move { d, operand: Operand::register(m), inverted: true, sets_flags },
    }
}

/// `ADD`, `CMP`, `MOV` of any registers, `BX`, `BLX` (A5.2.3).
fn high_registers(code: Bits) -> Option<Operation> {
    let d = code.byte(0, 3) | code.byte(7, 1) << 3;
    let m = code.register(3);
    let operand = Operand::register(m);
    match code.byte(8, 2) {
        0 => (d != PC || m != PC).then_some(Operation::Arithmetic {
            operator: Arithmetic::Add,
            d: Some(d),
            n: d,
            operand,
            sets_flags: false,
        }),
        1 => ((d > 7 || m > 7) && d != PC && m != PC).then_some(Operation::Arithmetic {
            operator: Arithmetic::Subtract,
            d: None,
            n: d,
            operand,
            sets_flags: true,
        }),
        2 => Some(Operation::Move { d, operand, inverted: false, sets_flags: false }),
        _ if code.number(0, 3) != 0 || m == PC => None,
        _ if code.is_set(7) => Some(Operation::BranchLinkRegister { m }),
        _ => Some(Operation::BranchRegister { m }),
    }
}

/// Loads and stores of low registers with a register offset.
fn register_offset(code: Bits) -> Operation {
    let t = code.byte(0, 3);
    let address = Address {
        base: code.byte(3, 3),
        offset: Offset::Register(code.byte(6, 3), 0),
        mode: AddressMode::Offset,
    };
    let load = |width, is_signed| Operation::Load { t, address, width, is_signed };
    let store = |width| Operation::Store { t, address, width };
    match code.byte(9, 3) {
        0 => store(Width::Word),
        1 => store(Width::Half),
        2 => store(Width::Byte),
        3 => load(Width::Byte, true),
        4 => load(Width::Word, false),
        5 => load(Width::Half, false),
        6 => load(Width::Byte, false),
        _ => load(Width::Half, true),
    }
}

/// Loads and stores of low registers with an immediate offset from a low register or the stack pointer.
fn immediate_offset(code: Bits) -> Operation {
    let field = code.number(6, 5);
    let (width, t, base, bytes) = match code.byte(12, 4) {
        6 => (Width::Word, code.byte(0, 3), code.byte(3, 3), field * 4),
        7 => (Width::Byte, code.byte(0, 3), code.byte(3, 3), field),
        8 => (Width::Half, code.byte(0, 3), code.byte(3, 3), field * 2),
        _ => (Width::Word, code.byte(8, 3), SP, code.number(0, 8) * 4),
    };
    if code.is_set(11) {
        load(t, base, bytes, width)
    } else {
        Operation::Store { t, address: at(base, bytes), width }
    }
}

/// Miscellaneous 16-bit instructions (A5.2.5).
fn miscellaneous(code: Bits, address: u32) -> Option<Operation> {
    let d = code.byte(0, 3);
    let m = code.byte(3, 3);
    let list = code.half() & 0xFF;
    let extend = |kind| Operation::Extend { kind, d, n: None, m, rotation: 0 };
    Some(match code.byte(5, 7) {
        0b000_0000..=0b000_0011 => add_immediate(Arithmetic::Add, SP, SP, code.number(0, 7) * 4),
        0b000_0100..=0b000_0111 => add_immediate(Arithmetic::Subtract, SP, SP, code.number(0, 7) * 4),
        bits if bits & 0b010_1000 == 0b000_1000 => Operation::CompareBranch {
            n: d,
            on_nonzero: code.is_set(11),
            target: address.wrapping_add(4 + code.number(9, 1) * 64 + code.number(3, 5) * 2),
        },
        0b001_0000 | 0b001_0001 => extend(Extend::Sxth),
        0b001_0010 | 0b001_0011 => extend(Extend::Sxtb),
        0b001_0100 | 0b001_0101 => extend(Extend::Uxth),
        0b001_0110 | 0b001_0111 => extend(Extend::Uxtb),
        0b010_0000..=0b010_1111 => Operation::StoreMultiple {
            n: SP,
            registers: some(list | u16::from(code.is_set(8)) << LR)?,
            writes_back: true,
            down: true,
        },
        0b110_0000..=0b110_1111 => Operation::LoadMultiple {
            n: SP,
            registers: some(list | u16::from(code.is_set(8)) << PC)?,
            writes_back: true,
            down: false,
        },
        0b011_0011 => Operation::ChangeState {
            disables: code.is_set(4),
            faults: match code.byte(0, 4) {
                0b0001 => true,
                0b0010 => false,
                _ => return None,
            },
        },
        0b101_0000 | 0b101_0001 => Operation::Bits { kind: BitOperation::Rev, d, m },
        0b101_0010 | 0b101_0011 => Operation::Bits { kind: BitOperation::Rev16, d, m },
        0b101_0110 | 0b101_0111 => Operation::Bits { kind: BitOperation::Revsh, d, m },
        0b111_0000..=0b111_0111 => Operation::Breakpoint(code.byte(0, 8)),
        0b111_1000..=0b111_1111 => if_then_or_hint(code)?,
        _ => return None,
    })
}

/// A nonempty register list.
fn some(registers: u16) -> Option<u16> {
    (registers != 0).then_some(registers)
}

fn if_then_or_hint(code: Bits) -> Option<Operation> {
    let state = ItState::behind(code.byte(0, 8));
    match state.length() {
        0 => Some(hint(code.byte(4, 4))),
        length => {
            let condition = state.condition()?;
            let is_single = code.byte(0, 4).is_power_of_two();
            (condition != Condition::Always || is_single).then_some(Operation::IfThen { length })
        }
    }
}

/// Unallocated hints do nothing (A5.2.5).
pub(super) fn hint(number: u8) -> Operation {
    match number {
        2 | 3 => Operation::Wait,
        _ => Operation::Hint,
    }
}

/// `STM`, `LDM` of low registers. The stored value of a base register that is not the first of the list is
/// unknown.
fn multiple(code: Bits) -> Option<Operation> {
    let n = code.byte(8, 3);
    let registers = some(code.half() & 0xFF)?;
    let has_base = registers >> n & 1 == 1;
    if code.is_set(11) {
        return Some(Operation::LoadMultiple { n, registers, writes_back: !has_base, down: false });
    }
    let is_known = !has_base || registers.trailing_zeros() == u32::from(n);
    is_known.then_some(Operation::StoreMultiple { n, registers, writes_back: true, down: false })
}

fn branch_or_trap(code: Bits, address: u32) -> Option<(Condition, Operation)> {
    let number = code.byte(0, 8);
    match code.byte(8, 4) {
        14 => Some((Condition::Always, Operation::Undefined(number))),
        15 => Some((Condition::Always, Operation::SupervisorCall(number))),
        condition => Some((
            Condition::from_bits(condition)?,
            Operation::Branch { target: relative(address, code.signed(0, 8) * 2) },
        )),
    }
}
