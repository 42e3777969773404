//! A decoded instruction of the Cortex-M4F.
//!
//! Register numbers are 0 to 15 for the core (13: stack pointer; 14: link register; 15: program counter,
//! which reads as the instruction's address + 4) and 0 to 31 for single-precision floats. Source of all
//! encodings and semantics: the Armv7-M Architecture Reference Manual (DDI 0403E), chapters A5 to A7.

mod arithmetic;
mod bits;
mod branch;
mod decode;
mod display;
mod float;
mod it_state;
mod lanes;
mod memory;
mod multiple;
mod narrow;
mod operand;
mod operand_text;
mod wide;

pub use decode::{Instructions, Undecoded, decode, decode_all};
pub use it_state::ItState;

/// Number of a core register, 0 to 15.
pub type Register = u8;
/// Number of a single-precision register, 0 to 31.
pub type FloatRegister = u8;

/// The stack pointer.
pub const SP: Register = 13;
/// The link register.
pub const LR: Register = 14;
/// The program counter.
pub const PC: Register = 15;

/// An instruction and its address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Instruction {
    /// Address; even.
    pub address: u32,
    /// Size in bytes: 2 or 4.
    pub bytes: u8,
    /// Condition for execution, from the IT block or from the conditional branch itself.
    pub condition: Condition,
    /// Whether it is in an IT block; jumps to it are then not allowed.
    pub in_it_block: bool,
    /// The operation.
    pub operation: Operation,
}

impl Instruction {
    /// Address of the next instruction.
    #[must_use]
    pub fn next(&self) -> u32 {
        self.address.wrapping_add(u32::from(self.bytes))
    }
}

/// A condition on the flags N, Z, C and V.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Condition {
    /// Z.
    Equal,
    /// Not Z.
    NotEqual,
    /// C: higher or same, unsigned.
    CarrySet,
    /// Not C: lower, unsigned.
    CarryClear,
    /// N.
    Minus,
    /// Not N.
    Plus,
    /// V.
    Overflow,
    /// Not V.
    NoOverflow,
    /// C and not Z, unsigned.
    Higher,
    /// Not C, or Z, unsigned.
    LowerOrSame,
    /// N = V, signed.
    GreaterOrEqual,
    /// N ≠ V, signed.
    Less,
    /// Not Z and N = V, signed.
    Greater,
    /// Z, or N ≠ V, signed.
    LessOrEqual,
    /// Unconditional.
    Always,
}

/// Kind of shift. `RotateExtended` rotates by one bit through the carry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names are self-explanatory")]
pub enum Shift {
    Left,
    LogicalRight,
    ArithmeticRight,
    RotateRight,
    RotateExtended,
}

/// A second operand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operand {
    /// A number. `carry` is the carry out of its encoding, `None` if the flag does not change.
    Immediate {
        /// The expanded number.
        value: u32,
        /// Carry out of the expansion.
        carry: Option<bool>,
    },
    /// A register shifted by a constant: 0 to 31 bits, or 32 for right shifts. Left by 0 is the register
    /// itself.
    Register {
        /// The register.
        register: Register,
        /// Kind of shift.
        shift: Shift,
        /// Number of bits.
        amount: u8,
    },
    /// A register shifted by the low byte of another register (`LSL rd, rn, rm` and similar).
    ShiftedBy {
        /// The register.
        register: Register,
        /// Kind of shift, never `RotateExtended`.
        shift: Shift,
        /// The register that holds the amount.
        amount: Register,
    },
}

/// Operator of the first and the second operand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the manual's names in full")]
pub enum Arithmetic {
    And,
    BitClear,
    Or,
    OrNot,
    ExclusiveOr,
    Add,
    AddWithCarry,
    Subtract,
    SubtractWithCarry,
    ReverseSubtract,
}

/// Width of an access.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names are self-explanatory")]
pub enum Width {
    Byte,
    Half,
    Word,
}

impl Width {
    /// Number of bytes.
    #[must_use]
    pub const fn bytes(self) -> u8 {
        match self {
            Self::Byte => 1,
            Self::Half => 2,
            Self::Word => 4,
        }
    }
}

/// An address in memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Address {
    /// Base register. The value of [`PC`] as base is aligned down to 4.
    pub base: Register,
    /// Offset.
    pub offset: Offset,
    /// Whether the access uses the offset, and whether the base register is written back.
    pub mode: AddressMode,
}

/// An offset from a base register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Offset {
    /// Bytes.
    Immediate(i32),
    /// A register shifted left by 0 to 3 bits.
    Register(Register, u8),
}

/// Use of the offset and the base register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AddressMode {
    /// Base + offset is used; the base does not change.
    Offset,
    /// Base + offset is used and written back.
    PreIndexed,
    /// The base is used; base + offset is written back.
    PostIndexed,
}

/// Multiplication of halfwords or with a long result; see the manual's instruction of that name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the manual's names")]
pub enum LongMultiply {
    Umull,
    Smull,
    Umlal,
    Smlal,
    Umaal,
}

