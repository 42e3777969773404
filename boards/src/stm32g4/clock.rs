//! Register access for [`clock_switch`](crate::clock_switch), as words: the register crate has the wrong bit
//! in `PWR_CR5`.

use embassy_stm32::pac::{FLASH, PWR, RCC, flash, pwr, rcc};

use crate::clock_switch::{Register, Registers};

/// The chip.
pub(super) struct Chip;

impl Registers for Chip {
    fn read(&mut self, register: Register) -> u32 {
        match register {
            Register::ClockControl => RCC.cr().read().0,
            Register::PllConfiguration => RCC.pllcfgr().read().0,
            Register::ClockConfiguration => RCC.cfgr().read().0,
            Register::PowerControl5 => PWR.cr5().read().0,
            Register::FlashAccessControl => FLASH.acr().read().0,
        }
    }

    fn write(&mut self, register: Register, value: u32) {
        match register {
            Register::ClockControl => RCC.cr().write_value(rcc::regs::Cr(value)),
            Register::PllConfiguration => RCC.pllcfgr().write_value(rcc::regs::Pllcfgr(value)),
            Register::ClockConfiguration => RCC.cfgr().write_value(rcc::regs::Cfgr(value)),
            Register::PowerControl5 => PWR.cr5().write_value(pwr::regs::Cr5(value)),
            Register::FlashAccessControl => FLASH.acr().write_value(flash::regs::Acr(value)),
        }
    }

    fn wait_cycles(&mut self, cycles: u32) {
        cortex_m::asm::delay(cycles);
    }
}
