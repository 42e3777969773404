//! Bit rates, and the tolerated difference between two nodes (ISO 11898-1; Bosch, "The Configuration of the
//! CAN Bit Timing").

use crate::stm32g4::registers::Registers;

use super::layout::{CKDIV, DBTP, NBTP};

/// Timing of a bit at one of the two rates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bit {
    /// Duration of a bit.
    pub(crate) duration_s: f64,
    /// Time from the start of the bit to its sample point.
    pub(crate) sample_s: f64,
    /// Relative tolerance of its duration.
    tolerance: f64,
}

impl Bit {
    fn new(quantum_s: f64, [before, behind, jump]: [u32; 3]) -> Self {
        let quanta = f64::from(1 + before + behind);
        let (before_sample, behind, jump) = (f64::from(1 + before), f64::from(behind), f64::from(jump));
        // Ten bits between two resynchronizing edges; 13 bits to the sixth bit of an error flag.
        let by_jump = jump / (2.0 * 10.0 * quanta);
        let by_flag = behind.min(before_sample - 1.0) / (2.0 * (13.0 * quanta - behind));
        Self {
            duration_s: quanta * quantum_s,
            sample_s: before_sample * quantum_s,
            tolerance: by_jump.min(by_flag),
        }
    }

    /// Whether nodes with these two bit timings can communicate.
    pub(crate) fn fits(&self, other: &Self) -> bool {
        let apart = (self.duration_s / other.duration_s - 1.0).abs();
        apart <= self.tolerance + other.tolerance
    }
}

/// Both rates of a controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rates {
    pub(crate) nominal: Bit,
    pub(crate) data: Bit,
}

impl Rates {
    /// Reads the bit rates from registers, at this clock frequency.
    pub(super) fn new(registers: &Registers, kernel_hz: f64) -> Self {
        let divider = match registers.bits(CKDIV, 0, 4) {
            0 => 1,
            code => 2 * code,
        };
        let quantum_s = |prescaler: u32| f64::from(divider * (prescaler + 1)) / kernel_hz;
        let field = |register: u32, first: u32, width: u32| registers.bits(register, first, width) + 1;
        Self {
            nominal: Bit::new(
                quantum_s(registers.bits(NBTP, 16, 9)),
                [field(NBTP, 8, 8), field(NBTP, 0, 7), field(NBTP, 25, 7)],
            ),
            data: Bit::new(
                quantum_s(registers.bits(DBTP, 16, 5)),
                [field(DBTP, 8, 5), field(DBTP, 4, 4), field(DBTP, 0, 4)],
            ),
        }
    }
}