/// A half of a register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names are self-explanatory")]
pub enum Half {
    Bottom,
    Top,
}

/// One source, one result: reverses or counts bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the manual's names")]
pub enum BitOperation {
    Clz,
    Rbit,
    Rev,
    Rev16,
    Revsh,
}

/// Part of the (rotated) register that an extension uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the manual's names")]
pub enum Extend {
    Sxtb,
    Sxth,
    Uxtb,
    Uxth,
    Sxtb16,
    Uxtb16,
}

/// Two sources, one result: lanes of 8 or 16 bits, or saturation. The manual's names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the manual's names")]
pub enum Parallel {
    Uadd8,
    Uadd16,
    Usub8,
    Usub16,
    Sadd8,
    Sadd16,
    Ssub8,
    Ssub16,
    Uqadd8,
    Uqadd16,
    Uqsub8,
    Uqsub16,
    Qadd8,
    Qadd16,
    Qsub8,
    Qsub16,
    Qadd,
    Qsub,
    Qdadd,
    Qdsub,
    Sel,
}

/// A float operation with two sources; the multiply-accumulates also read the destination.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the manual's names")]
pub enum FloatArithmetic {
    Vadd,
    Vsub,
    Vmul,
    Vnmul,
    Vmla,
    Vmls,
    Vnmla,
    Vnmls,
    Vfma,
    Vfms,
    Vfnma,
    Vfnms,
    Vdiv,
}

/// A float operation with one source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the manual's names")]
pub enum FloatUnary {
    Vmov,
    Vabs,
    Vneg,
    Vsqrt,
}

/// Conversions between floats and integers, in float registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names contain source and target")]
pub enum FloatConvert {
    FromUnsigned,
    FromSigned,
    /// Rounds toward zero.
    ToUnsigned,
    /// Rounds toward zero.
    ToSigned,
    /// Rounds according to FPSCR, to nearest by default (`VCVTR`).
    ToUnsignedRounded,
    /// Rounds according to FPSCR, to nearest by default (`VCVTR`).
    ToSignedRounded,
    /// With this many fraction bits; 32-bit.
    FromFixedUnsigned(u8),
    FromFixedSigned(u8),
    ToFixedUnsigned(u8),
    ToFixedSigned(u8),
}

