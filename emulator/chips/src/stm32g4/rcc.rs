//! Reset and clock control (RM0440, chapter 7).

use super::ChipModel;
use super::clock::Clock;
use super::registers::Registers;
use super::violation::Access;

const CR: u32 = 0x00;
const CFGR: u32 = 0x08;
const PLLCFGR: u32 = 0x0C;
const AHB1RSTR: u32 = 0x28;
const APB2RSTR: u32 = 0x40;
const CCIPR: u32 = 0x88;
const CCIPR2: u32 = 0x9C;
const CSR: u32 = 0x94;
const CRRCR: u32 = 0x98;

// Enable bits of CR; the ready bit is one or two bits above.
const HSION: u32 = 8;
const HSEON: u32 = 16;
const PLLON: u32 = 24;
/// Field of CCIPR.
const FDCANSEL: u32 = 24;
/// Bit of PLLCFGR.
const PLLQEN: u32 = 20;
// Bits of CSR.
const RMVF: u32 = 23;
const PIN: u32 = 26;
const POWER: u32 = 27;
const PROGRAM: u32 = 28;
const WATCHDOG: u32 = 29;

const HSI_HZ: f64 = 16e6;
/// Startup times of the oscillators: typical values of the data sheet.
const CRYSTAL_S: f64 = 2e-3;
const PLL_S: f64 = 40e-6;
const OTHERS_S: f64 = 5e-6;
/// A switch from below to above this frequency takes two steps, with a pause between them ("System clock
/// (SYSCLK) selection").
const SMALL_STEP_HZ: f64 = 80e6;
const PAUSE_S: f64 = 1e-6;

/// Cause of the last reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Cause {
    PowerOn,
    Program,
    Watchdog,
    Pin,
}

/// A ready bit that will be set.
#[derive(Debug, Clone, Copy)]
struct Ready {
    register: u32,
    bit: u32,
    at_cycle: u64,
}

#[derive(Debug, Clone)]
pub(super) struct Rcc {
    registers: Registers,
    /// Frequency of the board's crystal; `None` if the crystal does not oscillate.
    pub(super) crystal_hz: Option<f64>,
    coming: Vec<Ready>,
    /// Time of the last switch to a fast system clock, while the AHB is still divided.
    stepped_at_s: Option<f64>,
}

impl Rcc {
    pub(super) fn new(part: ChipModel, crystal_hz: Option<f64>) -> Self {
        let mut rcc = Self {
            registers: Registers::new(part, "RCC", "RCC"),
            crystal_hz,
            coming: Vec::new(),
            stepped_at_s: None,
        };
        rcc.reset(Cause::PowerOn);
        rcc
    }

    /// Resets all registers except the reset flags, which the program clears. Every reset also sets the flag
    /// of the reset pin.
    pub(super) fn reset(&mut self, cause: Cause) {
        let flags = self.registers.get(CSR) & 0xFE00_0000;
        self.registers.reset();
        let added = match cause {
            Cause::PowerOn => 1 << POWER | 1 << PIN,
            Cause::Program => 1 << PROGRAM | 1 << PIN,
            Cause::Watchdog => 1 << WATCHDOG | 1 << PIN,
            Cause::Pin => 1 << PIN,
        };
        let flags = if cause == Cause::PowerOn { 0 } else { flags };
        self.registers.set(CSR, flags | added);
        self.coming.clear();
        self.stepped_at_s = None;
    }

    pub(super) fn registers(&self) -> &Registers {
        &self.registers
    }

    /// Whether a bit of an enable register is set, so that its peripheral has a clock.
    pub(super) fn enables(&self, register: u32, bit: u32) -> bool {
        self.registers.has(register, bit)
    }

    pub(super) fn read(&mut self, offset: u32, access: &mut Access<'_>) -> u32 {
        self.registers.read(offset, access)
    }

