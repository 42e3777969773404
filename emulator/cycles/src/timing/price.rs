//! The constant part of an instruction's cycles.

use super::pipeline::PrecedingLoad;
use super::registers::FloatSources;
use super::{Profile, Row, Timing, registers, rows};
use crate::instruction::{Instruction, Operation, PC, Width};

/// The constant part of an instruction's cycles, in one timing model.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Price {
    /// Own cycles, without the quotient of a division.
    pub(super) own: u16,
    /// Additional cycles if it jumps.
    pub(super) refill: u8,
    /// Cycles saved after a load of a core register, or of a float register.
    pub(super) pipelined: [u8; 2],
    /// Additional cycles for each further access of an unaligned access, and its width.
    pub(super) unaligned: Option<(u8, Width)>,
    /// For a division: whether it is signed.
    pub(super) division: Option<bool>,
    pub(super) is_if_then: bool,
    /// Whether it has four bytes at an address not divisible by 4.
    pub(super) is_misaligned: bool,
    /// Core registers in its address.
    pub(super) address: u16,
    /// Core registers that it computes.
    pub(super) computed: u16,
    /// Its effect on accesses that pipeline with it.
    pub(super) load: Option<PrecedingLoad>,
    /// Float registers that it reads.
    pub(super) float: Option<FloatSources>,
    /// The float register with a late result, the busy cycles of the unit, and the cycles until the result.
    pub(super) float_result: (u32, u8, u8),
    /// Bytes that it loads.
    pub(super) loaded_bytes: Option<u8>,
    /// Numbers of its first and last flash line.
    pub(super) lines: Option<(u32, u32)>,
}

impl Price {
    /// Whether it is a load.
    pub(super) fn is_load(&self) -> bool {
        self.loaded_bytes.is_some()
    }
}

impl Timing {
    /// The constant cost of an instruction.
    pub(crate) fn price(&self, instruction: &Instruction) -> Price {
        let operation = &instruction.operation;
        let base = rows::base(operation);
        let (mut own, busy) = self.overlapped(base);
        if let Some((each, count)) = rows::each(operation) {
            own += self.row(each) * count;
        }
        if is_literal(operation, base) {
            own += self.row(Row::LoadLiteral);
        }
        let loaded_bytes = rows::loaded_bytes(operation);
        let pipelines = rows::pipelines(operation);
        let pipelined = match base {
            _ if base != Row::StoreRegister && !pipelines => [0; 2],
            Row::FloatLoad => [self.byte(Row::FloatPipelined); 2],
            _ => [self.byte(Row::Pipelined), self.byte(Row::FloatPipelined)],
        };
        let division = match *operation {
            Operation::Divide { is_signed, .. } => Some(is_signed),
            _ => None,
        };
        Price {
            own: u16::try_from(own).unwrap_or(u16::MAX),
            refill: self.byte(if loaded_bytes.is_some() { Row::RefillBehindLoad } else { Row::Refill }),
            pipelined,
            unaligned: rows::unaligned(operation).map(|(row, width)| (self.byte(row), width)),
            division,
            is_if_then: matches!(operation, Operation::IfThen { .. }),
            is_misaligned: instruction.bytes == 4 && !instruction.address.is_multiple_of(4),
            address: registers::of_address(operation),
            computed: registers::computed(operation),
            load: pipelines.then(|| PrecedingLoad {
                registers: registers::loaded(operation),
                is_float: matches!(operation, Operation::FloatLoad { .. }),
            }),
            float: registers::float_sources(operation),
            float_result: (
                registers::float_result(operation),
                busy,
                busy.saturating_add(self.byte(Row::FloatResult)),
            ),
            loaded_bytes: loaded_bytes.map(|bytes| u8::try_from(bytes).unwrap_or(u8::MAX)),
            lines: match &self.profile {
                Profile::ZeroWait => None,
                Profile::Flash(flash) => flash.lines_of(instruction),
            },
        }
    }

    fn byte(&self, row: Row) -> u8 {
        self.cycles.get(row as usize).copied().unwrap_or(0)
    }
}

fn is_literal(operation: &Operation, base: Row) -> bool {
    matches!(base, Row::Load | Row::FloatLoad)
        && rows::immediate_offset(operation).is_some_and(|(base, _)| base == PC)
}