/// The operation of an instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "d, n, m, a, t are the manual's names for the destination and the sources")]
pub enum Operation {
    /// `MOV`, `MVN` (`inverted`), `MOVW`, and the shifts `LSL`, `LSR`, `ASR`, `ROR`, `RRX`.
    Move { d: Register, operand: Operand, inverted: bool, sets_flags: bool },
    /// `MOVT`.
    MoveTop { d: Register, value: u16 },
    /// `ADD`, `AND` and so on; without `d` the comparisons `CMP`, `CMN`, `TST`, `TEQ`. With an immediate
    /// operand, `n` = [`PC`] is `ADR`: aligned down to 4.
    Arithmetic { operator: Arithmetic, d: Option<Register>, n: Register, operand: Operand, sets_flags: bool },
    /// `MUL`; with `a` `MLA` (`a + n m`), or `MLS` (`a - n m`) when `subtracts`.
    Multiply { d: Register, n: Register, m: Register, a: Option<Register>, subtracts: bool, sets_flags: bool },
    /// 64-bit products.
    MultiplyLong { kind: LongMultiply, low: Register, high: Register, n: Register, m: Register },
    /// `SMULxy`, with `a` `SMLAxy`.
    MultiplyHalves { d: Register, n: (Register, Half), m: (Register, Half), a: Option<Register> },
    /// `SMULWy`, with `a` `SMLAWy`.
    MultiplyWide { d: Register, n: Register, m: (Register, Half), a: Option<Register> },
    /// `SMMUL`, `SMMLA`, `SMMLS`, rounded with `R`.
    MultiplyTop { d: Register, n: Register, m: Register, a: Option<Register>, subtracts: bool, rounds: bool },
    /// `SDIV`, `UDIV`.
    Divide { d: Register, n: Register, m: Register, is_signed: bool },
    /// `SXTB` and so on of `m` rotated right by 0, 8, 16 or 24 bits; with `n` `SXTAB` and so on.
    Extend { kind: Extend, d: Register, n: Option<Register>, m: Register, rotation: u8 },
    /// `UBFX`, `SBFX`.
    ExtractField { d: Register, n: Register, min_bit: u8, width: u8, is_signed: bool },
    /// `BFI`; without `n` `BFC`.
    InsertField { d: Register, n: Option<Register>, min_bit: u8, width: u8 },
    /// `CLZ`, `RBIT`, `REV`, ...
    Bits { kind: BitOperation, d: Register, m: Register },
    /// `SSAT`, `USAT` to `bits` bits of `n` shifted.
    Saturate { d: Register, bits: u8, is_signed: bool, n: Register, shift: Shift, amount: u8 },
    /// `PKHBT`, `PKHTB` (`top_first`).
    Pack { d: Register, n: Register, m: Register, amount: u8, top_first: bool },
    /// Operations on lanes.
    Parallel { kind: Parallel, d: Register, n: Register, m: Register },
    /// `LDR` and so on. `t` = [`PC`] jumps.
    Load { t: Register, address: Address, width: Width, is_signed: bool },
    /// `STR` and so on.
    Store { t: Register, address: Address, width: Width },
    /// `LDRD`; never with a register offset.
    LoadPair { t: Register, t2: Register, address: Address },
    /// `STRD`.
    StorePair { t: Register, t2: Register, address: Address },
    /// `LDM`, `POP`: registers by bit, lowest address first. `down`: the block ends below the base (`LDMDB`).
    LoadMultiple { n: Register, registers: u16, writes_back: bool, down: bool },
    /// `STM`, `PUSH`.
    StoreMultiple { n: Register, registers: u16, writes_back: bool, down: bool },
    /// `LDREX` and its narrow forms; the offset is in bytes.
    LoadExclusive { t: Register, n: Register, offset: u32, width: Width },
    /// `STREX`; `d` becomes 0 on success.
    StoreExclusive { d: Register, t: Register, n: Register, offset: u32, width: Width },
    /// `CLREX`.
    ClearExclusive,
    /// `B`, conditional or not.
    Branch { target: u32 },
    /// `BL`.
    BranchLink { target: u32 },
    /// `BX`, but not `MOV pc`.
    BranchRegister { m: Register },
    /// `BLX`.
    BranchLinkRegister { m: Register },
    /// `CBZ`, `CBNZ` (`on_nonzero`).
    CompareBranch { n: Register, on_nonzero: bool, target: u32 },
    /// `TBB`, `TBH` (`half`).
    TableBranch { n: Register, m: Register, half: bool },
    /// `IT`, with the number of instructions in its block, 1 to 4.
    IfThen { length: u8 },
    /// `NOP`, `YIELD`, `SEV` and other hints without effect on the program.
    Hint,
    /// `WFI`, `WFE`.
    Wait,
    /// `DMB`, `DSB`, `ISB`.
    Barrier,
    /// `CPSID i` (`disables`), `CPSIE i`; of FAULTMASK when `faults`.
    ChangeState { disables: bool, faults: bool },
    /// `MRS`: special register by its `SYSm` number.
    ReadSpecial { d: Register, special: u8 },
    /// `MSR`.
    WriteSpecial { n: Register, special: u8 },
    /// `SVC`.
    SupervisorCall(u8),
    /// `BKPT`; semihosting is 0xAB.
    Breakpoint(u8),
    /// `UDF`, which traps.
    Undefined(u8),
    /// `VADD.F32` and so on.
    Float { operator: FloatArithmetic, d: FloatRegister, n: FloatRegister, m: FloatRegister },
    /// `VABS.F32` and so on.
    FloatUnary { operator: FloatUnary, d: FloatRegister, m: FloatRegister },
    /// `VMOV.F32` of an immediate, as bits.
    FloatImmediate { d: FloatRegister, bits: u32 },
    /// `VCMP`, `VCMPE` (`quiet_signals`); without `m` a comparison with zero.
    FloatCompare { d: FloatRegister, m: Option<FloatRegister>, quiet_signals: bool },
    /// `VCVT` between single precision and integers.
    FloatConvert { kind: FloatConvert, d: FloatRegister, m: FloatRegister },
    /// `VLDR.32`; if `is_double`, `VLDR.64` to registers `d` and `d + 1`.
    FloatLoad { d: FloatRegister, is_double: bool, base: Register, offset: i32 },
    /// `VSTR`.
    FloatStore { d: FloatRegister, is_double: bool, base: Register, offset: i32 },
    /// `VLDM`, `VPOP`: `count` single registers from `d`.
    FloatLoadMultiple { n: Register, d: FloatRegister, count: u8, writes_back: bool, down: bool },
    /// `VSTM`, `VPUSH`.
    FloatStoreMultiple { n: Register, d: FloatRegister, count: u8, writes_back: bool, down: bool },
    /// `VMOV` from a core register.
    FloatFromCore { d: FloatRegister, t: Register },
    /// `VMOV` to a core register.
    FloatToCore { t: Register, m: FloatRegister },
    /// `VMOV` of two core registers to `d` and `d + 1`.
    FloatPairFromCore { d: FloatRegister, t: Register, t2: Register },
    /// `VMOV` of `m` and `m + 1` to two core registers.
    FloatPairToCore { t: Register, t2: Register, m: FloatRegister },
    /// `VMRS`; `t` = [`PC`] is the flags (`APSR_nzcv`).
    FloatStatusRead { t: Register },
    /// `VMSR`.
    FloatStatusWrite { t: Register },
}
