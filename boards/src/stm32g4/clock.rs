//! The registers that [`clock_switch`](crate::clock_switch) goes through, as words: of `PWR_CR5` the register crate
//! does not know the bit.

use embassy_stm32::pac::{FLASH, PWR, RCC, flash, pwr, rcc};

use crate::clock_switch::{Register, Registers};

/// The chip itself.
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
