//! Flash interface (RM0440, chapter 3): programs 64-bit words and erases pages, with realistic durations.

use super::ChipModel;
use super::clock::Clock;
use super::memory::{ERASED, FLASH};
use super::registers::Registers;
use super::violation::Access;

const ACR: u32 = 0x00;
const KEYR: u32 = 0x08;
const SR: u32 = 0x10;
const CR: u32 = 0x14;
const OPTR: u32 = 0x20;

// Bits of SR.
const EOP: u32 = 0;
const PROGERR: u32 = 3;
const WRPERR: u32 = 4;
const PGAERR: u32 = 5;
const SIZERR: u32 = 6;
const PGSERR: u32 = 7;
const BSY: u32 = 16;
const ERRORS: u32 = 0xC3FA;
// Bits of CR.
const PG: u32 = 0;
const PER: u32 = 1;
const STRT: u32 = 16;
const EOPIE: u32 = 24;
const ERRIE: u32 = 25;
const LOCK: u32 = 31;
/// Bit of OPTR: two banks.
const DBANK: u32 = 22;

const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
/// Data sheet, "Flash memory characteristics": typical times.
const PROGRAM_S: f64 = 81.7e-6;
const ERASE_S: f64 = 22.0e-3;
const PAGE_BYTES: usize = 2048;

/// A fault of the flash, to test a program's reaction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FlashFault {
    /// No fault.
    #[default]
    None,
    /// Every write ends in `WRPERR`, as on a protected page, and changes nothing.
    WriteProtected,
    /// Writing and erasing succeed and change nothing.
    WornOut,
    /// Erasing a page never ends.
    NeverErased,
}

#[derive(Debug, Clone)]
pub(super) struct Flash {
    part: ChipModel,
    registers: Registers,
    keys_taken: usize,
    /// Address and value of the first word of 64 bits.
    half: Option<(u32, u32)>,
    busy_until: u64,
    /// The busy bank.
    busy_bank: u32,
    pub(super) fault: FlashFault,
    /// Numbers of erased pages and of programmed 64-bit words since power-on.
    pub(super) erased_pages: u64,
    pub(super) programmed: u64,
}

impl Flash {
    pub(super) fn new(part: ChipModel) -> Self {
        Self {
            part,
            registers: Registers::new(part, "FLASH", "FLASH"),
            keys_taken: 0,
            half: None,
            busy_until: 0,
            busy_bank: 0,
            fault: FlashFault::None,
            erased_pages: 0,
            programmed: 0,
        }
    }

    pub(super) fn reset(&mut self) {
        let (fault, erased_pages, programmed) = (self.fault, self.erased_pages, self.programmed);
        *self = Self { fault, erased_pages, programmed, ..Self::new(self.part) };
    }

    pub(super) fn registers(&self) -> &Registers {
        &self.registers
    }

    pub(super) fn wait_states(&self) -> u32 {
        self.registers.bits(ACR, 0, 4)
    }

    /// Whether the flash has two banks that are read independently.
    fn has_banks(&self) -> bool {
        self.part.banks() == 2 && self.registers.has(OPTR, DBANK)
    }

    fn bank_of(&self, address: u32) -> u32 {
        let offset = address.wrapping_sub(FLASH) as usize;
        u32::from(self.has_banks() && offset >= self.part.flash_bytes() / 2)
    }

    /// Cycles until an address can be read.
    #[inline]
    pub(super) fn wait(&self, address: u32, now: u64) -> u64 {
        if now >= self.busy_until || !(FLASH..0x1000_0000).contains(&address) {
            return 0;
        }
        if self.bank_of(address) == self.busy_bank { self.busy_until - now } else { 0 }
    }

    pub(super) fn read(&mut self, offset: u32, access: &mut Access<'_>) -> u32 {
        self.registers.read(offset, access)
    }

    pub(super) fn write(
        &mut self,
        offset: u32,
        value: u32,
        memory: &mut [u8],
        clock: &Clock,
        access: &mut Access<'_>,
    ) {
        match offset {
            KEYR => {
                self.keys_taken = match KEYS.get(self.keys_taken) {
                    Some(key) if *key == value => self.keys_taken + 1,
                    _ => {
                        access.violates(
                            "FLASH_KEYR is set to a wrong key: the flash stays locked until the next reset",
                        );
                        usize::MAX
                    }
                };
                if self.keys_taken == KEYS.len() {
                    self.keys_taken = 0;
                    self.registers.set_bit(CR, LOCK, false);
                }
            }
            SR => {
                let cleared = value & (ERRORS | 1 << EOP);
                self.registers.set(SR, self.registers.get(SR) & !cleared);
            }
            CR if self.registers.has(CR, LOCK) => {
                if value >> LOCK & 1 == 0 {
                    access.violates("FLASH_CR is written while it is locked");
                }
            }
            CR => {
                if access.at.cycle < self.busy_until {
                    access.violates("FLASH_CR is written while the flash is busy");
                }
                self.registers.write(CR, value, access);
                if value >> STRT & 1 == 1 {
                    self.erase(memory, clock, access);
                }
                if value >> LOCK & 1 == 1 {
                    self.keys_taken = 0;
                }
            }
            _ => self.registers.write(offset, value, access),
        }
    }

