//! System registers of the processor: interrupt controller, system control, cycle counter (DDI 0403E B3.2,
//! B3.4, C1.8).

use crate::concrete::Concrete;
use crate::instruction::Width;
use crate::state::{AccessError, Registers};

/// Exception number.
pub(super) const HARD_FAULT: u8 = 3;
/// Exception number of the first interrupt.
const INTERRUPTS: u8 = 16;
/// Implemented priority bits; lower bits read as zero (STM32).
const PRIORITY_BITS: u8 = 0xF0;
/// Cycles for stacking the float registers, when a handler first uses the float unit.
const LAZY_STACKING_CYCLES: u64 = 17;
/// Lowest urgency.
const THREAD: i16 = 256;

// Fields of AIRCR.
const KEY: u32 = 0x05FA_0000;
const READ_KEY: u32 = 0xFA05_0000;
const SYSRESETREQ: u32 = 1 << 2;

// Register addresses.
const ACTLR: u32 = 0xE000_E008;
const SYSTICK_CONTROL: u32 = 0xE000_E010;
const CPUID: u32 = 0xE000_ED00;
const ICSR: u32 = 0xE000_ED04;
const VTOR: u32 = 0xE000_ED08;
const AIRCR: u32 = 0xE000_ED0C;
const SCR: u32 = 0xE000_ED10;
const CCR: u32 = 0xE000_ED14;
const SHCSR: u32 = 0xE000_ED24;
const CPACR: u32 = 0xE000_ED88;
const DHCSR: u32 = 0xE000_EDF0;
const DEMCR: u32 = 0xE000_EDFC;
const STIR: u32 = 0xE000_EF00;
const FPCCR: u32 = 0xE000_EF34;
const DWT_CONTROL: u32 = 0xE000_1000;
const CYCLE_COUNT: u32 = 0xE000_1004;
/// CPUID of the Cortex-M4 r0p1.
const CORTEX_M4: u32 = 0x410F_C241;

/// Interrupt controller and system control. Sets of exceptions have one bit per exception number.
#[derive(Debug, Clone)]
pub(super) struct System {
    vectors: u32,
    reset_vectors: u32,
    enabled: u128,
    pending: u128,
    active: u128,
    lines: u128,
    priorities: [u8; 128],
    current: u8,
    /// `CONTROL.FPCA`: an exception must save the float registers.
    pub(super) uses_float: bool,
    /// Whether the cycles for stacking the float registers are still outstanding.
    owes_stacking: bool,
    coprocessors: u32,
    monitor: u32,
    counter_control: u32,
    /// Cycle in which the counter was 0.
    counter_start: u64,
    others: std::collections::BTreeMap<u32, u32>,
    pub(super) wants_reset: bool,
}

impl System {
    pub(super) fn new(vectors: u32) -> Self {
        Self {
            vectors,
            reset_vectors: vectors,
            enabled: 0xFFFF,
            pending: 0,
            active: 0,
            lines: 0,
            priorities: [0; 128],
            current: 0,
            uses_float: false,
            owes_stacking: false,
            coprocessors: 0,
            monitor: 0,
            counter_control: 0x4000_0000,
            counter_start: 0,
            others: std::collections::BTreeMap::new(),
            wants_reset: false,
        }
    }

    pub(super) fn reset(&mut self, now: u64) {
        *self = Self { counter_start: now, ..Self::new(self.reset_vectors) };
    }

    pub(super) fn vectors(&self) -> u32 {
        self.vectors
    }

    /// `IPSR`: number of the active exception, 0 outside of handlers.
    pub(super) fn current(&self) -> u8 {
        self.current
    }

    pub(super) fn is_active(&self, exception: u8) -> bool {
        self.active >> exception & 1 == 1
    }

    pub(super) fn has_float(&self) -> bool {
        self.coprocessors >> 20 & 0xF == 0xF
    }

    /// Starts a use of the float unit. Returns its additional cycles.
    pub(super) fn begin_float(&mut self) -> u64 {
        self.uses_float = true;
        if std::mem::take(&mut self.owes_stacking) { LAZY_STACKING_CYCLES } else { 0 }
    }

