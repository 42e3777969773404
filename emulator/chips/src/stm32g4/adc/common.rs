//! Common registers and clock of ADC1 and ADC2 (RM0440, 21.4.3 and 21.8).

use super::super::ChipModel;
use super::super::registers::Registers;
use super::super::violation::Access;

const CSR: u32 = 0x00;
const CCR: u32 = 0x08;
const CDR: u32 = 0x0C;
// Bits of CCR.
const DUAL_AND_DMA: u32 = 0xEF1F;
const CKMODE: u32 = 16;
const PRESC: u32 = 18;

/// Dividers of PRESC.
const PRESCALERS: [u64; 12] = [1, 2, 4, 6, 8, 10, 12, 16, 32, 64, 128, 256];
/// Latency from a trigger to the start of sampling by CKMODE, in eighths of a tick (data sheet, tLATR; for
/// the asynchronous clock, the mean of 1.5 to 2.5 ticks).
const LATENCY_EIGHTHS: [u64; 4] = [16, 16, 18, 17];

/// ADC clock, in bus cycles.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(in super::super) struct Ticks {
    divider: u64,
    /// Time from a trigger to the start of sampling, in cycles.
    pub(super) latency: u64,
    pub(super) hz: f64,
}

impl Ticks {
    pub(super) fn cycles(self, ticks: u64) -> u64 {
        ticks * self.divider
    }

    /// Cycles of half ticks, rounded up.
    pub(super) fn half_cycles(self, halves: u64) -> u64 {
        (halves * self.divider).div_ceil(2)
    }
}

/// The common registers.
#[derive(Debug, Clone)]
pub(in super::super) struct Common {
    registers: Registers,
}

impl Common {
    pub(in super::super) fn new(part: ChipModel) -> Self {
        Self { registers: Registers::new(part, "ADC_COMMON", "ADC12") }
    }

    pub(in super::super) fn reset(&mut self) {
        self.registers.reset();
    }

    pub(in super::super) fn registers(&self) -> &Registers {
        &self.registers
    }

    /// Reads a register. `flags`: the flags of both ADCs.
    pub(in super::super) fn read(&self, offset: u32, flags: [u32; 2], access: &mut Access<'_>) -> u32 {
        match offset {
            CSR => flags[0] | flags[1] << 16,
            CDR => {
                access.violates("ADC12_CDR is read: dual mode is not modelled");
                0
            }
            _ => self.registers.read(offset, access),
        }
    }

    /// Writes a register. `is_on`: an ADC is on.
    pub(in super::super) fn write(&mut self, offset: u32, value: u32, is_on: bool, access: &mut Access<'_>) {
        if is_on {
            access.violates(format!("{} is written while an ADC is on", self.registers.name(offset)));
        }
        self.registers.write(offset, value, access);
        if offset == CCR && value & DUAL_AND_DMA != 0 {
            access.violates("ADC12_CCR selects dual mode or DMA: not modelled");
        }
    }

    /// The ADC clock. `has_system_clock`: RCC selects the system clock as the ADCs' own clock.
    ///
    /// # Errors
    /// Description of an unmodelled or reserved setting.
    pub(in super::super) fn ticks(&self, bus_hz: f64, has_system_clock: bool) -> Result<Ticks, String> {
        let mode = self.registers.bits(CCR, CKMODE, 2) as usize;
        let divider = match mode {
            1 => 1,
            2 => 2,
            3 => 4,
            _ if !has_system_clock => {
                return Err(
                    "the ADC clock is neither the bus clock nor the system clock: not modelled".to_owned()
                );
            }
            _ => PRESCALERS
                .get(self.registers.bits(CCR, PRESC, 4) as usize)
                .copied()
                .ok_or("ADC12_CCR.PRESC is reserved")?,
        };
        let eighths = LATENCY_EIGHTHS.get(mode).copied().unwrap_or(0);
        #[expect(clippy::cast_precision_loss, reason = "at most 256")]
        Ok(Ticks { divider, latency: (divider * eighths).div_ceil(8), hz: bus_hz / divider as f64 })
    }
}
