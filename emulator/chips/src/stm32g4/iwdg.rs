//! Independent watchdog (RM0440, chapter 42).

use super::ChipModel;
use super::clock::Clock;
use super::registers::Registers;
use super::violation::Access;

const KR: u32 = 0x00;
const PR: u32 = 0x04;
const RLR: u32 = 0x08;
const SR: u32 = 0x0C;

const START: u32 = 0xCCCC;
const FEED: u32 = 0xAAAA;
const UNLOCK: u32 = 0x5555;

/// Frequency of its own oscillator (data sheet: 31.04 to 32.96 kHz).
const LSI_HZ: f64 = 32_000.0;
/// Time until a written prescaler or reload value takes effect.
const UPDATE_S: f64 = 6.0 / LSI_HZ;

#[derive(Debug, Clone)]
pub(super) struct Iwdg {
    registers: Registers,
    is_unlocked: bool,
    /// Cycle of the watchdog reset; `None` before the watchdog is started.
    bites_at: Option<u64>,
    updated_at: u64,
}

impl Iwdg {
    pub(super) fn new(part: ChipModel) -> Self {
        let registers = Registers::new(part, "IWDG", "IWDG");
        Self { registers, is_unlocked: false, bites_at: None, updated_at: 0 }
    }

    pub(super) fn registers(&self) -> &Registers {
        &self.registers
    }

    pub(super) fn read(&mut self, offset: u32, access: &mut Access<'_>) -> u32 {
        if offset == SR {
            return if access.at.cycle < self.updated_at { 3 } else { 0 };
        }
        self.registers.read(offset, access)
    }

    pub(super) fn write(&mut self, offset: u32, value: u32, clock: &Clock, access: &mut Access<'_>) {
        let now = access.at.cycle;
        match (offset, value) {
            // The first count starts at 0xFFF; the reload value applies from the first feed.
            (KR, START) => self.count_from(self.registers.get(RLR).max(0xFFF), clock, now),
            (KR, FEED) => {
                if self.bites_at.is_some() {
                    self.count_from(self.registers.get(RLR), clock, now);
                }
                self.is_unlocked = false;
            }
            (KR, UNLOCK) => self.is_unlocked = true,
            (KR, _) => self.is_unlocked = false,
            _ => {
                if !self.is_unlocked {
                    access.violates(format!("{} is written while it is locked", self.registers.name(offset)));
                }
                self.registers.write(offset, value, access);
                self.updated_at = now + clock.cycles(UPDATE_S);
            }
        }
    }

    fn count_from(&mut self, reload: u32, clock: &Clock, now: u64) {
        let divider = f64::from(4 << self.registers.get(PR).min(6));
        self.bites_at = Some(now + clock.cycles(f64::from(reload + 1) * divider / LSI_HZ));
    }

    pub(super) fn bites(&self, now: u64) -> bool {
        self.bites_at.is_some_and(|at| at <= now)
    }

    pub(super) fn next_event(&self) -> u64 {
        self.bites_at.unwrap_or(u64::MAX)
    }
}
