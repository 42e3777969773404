//! Operational amplifiers 1 to 3 (RM0440, chapter 25; field names from ST's `stm32g4xx_ll_opamp.h`): with
//! internal gain resistors, or as followers.

use super::ChipModel;
use super::clock::Clock;
use super::registers::Registers;
use super::violation::Access;

pub(super) const AMPLIFIERS: usize = 3;
/// Supply voltage and maximum output voltage, V.
pub(super) const SUPPLY_V: f64 = 3.3;

// Bits of CSR.
const EN: u32 = 0;
const INTOEN: u32 = 8;
const LOCK: u32 = 31;
/// FORCEVP, USERTRIM, CALON, CALSEL and the trimming.
const NOT_MODELLED: u32 = 0x1FF8_3812;
/// `VINMx` is connected to the end of the gain resistors, or to a filter capacitor.
const BIAS: u32 = 1;
/// Maximum startup time of an amplifier (`LL_OPAMP_DELAY_STARTUP_US`).
const START_S: f64 = 30e-6;

/// Pins of an amplifier.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pins {
    /// `VINP0`.
    input: (char, u32),
    /// `VINM0`.
    bias: (char, u32),
    pub(super) output: (char, u32),
}

/// DS12589 and DS12288, table of pins.
pub(super) const PINS: [Pins; AMPLIFIERS] = [
    Pins { input: ('A', 1), bias: ('A', 3), output: ('A', 2) },
    Pins { input: ('A', 7), bias: ('A', 5), output: ('A', 6) },
    Pins { input: ('B', 0), bias: ('B', 2), output: ('B', 1) },
];

#[derive(Debug, Clone)]
pub(super) struct Opamp {
    registers: Registers,
    /// Cycle in which the startup of each amplifier ends.
    starts: [u64; AMPLIFIERS],
}

impl Opamp {
    pub(super) fn new(part: ChipModel) -> Self {
        Self { registers: Registers::new(part, "OPAMP", "OPAMP"), starts: [0; AMPLIFIERS] }
    }

    pub(super) fn reset(&mut self) {
        self.registers.reset();
    }

    pub(super) fn registers(&self) -> &Registers {
        &self.registers
    }

    pub(super) fn read(&self, offset: u32, access: &mut Access<'_>) -> u32 {
        self.registers.read(offset, access)
    }

    pub(super) fn write(&mut self, offset: u32, value: u32, clock: &Clock, access: &mut Access<'_>) {
        let name = self.registers.name(offset);
        let before = self.registers.get(offset);
        if before >> LOCK & 1 == 1 {
            access.violates(format!("{name} is written while it is locked"));
            return;
        }
        self.registers.write(offset, value, access);
        let is_known = match self.starts.get_mut((offset / 4) as usize) {
            Some(start) => {
                if value & !before & 1 << EN != 0 {
                    *start = access.at.cycle + clock.cycles(START_S);
                }
                value & NOT_MODELLED == 0
            }
            // Amplifiers 4 to 6, and input selection by a timer.
            None => value & !(1 << LOCK) == 0,
        };
        if !is_known {
            access.violates(format!("{name} is set to {value:#010x}: not modelled"));
        }
    }

    /// Whether an amplifier, by its index, drives its pin.
    pub(super) fn drives_pin(&self, place: usize) -> bool {
        self.has(place, EN) && !self.has(place, INTOEN)
    }

    /// Whether an amplifier's output is connected only to its ADC.
    pub(super) fn drives_converter(&self, place: usize) -> bool {
        self.has(place, EN) && self.has(place, INTOEN)
    }

    fn control(place: usize) -> u32 {
        u32::try_from(place).map_or(0, |place| 4 * place)
    }

    fn has(&self, place: usize, bit: u32) -> bool {
        self.registers.has(Self::control(place), bit)
    }

    /// Output voltage of an amplifier that is on, from the voltages at its pins, V.
    ///
    /// # Errors
    /// Description of an unmodelled or invalid setting.
    pub(super) fn output_v(
        &self,
        place: usize,
        now: u64,
        pin_v: impl Fn((char, u32)) -> Result<f64, String>,
    ) -> Result<f64, String> {
        let name = format!("OPAMP{}", place + 1);
        let field = |first, width| self.registers.bits(Self::control(place), first, width);
        let pins = PINS.get(place).ok_or("no such amplifier")?;
        if self.starts.get(place).is_some_and(|start| *start > now) {
            return Err(format!("{name} is sampled less than 30 us after its start"));
        }
        if field(2, 2) != 0 {
            return Err(format!("{name}'s VP_SEL is {}: not modelled", field(2, 2)));
        }
        let input_v = pin_v(pins.input)?;
        let output_v = match (field(5, 2), field(14, 3), field(17, 2)) {
            (3, _, _) => input_v,
            (2, code @ 0..=5, connection) => {
                let gain = f64::from(2u32 << code);
                // The gain resistors end at ground, or at VINM0.
                let end_v = if connection & BIAS == 0 { 0.0 } else { pin_v(pins.bias)? };
                gain * input_v - (gain - 1.0) * end_v
            }
            (inverting, code, _) => {
                return Err(format!("{name} with VM_SEL {inverting} and gain code {code}: not modelled"));
            }
        };
        Ok(output_v.clamp(0.0, SUPPLY_V))
    }
}
