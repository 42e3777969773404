//! Setup: INIT and CCE, and the bits that they lock.

use super::buffers::Buffers;
use super::fifo::Fifo;
use super::layout::{
    CCCR, CCE, CSA, CSR, DBTP, HPMS, INIT, LONGEST_COMPENSATED_PRESCALER, PROTECTED, PROTECTED_FROM_SETTING,
    RXGFC, SEQUENCES_AFTER_BUS_OFF, TEST, TEST_MODE, TOCC, TSCC,
};
use super::{Fdcan, Presence};
use crate::stm32g4::violation::Access;

impl Fdcan {
    /// Writes a configuration register.
    pub(super) fn configure(&mut self, offset: u32, value: u32, access: &mut Access<'_>) {
        let is_test = offset == TEST && !self.registers.has(CCCR, TEST_MODE);
        let is_locked = !self.may_configure() || is_test;
        if is_locked && value != self.registers.get(offset) {
            access.violates(format!("{} is written while it is locked", self.registers.name(offset)));
        }
        if is_locked {
            return;
        }
        self.registers.write(offset, value, access);
        let too_many = self.registers.bits(RXGFC, 16, 5) > 28 || self.registers.bits(RXGFC, 24, 4) > 8;
        let (mode, compensates) = (self.registers.bits(TSCC, 0, 2), self.compensates_delay());
        let prescaler = self.registers.bits(DBTP, 16, 5);
        let fault = match offset {
            RXGFC if too_many => "FDCAN1_RXGFC selects more than 28 standard or 8 extended filters",
            TOCC if value & 1 == 1 => "FDCAN1_TOCC starts the timeout counter: not modelled",
            TSCC if mode > 1 => "FDCAN1_TSCC selects timestamps from timer 3: not modelled",
            TEST if value >> 4 & 7 != 0 => "FDCAN1_TEST selects a test mode: not modelled",
            DBTP if compensates && prescaler > LONGEST_COMPENSATED_PRESCALER => {
                "FDCAN1_DBTP enables delay compensation with a prescaler above 2"
            }
            _ => return,
        };
        access.violates(fault);
    }

    pub(super) fn control(&mut self, value: u32, access: &mut Access<'_>) {
        let before = self.registers.get(CCCR);
        let mut value = value;
        let changed = before ^ value;
        let locked = changed & PROTECTED | changed & value & PROTECTED_FROM_SETTING;
        if locked != 0 && !self.may_configure() {
            access.violates(format!("FDCAN1_CCCR changes bits {locked:#06x}, which are locked"));
            value ^= locked;
        }
        if before >> INIT & 1 == 0 && value >> CCE & 1 == 1 {
            access.violates("FDCAN1_CCCR sets CCE before INIT is set");
            value &= !(1 << CCE);
        }
        if value >> CSR & 1 == 1 {
            value |= 1 << INIT;
        }
        if value >> INIT & 1 == 0 {
            value &= !(1 << CCE);
        }
        value = value & !(1 << CSA) | (value >> CSR & 1) << CSA;
        self.registers.write(CCCR, value, access);
        let value = self.registers.get(CCCR);
        if changed & value >> CCE & 1 == 1 {
            self.clear();
        }
        match (before >> INIT & 1, value >> INIT & 1) {
            (0, 1) => self.leave(),
            (1, 0) => self.join(access),
            _ => {}
        }
    }

    /// Clears the state, as setting CCE does.
    pub(super) fn clear(&mut self) {
        self.buffers = Buffers::default();
        self.received = [Fifo::default(); 2];
        self.events = Fifo::default();
        self.registers.set(HPMS, 0);
    }

    pub(super) fn leave(&mut self) {
        self.presence = Presence::Initialisation;
        self.passages.clear();
        self.buffers.on_wire = None;
    }

    /// Joins the bus after INIT was cleared.
    pub(super) fn join(&mut self, access: &mut Access<'_>) {
        if self.kernel_hz.is_none() {
            access.violates("FDCAN1 is started, but the clock that RCC_CCIPR selects for it is off");
            return;
        }
        let sequences = if self.errors.is_off() { SEQUENCES_AFTER_BUS_OFF } else { 1 };
        self.presence = Presence::Integrating { sequences, since: access.at.cycle };
    }

    pub(super) fn may_configure(&self) -> bool {
        self.registers.get(CCCR) & 3 == 3
    }
}