    fn begin(&mut self, address: u32, duration_s: f64, clock: &Clock, now: u64) {
        self.busy_bank = self.bank_of(address);
        self.busy_until = now.saturating_add(clock.cycles(duration_s));
        self.registers.set_bit(SR, BSY, true);
    }

    fn erase(&mut self, memory: &mut [u8], clock: &Clock, access: &mut Access<'_>) {
        if !self.registers.has(CR, PER) {
            access.violates("FLASH_CR starts an operation other than page erase: not modelled");
            return;
        }
        let in_bank = self.registers.bits(CR, 3, if self.part.banks() == 2 { 7 } else { 6 }) as usize;
        let bank = usize::from(self.has_banks() && self.registers.has(CR, 11));
        let begin = bank * self.part.flash_bytes() / 2 + in_bank * PAGE_BYTES;
        let address = u32::try_from(begin).unwrap_or(0).wrapping_add(FLASH);
        let duration_s = if self.fault == FlashFault::NeverErased { f64::MAX } else { ERASE_S };
        self.begin(address, duration_s, clock, access.at.cycle);
        self.erased_pages += 1;
        match self.fault {
            FlashFault::NeverErased => {}
            FlashFault::WriteProtected => self.registers.set_bit(SR, WRPERR, true),
            FlashFault::WornOut => {}
            FlashFault::None => {
                let page = memory.get_mut(begin..).and_then(|rest| rest.get_mut(..PAGE_BYTES));
                match page {
                    Some(page) => page.fill(ERASED),
                    None => access.violates(format!("flash page {in_bank} is erased, but does not exist")),
                }
            }
        }
    }

    /// A word write to the flash memory.
    pub(super) fn program(
        &mut self,
        address: u32,
        value: u32,
        memory: &mut [u8],
        clock: &Clock,
        access: &mut Access<'_>,
    ) {
        let offset = address.wrapping_sub(FLASH);
        if access.at.cycle < self.busy_until {
            access.violates(format!("flash at {address:#010x} is written while the flash is busy"));
        }
        if !self.registers.has(CR, PG) || self.registers.has(CR, LOCK) {
            access.violates(format!(
                "flash at {address:#010x} is written while FLASH_CR.PG is 0 or FLASH_CR is locked"
            ));
            self.registers.set_bit(SR, PGSERR, true);
            return;
        }
        let Some((first, low)) = self.half.take() else {
            if !address.is_multiple_of(8) {
                self.registers.set_bit(SR, PGAERR, true);
            }
            self.half = Some((address, value));
            return;
        };
        if first.wrapping_add(4) != address {
            self.registers.set_bit(SR, PGAERR, true);
            return;
        }
        self.begin(address, PROGRAM_S, clock, access.at.cycle);
        self.programmed += 1;
        if self.fault == FlashFault::WriteProtected {
            self.registers.set_bit(SR, WRPERR, true);
            return;
        }
        let begin = offset as usize - 4;
        let Some(room) = memory.get_mut(begin..begin + 8) else { return };
        let is_erased = room.iter().all(|byte| *byte == ERASED);
        // Existing data may be overwritten only with zeros.
        if !is_erased && (low, value) != (0, 0) {
            self.registers.set_bit(SR, PROGERR, true);
            return;
        }
        if self.fault != FlashFault::WornOut {
            let (low_bytes, high_bytes) = room.split_at_mut(4);
            low_bytes.copy_from_slice(&low.to_le_bytes());
            high_bytes.copy_from_slice(&value.to_le_bytes());
        }
    }

    /// A write of less than a word.
    pub(super) fn program_part(&mut self, access: &mut Access<'_>) {
        access.violates("flash is written with less than a 32-bit word");
        self.registers.set_bit(SR, SIZERR, true);
    }

    pub(super) fn advance(&mut self, now: u64) {
        if self.registers.has(SR, BSY) && now >= self.busy_until {
            self.registers.set_bit(SR, BSY, false);
            self.registers.set_bit(CR, STRT, false);
            if self.registers.get(SR) & ERRORS == 0 && self.registers.has(CR, EOPIE) {
                self.registers.set_bit(SR, EOP, true);
            }
            // OPERR reports an error if the error interrupt is enabled.
            if self.registers.get(SR) & ERRORS != 0 && self.registers.has(CR, ERRIE) {
                self.registers.set_bit(SR, 1, true);
            }
        }
    }

    pub(super) fn next_event(&self) -> u64 {
        if self.registers.has(SR, BSY) { self.busy_until } else { u64::MAX }
    }

    pub(super) fn interrupts(&self) -> bool {
        self.registers.has(SR, EOP) && self.registers.has(CR, EOPIE)
            || self.registers.has(SR, 1) && self.registers.has(CR, ERRIE)
    }
}
