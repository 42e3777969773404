//! Power control (RM0440, chapter 6), and the clock limits of core voltage and flash.

use super::ChipModel;
use super::registers::Registers;
use super::violation::Access;

const CR1: u32 = 0x00;
const CR5: u32 = 0x80;
/// Bit of CR5; 1 means no boost.
const R1MODE: u32 = 8;

#[derive(Debug, Clone)]
pub(super) struct Pwr {
    registers: Registers,
}

impl Pwr {
    pub(super) fn new(part: ChipModel) -> Self {
        Self { registers: Registers::new(part, "PWR", "PWR") }
    }

    pub(super) fn reset(&mut self) {
        self.registers.reset();
    }

    pub(super) fn registers(&self) -> &Registers {
        &self.registers
    }

    pub(super) fn read(&mut self, offset: u32, access: &mut Access<'_>) -> u32 {
        self.registers.read(offset, access)
    }

    pub(super) fn write(&mut self, offset: u32, value: u32, access: &mut Access<'_>) {
        self.registers.write(offset, value, access);
    }

    /// Violation by a clock frequency: above the limit of the core voltage range ("Dynamic voltage scaling
    /// management"), or too few flash wait states (table "Number of wait states according to CPU clock (HCLK)
    /// frequency").
    pub(super) fn clock_fault(&self, bus_hz: f64, wait_states: u32) -> Option<String> {
        let (range, max_mhz, step_mhz) =
            match (self.registers.bits(CR1, 9, 2), self.registers.has(CR5, R1MODE)) {
                (1, false) => ("voltage range 1 with boost", 170.0, 34.0),
                (1, true) => ("voltage range 1 without boost", 150.0, 30.0),
                (2, _) => ("voltage range 2", 26.0, 12.0),
                _ => return Some("PWR_CR1.VOS selects no voltage range".to_owned()),
            };
        let bus_mhz = bus_hz / 1e6;
        let needed = (bus_mhz / step_mhz - 1e-6).floor();
        if bus_mhz > max_mhz {
            Some(format!("the processor runs at {bus_mhz} MHz, but {range} allows at most {max_mhz} MHz"))
        } else if f64::from(wait_states) < needed {
            Some(format!("flash has {wait_states} wait states, but {bus_mhz} MHz in {range} needs {needed}"))
        } else {
            None
        }
    }
}