    /// An interrupt becomes pending when its line becomes active, and again if the line is still active when
    /// its handler returns.
    pub(super) fn see_lines(&mut self, lines: u128) {
        let lines = lines << INTERRUPTS;
        self.pending |= lines & !self.lines;
        self.lines = lines;
    }

    pub(super) fn has_pending(&self) -> bool {
        self.pending & self.enabled != 0
    }

    /// The exception that preempts the current code, if any.
    pub(super) fn next_exception(&self, registers: &Registers<Concrete>) -> Option<u8> {
        let (priority, exception) = self.most_urgent()?;
        (priority < self.running_priority(registers)).then_some(exception)
    }

    /// Whether a sleeping processor wakes: PRIMASK does not prevent it (DDI 0403E B1.5.19).
    pub(super) fn wakes(&self, registers: &Registers<Concrete>) -> bool {
        let unmasked = Registers { primask: 0, ..registers.clone() };
        self.next_exception(&unmasked).is_some()
    }

    fn most_urgent(&self) -> Option<(i16, u8)> {
        let candidates = bits(self.pending & self.enabled);
        candidates.map(|exception| (self.priority(exception), exception)).min()
    }

    fn priority(&self, exception: u8) -> i16 {
        match exception {
            2 => -2,
            HARD_FAULT => -1,
            _ => self.priorities.get(usize::from(exception)).copied().unwrap_or(0).into(),
        }
    }

    fn running_priority(&self, registers: &Registers<Concrete>) -> i16 {
        let active = bits(self.active).map(|exception| self.priority(exception)).min().unwrap_or(THREAD);
        let by_mask = match (registers.faultmask & 1, registers.primask & 1) {
            (1, _) => -1,
            (_, 1) => 0,
            _ => THREAD,
        };
        let by_base = match registers.basepri & u32::from(PRIORITY_BITS) {
            0 => THREAD,
            base => i16::try_from(base).unwrap_or(THREAD),
        };
        active.min(by_mask).min(by_base)
    }

    pub(super) fn enter(&mut self, exception: u8, has_float: bool) {
        self.owes_stacking = has_float;
        self.chain(exception);
    }

    /// Enters a handler without a new frame on the stack.
    pub(super) fn chain(&mut self, exception: u8) {
        self.active |= 1 << exception;
        self.pending &= !(1 << exception);
        self.current = exception;
        self.uses_float = false;
    }

    /// Ends the active handler.
    pub(super) fn leave(&mut self, lines: u128) {
        let left = self.current;
        self.active &= !(1 << left);
        self.lines = lines << INTERRUPTS;
        self.pending |= self.lines & 1 << left;
    }

    pub(super) fn returned(&mut self, exception: u8, has_float: bool) {
        self.current = exception;
        self.uses_float = has_float;
        self.owes_stacking = false;
    }

    pub(super) fn load(&self, address: u32, width: Width, now: u64) -> Result<u32, AccessError> {
        let word = self.word(address & !3, now);
        let shifted = word >> (8 * (address & 3));
        Ok(match width {
            Width::Byte => shifted & 0xFF,
            Width::Half => shifted & 0xFFFF,
            Width::Word => word,
        })
    }

    fn word(&self, address: u32, now: u64) -> u32 {
        match address {
            0xE000_E100..0xE000_E120 | 0xE000_E180..0xE000_E1A0 => part(self.enabled, address),
            0xE000_E200..0xE000_E220 | 0xE000_E280..0xE000_E2A0 => part(self.pending, address),
            0xE000_E300..0xE000_E320 => part(self.active, address),
            0xE000_E400..0xE000_E470 => self.four_priorities(address - 0xE000_E400 + 16),
            0xE000_ED18..0xE000_ED24 => self.four_priorities(address - 0xE000_ED18 + 4),
            CPUID => CORTEX_M4,
            ICSR => {
                u32::from(self.current) | self.most_urgent().map_or(0, |(_, number)| u32::from(number) << 12)
            }
            VTOR => self.vectors,
            AIRCR => READ_KEY,
            CPACR => self.coprocessors,
            DEMCR => self.monitor,
            DHCSR => 0,
            DWT_CONTROL => self.counter_control,
            CYCLE_COUNT => self.counted(now),
            // Reset values: `STKALIGN` and lazy stacking are on.
            CCR => self.others.get(&address).copied().unwrap_or(0x200),
            FPCCR => self.others.get(&address).copied().unwrap_or(0xC000_0000),
            _ => self.others.get(&address).copied().unwrap_or(0),
        }
    }

