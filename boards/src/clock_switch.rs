//! Switches an STM32G4 from its crystal to 168 or 170 MHz with boosted core voltage.
//!
//! Above 150 MHz the core needs the boosted voltage range, and the frequency must rise in two steps. The
//! sequence follows RM0440, "Dynamic voltage scaling management" and "System clock (SYSCLK) selection":
//!
//! 1. the AHB divides by 2;
//! 2. the voltage is boosted, the flash gets 4 wait states;
//! 3. the system clock switches to the PLL: the processor runs at half of its frequency;
//! 4. at least 1 us passes;
//! 5. the AHB divides by 1.
//!
//! The driver library cannot do this: it clears the wrong bit for the boost (`R1MODE` is bit 8 of `PWR_CR5` in ST's
//! `stm32g474xx.h`, and bit 0 in stm32-metapac 21), and it divides by 1 in the same write that switches the clock.

#[cfg(test)]
mod model;

/// CAN FD at 1 and 4 Mbit/s divides this frequency.
pub const CAN_4_MBIT_CLOCK_HZ: u32 = 168_000_000;
/// CAN FD at 1 and 5 Mbit/s, used by moteus drives, divides this frequency.
pub const CAN_5_MBIT_CLOCK_HZ: u32 = 170_000_000;
/// Frequency of processor, buses and timers.
pub const CLOCK_HZ: u32 = if cfg!(feature = "moteus") { CAN_5_MBIT_CLOCK_HZ } else { CAN_4_MBIT_CLOCK_HZ };
/// Input frequency of the PLL.
const PLL_IN_HZ: u32 = 4_000_000;
const PLL_DIVIDES: u32 = 2;
/// More than 1 us at half of either frequency.
const PAUSE_CYCLES: u32 = CAN_5_MBIT_CLOCK_HZ / 1_000_000;

/// A register that the switch reads or writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Register {
    /// `RCC_CR`: clocks on and ready.
    ClockControl,
    /// `RCC_PLLCFGR`.
    PllConfiguration,
    /// `RCC_CFGR`: system clock and prescalers.
    ClockConfiguration,
    /// `PWR_CR5`: boost.
    PowerControl5,
    /// `FLASH_ACR`: wait states.
    FlashAccessControl,
}

/// The chip's registers and time.
pub trait Registers {
    /// Reads a register.
    fn read(&mut self, register: Register) -> u32;
    /// Writes a register.
    fn write(&mut self, register: Register, value: u32);
    /// Waits for at least this number of processor cycles.
    fn wait_cycles(&mut self, cycles: u32);
}

/// A field of a register: position and mask.
#[derive(Clone, Copy)]
struct Field(Register, u32, u32);

const PLLON: Field = Field(Register::ClockControl, 24, 1);
const PLLRDY: Field = Field(Register::ClockControl, 25, 1);
const SW: Field = Field(Register::ClockConfiguration, 0, 3);
const SWS: Field = Field(Register::ClockConfiguration, 2, 3);
const HPRE: Field = Field(Register::ClockConfiguration, 4, 15);
const R1MODE: Field = Field(Register::PowerControl5, 8, 1);
const LATENCY: Field = Field(Register::FlashAccessControl, 0, 15);

/// Values of `SW` and `SWS`.
const PLL: u32 = 3;
/// Values of `HPRE`.
const BY_1: u32 = 0;
const BY_2: u32 = 8;
/// Value of `R1MODE`.
const BOOST: u32 = 0;
/// Wait states of flash in range 1 boost, from 136 to 170 MHz.
const WAIT_STATES: u32 = 4;

/// Switches from the crystal (`crystal_hz`, the current system clock) to `clock_hz`. The PLL must be off, as
/// after a reset. Waits for the PLL's lock without a timeout.
///
/// `crystal_hz` is a multiple of 4 MHz, up to 64 MHz; `clock_hz` is [`CAN_4_MBIT_CLOCK_HZ`] or [`CAN_5_MBIT_CLOCK_HZ`].
pub fn switch_clock(registers: &mut impl Registers, crystal_hz: u32, clock_hz: u32) {
    registers.write(Register::PllConfiguration, pll_configuration(crystal_hz, clock_hz));
    set_and_await(registers, PLLON, 1, PLLRDY);
    set(registers, HPRE, BY_2);
    set(registers, R1MODE, BOOST);
    set_and_await(registers, LATENCY, WAIT_STATES, LATENCY);
    set_and_await(registers, SW, PLL, SWS);
    registers.wait_cycles(PAUSE_CYCLES);
    set(registers, HPRE, BY_1);
}

/// `PLLSRC` the crystal, `PLLM`, `PLLN`, `PLLREN` with `PLLR` 0, which divides by 2.
const fn pll_configuration(crystal_hz: u32, clock_hz: u32) -> u32 {
    let (divider, times) = (crystal_hz / PLL_IN_HZ, clock_hz / (PLL_IN_HZ / PLL_DIVIDES));
    3 | ((divider - 1) & 15) << 4 | (times & 127) << 8 | 1 << 24
}

/// Sets a field, leaving other bits unchanged.
fn set(registers: &mut impl Registers, Field(register, begin, mask): Field, value: u32) {
    let others = registers.read(register) & !(mask << begin);
    registers.write(register, others | value << begin);
}

/// Sets a field and waits until `shown` has the same value.
fn set_and_await(registers: &mut impl Registers, field: Field, value: u32, shown: Field) {
    set(registers, field, value);
    let Field(register, begin, mask) = shown;
    while registers.read(register) >> begin & mask != value {}
}
