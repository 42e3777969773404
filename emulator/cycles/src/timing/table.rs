//! The cycle table of the Cortex-M4F: a row per kind of instruction or hazard.
//!
//! Sources, by short name:
//! - `TRM 3.3`: Arm, Cortex-M4 Technical Reference Manual r0p1 (`100166_0001`), 3.3.1 table of processor instructions,
//!   3.3.2 load/store timings; TI reprints both in SWCU185 and SWCU192.
//! - `TRM 7`: the same, 7.2.3 floating-point instructions, with its notes.
//! - `GCC`: the scheduler descriptions `gcc/config/arm/cortex-m4.md` and `cortex-m4-fpu.md`.
//! - `seen`: observed on chips by several authors, not in Arm's tables.

use super::Column;

/// Cycles of a row: added, or saved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cost {
    /// The most common value.
    pub typical: u8,
    /// The maximum.
    pub upper: u8,
    /// The instructions it applies to, in the manuals' terms.
    pub instructions: &'static str,
    /// Source of both values.
    pub source: &'static str,
}

impl Cost {
    /// The cost in a column, in cycles.
    #[must_use]
    pub fn of(&self, column: Column) -> u8 {
        match column {
            Column::Likely => self.typical,
            Column::Upper => self.upper,
        }
    }
}

macro_rules! rows {
    ($($row:ident, $typical:literal, $upper:literal, $instructions:literal, $source:literal;)*) => {
        /// A row of the table.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Row {
            $(#[doc = concat!($instructions, ".")] $row,)*
        }

        impl Row {
            /// Every row, in the table's order.
            pub const ALL: &[Self] = &[$(Self::$row),*];
            pub(super) const COUNT: usize = Self::ALL.len();

            /// Cost and source of the row.
            #[must_use]
            pub fn cost(self) -> Cost {
                match self {
                    $(Self::$row => Cost {
                        typical: $typical, upper: $upper, instructions: $instructions, source: $source,
                    },)*
                }
            }
        }
    };
}

