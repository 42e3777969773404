//! Flash with wait states: its lines and caches.

use super::Outcome;
use super::known::{Access, KnownOperands, RAM};
use super::least_recent::LeastRecent;
use super::price::Price;
use crate::instruction::Instruction;

/// A flash memory behind caches, as in STM32 parts.
///
/// It covers all addresses below `0x2000_0000` (the code region of the Armv7-M memory map), except for RAM in
/// that region. RAM has no wait states.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Flash {
    /// Wait states of a read, in addition to its own cycle.
    pub wait_states: u8,
    /// Bytes per read: a power of 2, at least 4.
    pub line_bytes: u8,
    /// Lines in the instruction cache.
    pub instruction_lines: u16,
    /// Lines in the data cache.
    pub data_lines: u16,
    /// Whether the line after the current one is prefetched.
    pub prefetches: bool,
    /// Start and end address of RAM in the code region, such as CCM SRAM; equal if there is none.
    pub code_ram: (u32, u32),
}

impl Flash {
    /// The STM32G4 above 136 MHz in two banks, as configured by the firmware.
    ///
    /// ST, RM0440, embedded flash memory: 4 wait states in range 1 boost mode from 136 to 170 MHz; 64 bits
    /// per read in two banks; instruction cache of 32 lines of 4 x 64 bits, data cache of 8 such lines, both
    /// enabled after reset, with prefetch disabled. The model treats every 64 bits as a separate line and
    /// replaces the least recently used line. Embedded SRAM: the CCM SRAM, up to 32 KiB, has no wait states
    /// at any clock.
    pub const STM32G4: Self = Self {
        wait_states: 4,
        line_bytes: 8,
        instruction_lines: 32 * 4,
        data_lines: 8 * 4,
        prefetches: false,
        code_ram: (0x1000_0000, 0x1000_8000),
    };

    /// Maximum wait cycles of an instruction: for every line except `line`, the last line of the preceding
    /// instruction, and for its loads. Updates `line`.
    pub(super) fn max_wait_cycles(
        &self,
        line: &mut Option<u32>,
        instruction: &Instruction,
        price: &Price,
        outcome: Outcome,
        known: KnownOperands,
    ) -> u32 {
        let before = *line;
        let mut reads = all(price.lines).filter(|line| Some(*line) != before).count();
        *line = self.line(instruction.next().wrapping_sub(1));
        if outcome == Outcome::Taken {
            *line = None;
            // A jump waits for a prefetch in progress that it makes useless.
            reads += usize::from(self.holds(instruction.address));
        }
        let fetches = self.longest_read() * u32::try_from(reads).unwrap_or(u32::MAX);
        fetches + loaded(price, outcome, known).map_or(0, |(access, bytes)| self.longest_load(access, bytes))
    }

    /// Maximum wait cycles of a load of `bytes`.
    fn longest_load(&self, access: Access, bytes: u32) -> u32 {
        let reads = if access.min_address == access.max_address {
            u32::try_from(all(self.lines(access.min_address, bytes)).count()).unwrap_or(u32::MAX)
        } else if self.reaches(access) {
            bytes.div_ceil(self.line_bytes.into()) + 1
        } else {
            0
        };
        self.longest_read() * reads
    }

    /// Maximum wait cycles of a read, including a prefetch in progress.
    pub(super) fn longest_read(&self) -> u32 {
        let ahead = if self.prefetches { self.cycles_ahead() } else { 0 };
        u32::from(self.wait_states) + ahead
    }

    /// Cycles of a prefetch.
    fn cycles_ahead(&self) -> u32 {
        u32::from(self.wait_states) + 1
    }

    /// Whether `address` is in the flash.
    fn holds(&self, address: u32) -> bool {
        let (start, end) = self.code_ram;
        address < RAM && !(start..end).contains(&address)
    }

    /// Whether an access can be to the flash.
    fn reaches(&self, access: Access) -> bool {
        let (start, end) = self.code_ram;
        access.min_address < RAM && !(access.min_address >= start && access.max_address < end)
    }

    /// The number of the line that contains `address`; `None` in RAM.
    fn line(&self, address: u32) -> Option<u32> {
        self.holds(address).then(|| address >> self.line_bytes.trailing_zeros())
    }

    /// Numbers of the first and the last line of `bytes` at `address`; `None` in RAM.
    fn lines(&self, address: u32, bytes: u32) -> Option<(u32, u32)> {
        self.line(address).zip(self.line(address.saturating_add(bytes.saturating_sub(1))))
    }

    /// Numbers of the first and the last line of an instruction.
    pub(super) fn lines_of(&self, instruction: &Instruction) -> Option<(u32, u32)> {
        self.lines(instruction.address, instruction.bytes.into())
    }
}

/// All lines from the first to the last.
fn all(lines: Option<(u32, u32)>) -> impl Iterator<Item = u32> {
    lines.into_iter().flat_map(|(first, last)| first..=last)
}

/// Address and number of bytes of an instruction's load.
fn loaded(price: &Price, outcome: Outcome, known: KnownOperands) -> Option<(Access, u32)> {
    let bytes = price.loaded_bytes.filter(|_| outcome != Outcome::Skipped)?;
    Some((known.access.unwrap_or(Access::UNKNOWN), bytes.into()))
}

/// The state of the caches in an emulated run.
#[derive(Debug, Clone, Default)]
pub struct Caches {
    /// The line of the current instruction.
    current: Option<u32>,
    instructions: LeastRecent,
    data: LeastRecent,
    /// The line being prefetched, and the cycles until it is available.
    ahead: Option<(u32, u32)>,
}

impl Caches {
    /// Wait cycles of an instruction with `core_cycles`: for its lines and its loads. A load from an unknown
    /// address misses the cache.
    pub(super) fn waits(
        &mut self,
        flash: &Flash,
        price: &Price,
        outcome: Outcome,
        known: KnownOperands,
        core_cycles: u32,
    ) -> u32 {
        let mut waits = match price.lines {
            // The common case.
            Some((first, last)) if first == last && self.current == Some(first) => 0,
            lines => all(lines).map(|line| self.fetch(flash, line)).sum(),
        };
        if let Some((access, bytes)) = loaded(price, outcome, known) {
            if access.min_address == access.max_address {
                waits += all(flash.lines(access.min_address, bytes))
                    .map(|line| self.load(flash, line))
                    .sum::<u32>();
            } else {
                waits += flash.longest_load(access, bytes);
            }
        }
        self.pass(core_cycles);
        waits
    }

    fn fetch(&mut self, flash: &Flash, line: u32) -> u32 {
        if self.current.replace(line) == Some(line) {
            return 0;
        }
        let is_cached = self.instructions.take(line, flash.instruction_lines);
        let wait = match self.ahead {
            Some((ahead, left)) if ahead == line => left.min(flash.wait_states.into()),
            _ if is_cached => return 0,
            _ => self.read(flash),
        };
        self.ahead = flash.prefetches.then(|| (line.wrapping_add(1), flash.cycles_ahead()));
        wait
    }

    fn load(&mut self, flash: &Flash, line: u32) -> u32 {
        if self.data.take(line, flash.data_lines) { 0 } else { self.read(flash) }
    }

    /// Wait cycles of a read, after a prefetch in progress.
    fn read(&mut self, flash: &Flash) -> u32 {
        let left = self.ahead.as_mut().map_or(0, |(_, left)| std::mem::take(left));
        left + u32::from(flash.wait_states)
    }

    fn pass(&mut self, cycles: u32) {
        if let Some((_, left)) = &mut self.ahead {
            *left = left.saturating_sub(cycles);
        }
    }
}