    /// Writes a register. For a reset register, returns the register and its bits: the caller resets the
    /// peripherals.
    pub(super) fn write(
        &mut self,
        offset: u32,
        value: u32,
        clock: &Clock,
        access: &mut Access<'_>,
    ) -> Option<(u32, u32)> {
        let before = self.registers.get(offset);
        match offset {
            CR => {
                let ready = 1 << (HSION + 2) | 1 << (HSEON + 1) | 1 << (PLLON + 1);
                self.registers.write(offset, value & !ready | before & ready, access);
                self.switch(CR, HSION, HSION + 2, OTHERS_S, clock, access);
                if self.crystal_hz.is_some() || value >> HSEON & 1 == 0 {
                    self.switch(CR, HSEON, HSEON + 1, CRYSTAL_S, clock, access);
                }
                self.switch(CR, PLLON, PLLON + 1, PLL_S, clock, access);
            }
            CFGR => {
                self.registers.write(offset, value & !0xC | before & 0xC, access);
                self.select(before, value, clock, access);
            }
            PLLCFGR => {
                if self.registers.has(CR, PLLON) {
                    access.violates("RCC_PLLCFGR is written while the PLL is on");
                }
                self.registers.write(offset, value, access);
            }
            CSR => {
                let flags = if value >> RMVF & 1 == 1 { 0 } else { before & 0xFE00_0000 };
                self.registers.write(offset, value & 1 | flags | before & 2, access);
                self.switch(CSR, 0, 1, OTHERS_S, clock, access);
            }
            CRRCR => {
                self.registers.write(offset, value & !2 | before & 2, access);
                self.switch(CRRCR, 0, 1, OTHERS_S, clock, access);
            }
            AHB1RSTR..=APB2RSTR => {
                self.registers.write(offset, value, access);
                return Some((offset, value));
            }
            _ => self.registers.write(offset, value, access),
        }
        None
    }

    /// Updates the ready bit of an oscillator that was switched on or off.
    fn switch(
        &mut self,
        register: u32,
        on: u32,
        ready: u32,
        after_s: f64,
        clock: &Clock,
        access: &mut Access<'_>,
    ) {
        let (is_on, is_ready) = (self.registers.has(register, on), self.registers.has(register, ready));
        self.coming.retain(|coming| (coming.register, coming.bit) != (register, ready) || is_on);
        if !is_on && is_ready {
            self.registers.set_bit(register, ready, false);
            if register == CR && self.source() == Some(on) {
                access.violates(format!(
                    "{} switches off the processor's clock source",
                    self.registers.name(CR)
                ));
            }
        } else if is_on && !is_ready && !self.coming.iter().any(|coming| coming.bit == ready) {
            let at_cycle = access.at.cycle + clock.cycles(after_s);
            self.coming.push(Ready { register, bit: ready, at_cycle });
        }
    }

    /// Enable bit in CR of the oscillator that is the system clock.
    fn source(&self) -> Option<u32> {
        match self.registers.bits(CFGR, 2, 2) {
            1 => Some(HSION),
            2 => Some(HSEON),
            3 => Some(PLLON),
            _ => None,
        }
    }

    fn select(&mut self, before: u32, value: u32, clock: &Clock, access: &mut Access<'_>) {
        let now_s = clock.seconds_at(access.at.cycle);
        let ready = match value & 3 {
            1 => self.registers.has(CR, HSION + 2),
            2 => self.registers.has(CR, HSEON + 1),
            3 => self.registers.has(CR, PLLON + 1),
            _ => false,
        };
        let old_hz = self.system_hz();
        if ready {
            self.registers.set(CFGR, self.registers.get(CFGR) & !0xC | (value & 3) << 2);
        } else {
            access.violates("RCC_CFGR selects a clock that is not ready");
        }
        let new_hz = self.system_hz();
        let divides = |cfgr: u32| cfgr >> 7 & 1 == 1;
        if old_hz <= SMALL_STEP_HZ && new_hz > SMALL_STEP_HZ {
            if !divides(value) {
                access.violates(format!(
                    "the system clock switches to {} MHz in one step: divide the AHB by 2 first",
                    new_hz / 1e6
                ));
            }
            self.stepped_at_s = Some(now_s);
        }
        if divides(before) && !divides(value) {
            if self.stepped_at_s.is_some_and(|then_s| now_s - then_s < PAUSE_S) {
                access
                    .violates("the AHB division ends less than 1 us after the switch to a fast system clock");
            }
            self.stepped_at_s = None;
        }
        if value >> 8 & 7 > 3 || value >> 11 & 7 > 3 {
            access.violates("RCC_CFGR divides an APB: not modelled");
        }
    }

