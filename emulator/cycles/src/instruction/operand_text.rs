//! Operands as text.

use super::{Address, AddressMode, FloatRegister, Half, Offset, Operand, Register, Shift, Width};

impl Shift {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Left => "lsl",
            Self::LogicalRight => "lsr",
            Self::ArithmeticRight => "asr",
            Self::RotateRight => "ror",
            Self::RotateExtended => "rrx",
        }
    }
}

impl Width {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Byte => "b",
            Self::Half => "h",
            Self::Word => "",
        }
    }
}

/// A core register.
pub(super) fn core(register: Register) -> &'static str {
    const NAMES: [&str; 16] =
        ["r0", "r1", "r2", "r3", "r4", "r5", "r6", "r7", "r8", "r9", "r10", "r11", "r12", "sp", "lr", "pc"];
    NAMES.get(usize::from(register)).copied().unwrap_or("r?")
}

/// A list of core registers.
pub(super) fn cores(registers: &[Register]) -> String {
    registers.iter().map(|&register| core(register)).collect::<Vec<_>>().join(", ")
}

/// Core registers from a bit mask.
pub(super) fn list(registers: u16) -> String {
    format!("{{{}}}", cores(&(0..16).filter(|&register| registers >> register & 1 == 1).collect::<Vec<_>>()))
}

/// A list of float registers.
pub(super) fn floats(registers: &[FloatRegister]) -> String {
    registers.iter().map(|register| format!("s{register}")).collect::<Vec<_>>().join(", ")
}

/// Consecutive float registers.
pub(super) fn run(first: FloatRegister, count: u8) -> String {
    format!("{{{}}}", floats(&(first..first.saturating_add(count)).collect::<Vec<_>>()))
}

/// The letter of a half.
pub(super) fn half(half: Half) -> &'static str {
    match half {
        Half::Bottom => "b",
        Half::Top => "t",
    }
}

/// A register shifted by a constant.
pub(super) fn shifted(register: Register, shift: Shift, amount: u8) -> String {
    match (shift, amount) {
        (Shift::Left, 0) => core(register).to_owned(),
        (Shift::RotateExtended, _) => format!("{}, rrx", core(register)),
        _ => format!("{}, {} #{amount}", core(register), shift.name()),
    }
}

/// A second operand.
pub(super) fn operand(operand: Operand) -> String {
    match operand {
        Operand::Immediate { value, .. } => format!("#{value}"),
        Operand::Register { register, shift, amount } => shifted(register, shift, amount),
        Operand::ShiftedBy { register, shift, amount } => {
            format!("{}, {} {}", core(register), shift.name(), core(amount))
        }
    }
}

/// An address at an offset in bytes from a register.
pub(super) fn at(base: Register, bytes: i64) -> String {
    if bytes == 0 { format!("[{}]", core(base)) } else { format!("[{}, #{bytes}]", core(base)) }
}

/// An address.
pub(super) fn address(address: Address) -> String {
    let base = core(address.base);
    match (address.offset, address.mode) {
        (Offset::Immediate(bytes), AddressMode::Offset) => at(address.base, bytes.into()),
        (Offset::Immediate(bytes), AddressMode::PreIndexed) => format!("[{base}, #{bytes}]!"),
        (Offset::Immediate(bytes), AddressMode::PostIndexed) => format!("[{base}], #{bytes}"),
        (Offset::Register(register, bits), _) => {
            format!("[{base}, {}]", shifted(register, Shift::Left, bits))
        }
    }
}