    /// The low word of the cycles since the counter was 0.
    #[expect(clippy::cast_possible_truncation, reason = "the register has 32 bits and wraps")]
    fn counted(&self, now: u64) -> u32 {
        now.wrapping_sub(self.counter_start) as u32
    }

    pub(super) fn store(
        &mut self,
        address: u32,
        width: Width,
        value: u32,
        now: u64,
    ) -> Result<(), AccessError> {
        let bytes = match width {
            Width::Byte => 1,
            Width::Half => 2,
            Width::Word => 4,
        };
        match address {
            0xE000_E400..0xE000_E470 => self.set_priorities(address - 0xE000_E400 + 16, bytes, value),
            0xE000_ED18..0xE000_ED24 => self.set_priorities(address - 0xE000_ED18 + 4, bytes, value),
            0xE000_E100..0xE000_E120 => self.enabled |= placed(address, value),
            0xE000_E180..0xE000_E1A0 => self.enabled &= !placed(address, value),
            0xE000_E200..0xE000_E220 => self.pending |= placed(address, value),
            0xE000_E280..0xE000_E2A0 => self.pending &= !placed(address, value),
            ICSR => {
                self.pending |= u128::from(value >> 28 & 1) << 14;
                self.pending &= !(u128::from(value >> 27 & 1) << 14);
            }
            STIR => self.pending |= 1 << (value & 0x1FF).saturating_add(INTERRUPTS.into()).min(127),
            VTOR => self.vectors = value & !0x7F,
            AIRCR if value & 0xFFFF_0000 == KEY => self.wants_reset |= value & SYSRESETREQ != 0,
            CPACR => self.coprocessors = value,
            DEMCR => self.monitor = value,
            DWT_CONTROL => self.counter_control = value,
            CYCLE_COUNT => self.counter_start = now.wrapping_sub(value.into()),
            // SysTick would be pending periodically; the supported programs do not enable it.
            SYSTICK_CONTROL if value & 1 == 1 => return Err(AccessError::Unmapped { address }),
            ACTLR | SCR | CCR | SHCSR | FPCCR => {
                self.others.insert(address, value);
            }
            _ => {
                self.others.insert(address, value);
            }
        }
        Ok(())
    }

    fn four_priorities(&self, first: u32) -> u32 {
        let byte = |place: u32| self.priorities.get((first + place) as usize).copied().unwrap_or(0);
        u32::from_le_bytes([byte(0), byte(1), byte(2), byte(3)])
    }

    fn set_priorities(&mut self, first: u32, bytes: usize, value: u32) {
        let places = self.priorities.iter_mut().skip(first as usize);
        for (place, byte) in places.zip(value.to_le_bytes()).take(bytes) {
            *place = byte & PRIORITY_BITS;
        }
    }
}

/// Exceptions in a set, by number.
fn bits(mut set: u128) -> impl Iterator<Item = u8> {
    std::iter::from_fn(move || {
        let lowest = u8::try_from(set.trailing_zeros()).ok().filter(|lowest| *lowest < 128)?;
        set &= set - 1;
        Some(lowest)
    })
}

/// 32 interrupts of a set, selected by the address of their register.
#[expect(clippy::cast_possible_truncation, reason = "a register has 32 interrupts")]
fn part(set: u128, address: u32) -> u32 {
    (set >> INTERRUPTS).checked_shr((address & 0x1F) * 8).unwrap_or(0) as u32
}

/// Bits of a register as a set of interrupts.
fn placed(address: u32, value: u32) -> u128 {
    (u128::from(value).checked_shl((address & 0x1C) * 8).unwrap_or(0)) << INTERRUPTS
}