    /// Frequency of the system clock.
    pub(super) fn system_hz(&self) -> f64 {
        match self.registers.bits(CFGR, 2, 2) {
            2 => self.crystal_hz.unwrap_or(0.0),
            3 => self.pll_r_hz(),
            _ => HSI_HZ,
        }
    }

    /// Frequency of the processor and all buses.
    pub(super) fn bus_hz(&self) -> f64 {
        let divider = match self.registers.bits(CFGR, 4, 4) {
            code @ 8..=11 => f64::from(2 << (code - 8)),
            code @ 12.. => f64::from(64 << (code - 12)),
            _ => 1.0,
        };
        self.system_hz() / divider
    }

    /// Whether the ADCs' own clock is the system clock (CCIPR.ADC12SEL), and equal to the bus clock.
    pub(super) fn clocks_converters(&self) -> bool {
        self.registers.bits(CCIPR, 28, 2) == 2 && self.registers.bits(CFGR, 4, 4) < 8
    }

    /// Frequency of PLL output R, a source of the system clock.
    fn pll_r_hz(&self) -> f64 {
        self.vco_hz() / f64::from(2 * (self.registers.bits(PLLCFGR, 25, 2) + 1))
    }

    /// Frequency of PLL output Q, a clock source of FDCAN.
    pub(super) fn pll_q_hz(&self) -> f64 {
        self.vco_hz() / f64::from(2 * (self.registers.bits(PLLCFGR, 21, 2) + 1))
    }

    /// Frequency of FDCAN's clock; `None` while the clock is off.
    pub(super) fn can_hz(&self) -> Option<f64> {
        let is_ready = |on: u32| self.registers.has(CR, on + 1);
        match self.registers.bits(CCIPR, FDCANSEL, 2) {
            0 => self.crystal_hz.filter(|_| is_ready(HSEON)),
            1 => (is_ready(PLLON) && self.registers.has(PLLCFGR, PLLQEN)).then(|| self.pll_q_hz()),
            2 => Some(self.bus_hz()),
            _ => None,
        }
    }

    /// Whether an I²C, by its index, runs on the bus clock.
    pub(super) fn clocks_i2c_by_bus(&self, place: usize) -> bool {
        let (register, bit) =
            [(CCIPR, 12), (CCIPR, 14), (CCIPR, 16), (CCIPR2, 0)].get(place).copied().unwrap_or((CCIPR2, 0));
        self.registers.bits(register, bit, 2) == 0
    }

    fn vco_hz(&self) -> f64 {
        self.pll_input_hz() * f64::from(self.registers.bits(PLLCFGR, 8, 7))
    }

    fn pll_input_hz(&self) -> f64 {
        let source = match self.registers.bits(PLLCFGR, 0, 2) {
            3 => self.crystal_hz.unwrap_or(0.0),
            2 => HSI_HZ,
            _ => 0.0,
        };
        source / f64::from(self.registers.bits(PLLCFGR, 4, 4) + 1)
    }

    /// Violation by the PLL if it is on and out of range (data sheet, "PLL characteristics").
    pub(super) fn pll_fault(&self) -> Option<String> {
        let (input, vco) = (self.pll_input_hz() / 1e6, self.vco_hz() / 1e6);
        let is_in_range = (2.66..=16.0).contains(&input) && (96.0..=344.0).contains(&vco);
        let is_on = self.registers.has(CR, PLLON);
        (is_on && !is_in_range)
            .then(|| format!("PLL out of range: input {input} MHz (2.66 to 16), VCO {vco} MHz (96 to 344)"))
    }

    pub(super) fn advance(&mut self, now: u64) {
        let (due, later) = self.coming.iter().partition(|coming| coming.at_cycle <= now);
        self.coming = later;
        for Ready { register, bit, .. } in due {
            self.registers.set_bit(register, bit, true);
        }
    }

    pub(super) fn next_event(&self) -> u64 {
        self.coming.iter().map(|coming| coming.at_cycle).min().unwrap_or(u64::MAX)
    }
}
