//! The address space of a program: the processor's own registers and the chip.

use super::memory_protection::MemoryProtection;
use super::system::System;
use super::{AccessPoint, Bus};
use crate::concrete::Concrete;
use crate::instruction::Width;
use crate::state::{AccessError, Memory};

/// Start of the processor's own registers.
const PRIVATE: u32 = 0xE000_0000;
/// Registers of the chip's debug support, within the processor's own range.
const CHIP_DEBUG: std::ops::Range<u32> = 0xE004_2000..0xE004_3000;
/// Start of peripherals; below are only memories.
const PERIPHERALS: u32 = 0x4000_0000;

/// The address space during one instruction.
pub(super) struct View<'a, B> {
    bus: &'a mut B,
    system: &'a mut System,
    protection: &'a mut MemoryProtection,
    at: AccessPoint,
    pub(super) first_access: Option<u32>,
    /// Whether interrupt lines and events may have changed.
    pub(super) touches_chip: bool,
}

impl<'a, B: Bus> View<'a, B> {
    pub(super) fn new(
        bus: &'a mut B,
        system: &'a mut System,
        protection: &'a mut MemoryProtection,
        at: AccessPoint,
    ) -> Self {
        Self { bus, system, protection, at, first_access: None, touches_chip: false }
    }

    fn note(&mut self, address: u32) {
        self.first_access.get_or_insert(address);
        self.touches_chip |= address >= PERIPHERALS;
    }
}

impl<B: Bus> Memory<Concrete> for View<'_, B> {
    fn load(&mut self, _: &mut Concrete, address: u32, width: Width) -> Result<u32, AccessError> {
        self.note(address);
        self.protection.check(address, false)?;
        if address < PRIVATE || CHIP_DEBUG.contains(&address) {
            return self.bus.load(address, width, self.at);
        }
        match self.protection.load(address) {
            Some(value) => Ok(value),
            None => self.system.load(address, width, self.at.cycle),
        }
    }

    fn store(&mut self, _: &mut Concrete, address: u32, width: Width, value: u32) -> Result<(), AccessError> {
        self.note(address);
        self.protection.check(address, true)?;
        if address < PRIVATE || CHIP_DEBUG.contains(&address) {
            return self.bus.store(address, width, value, self.at);
        }
        if self.protection.store(address, value) {
            return Ok(());
        }
        self.system.store(address, width, value, self.at.cycle)
    }
}