rows! {
    // Data processing.
    Data, 1, 1, "`MOV`, `ADD`, `CMP`, shifts, `CLZ`, `UBFX`, `SXTB`, `SSAT`, lanes", "TRM 3.3: 1";
    Multiply, 1, 1, "`MUL`, `MLA`, `MLS`, `UMULL`, `SMLAL`, `SMLAxy`, `SMMUL`", "TRM 3.3: 1";
    DivideFewest, 2, 2, "`SDIV`, `UDIV`: minimum", "TRM 3.3: 2 to 12 by leading zeros and ones";
    DivideQuotient, 10, 10, "`SDIV`, `UDIV`: added for a 32-bit quotient (upper value: any), less for a shorter quotient",
        "TRM 3.3: 2 to 12; proportion estimated";
    Skipped, 1, 1, "an instruction whose condition fails; a branch not taken", "TRM 3.3: B<cc> 1 or 1 + P";
    IfThen, 0, 1, "`IT`", "TRM 3.3: 1, can be folded away";

    // Memory, core registers.
    Load, 2, 2, "`LDR`, `LDRB`, `LDRH`, `LDRSB`, `LDRSH`, `LDREX`, `STREX`", "TRM 3.3: 2";
    Pipelined, 1, 1, "saved by a load, or a register-offset store, after a load unrelated to its address",
        "TRM 3.3: neighbouring loads and stores pipeline";
    LoadLiteral, 0, 1, "added to a load relative to PC", "TRM 3.3: may add 1 (fetch contention)";
    StoreImmediate, 1, 1, "`STR Rt, [Rn, #imm]`, `STRB`, `STRH`", "TRM 3.3: always 1";
    StoreRegister, 2, 2, "`STR Rt, [Rn, Rm]`, `STRB`, `STRH`", "TRM 3.3: 2; GCC: 2";
    StoreWriteBack, 1, 2, "`STR Rt, [Rn, #imm]!` and `STR Rt, [Rn], #imm`",
        "TRM 3.3: 2 in the table, 1 in the text";
    MultipleFirst, 1, 1, "`LDM`, `STM`, `PUSH`, `POP`, `LDRD`, `STRD`", "TRM 3.3: 1 + N";
    MultipleEach, 1, 1, "each register of a multiple access", "TRM 3.3: 1 + N";
    UnalignedLoad, 1, 1, "each further access of an unaligned load", "TRM 3.3: 1 or 2 more";
    UnalignedStore, 0, 1, "each further access of an unaligned store", "TRM 3.3: the write buffer hides it";
    AddressDependent, 1, 1, "added to an access whose address the preceding data processing computed",
        "TRM 3.3: one stall cycle";
    ClearExclusive, 1, 1, "`CLREX`", "TRM 3.3: 1";

    // Program flow.
    Branch, 1, 1, "`B`, `BL`, `BX`, `BLX`, `CBZ`", "TRM 3.3: 1, plus P if taken";
    Refill, 2, 3, "P: added to a jump", "GCC: a branch takes 3; TRM 3.3: P is 1 to 3";
    RefillBehindLoad, 3, 3, "P: added to a load of PC", "TRM 3.3: LDR PC takes at least 5, TBB at least 6";
    TableBranch, 3, 3, "`TBB`, `TBH`", "TRM 3.3: two for the load, one for the sum";
    MisalignedTarget, 1, 0, "added to a four-byte jump target at an address not divisible by 4",
        "seen; included in P in the upper column";
    MisalignedRun, 1, 1, "added to the third consecutive misaligned wide instruction (upper value: and each later one)",
        "seen; several in runs that mix memory accesses with other instructions";

    // Processor.
    Hint, 1, 1, "`NOP`, `SEV`, `YIELD`; `WFI`, `WFE` without the wait time", "TRM 3.3: 1, plus W";
    Barrier, 1, 4, "`DMB`, `DSB`, `ISB`", "TRM 3.3: 1 + B; B can be 0 for DMB and DSB, and is P for ISB";
    SpecialRegister, 1, 2, "`MRS`, `MSR`, `CPSID`, `CPSIE`", "TRM 3.3: 1 or 2";
    Trap, 1, 1, "`SVC`, `BKPT`, `UDF` without their exception",
        "TRM 3.3: no figure; minimum of any instruction";

    // Floating-point unit.
    Float, 1, 1, "`VADD`, `VSUB`, `VMUL`, `VNMUL`, `VCVT`, `VCMP`, `VABS`, `VNEG`, `VMOV` of floats",
        "TRM 7: 1";
    FloatMultiplyAccumulate, 3, 3, "`VMLA`, `VMLS`, `VFMA`, ...; typical, integer instructions overlap all but 1",
        "TRM 7: 3; GCC: overlapped";
    FloatDivide, 14, 14, "`VDIV`, `VSQRT`; typical, integer instructions overlap all but 1",
        "TRM 7: 14, 1 if no float instruction follows";
    FloatResult, 1, 1, "until a result of arithmetic or conversion is available; 1 less for an addend",
        "TRM 7: one more if the next instruction uses it";
    FloatToCore, 1, 2, "`VMOV` between a core and a float register", "TRM 7: 1; GCC: 2";
    FloatPairToCore, 2, 2, "`VMOV` between two core and two float registers", "TRM 7: 2";
    FloatStatus, 1, 2, "`VMRS`, `VMSR`", "TRM 7: 1; upper like FloatToCore";
    FloatLoad, 2, 2, "`VLDR.32`", "TRM 7: 2";
    FloatPipelined, 1, 0, "saved by a load after another load, if either is `VLDR.32`",
        "GCC: pipelines; TRM: not specified";
    FloatStore, 1, 2, "`VSTR.32`", "GCC: 1; TRM 7: 2";
    FloatLoadDouble, 3, 3, "`VLDR.64`", "TRM 7: 3";
    FloatStoreDouble, 3, 3, "`VSTR.64`", "TRM 7: 3";
    FloatMultipleFirst, 1, 1, "`VLDM`, `VSTM`, `VPUSH`, `VPOP`", "TRM 7: 1 + N";
    FloatMultipleEach, 1, 1, "each single register of a multiple access", "TRM 7: 1 + N, 1 + 2 N for doubles";

    // Interrupts.
    ExceptionEntry, 12, 12, "from the request to the first instruction of the handler",
        "TRM 3.9: 12 at 0 wait states";
    ExceptionExit, 10, 12, "from the handler's return to the interrupted instruction",
        "TRM 3.9: 10; seen: up to 12";
    TailChaining, 6, 6, "from a handler's return to the next handler", "TRM 3.9: 6";
    LazyStacking, 0, 17, "added to a handler's first float instruction, if the interrupted code used floats",
        "Arm AN298: S0 to S15 and FPSCR are stored then";
}
