//! Timers (RM0440, chapters 28 and 29): count up or up and down, compare, generate pulses, read encoders.
//!
//! A timer is not stepped: its count follows from the elapsed time.

mod gates;
mod trigger;

use super::ChipModel;
use super::registers::Registers;
use super::violation::Access;

pub(super) use self::gates::Gate;
pub use self::gates::GateDriver;
use self::trigger::Select;
pub(super) use self::trigger::{Edge, Output};

const CR1: u32 = 0x00;
const CR2: u32 = 0x04;
const SMCR: u32 = 0x08;
const DIER: u32 = 0x0C;
const SR: u32 = 0x10;
const EGR: u32 = 0x14;
const CCMR1: u32 = 0x18;
const CCER: u32 = 0x20;
const CNT: u32 = 0x24;
const PSC: u32 = 0x28;
const ARR: u32 = 0x2C;
const RCR: u32 = 0x30;
const CCR1: u32 = 0x34;
const BDTR: u32 = 0x44;
const DMA_ADDRESS: u32 = 0x4C;

// Bits of CR1.
const CEN: u32 = 0;
const UDIS: u32 = 1;
const URS: u32 = 2;
const DIR: u32 = 4;
const CMS: u32 = 5;
/// Bit of BDTR: main output enable.
const MOE: u32 = 15;
/// Bit of SR and DIER.
const UPDATE: u32 = 0;
const CHANNELS: u32 = 4;

/// Pulses of timer 1 at the bridge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pulses {
    /// Duty cycle of each high side; `None` unless its output is enabled, in PWM mode 1.
    pub duties: [Option<f64>; 3],
    /// Dead time between high and low side, in cycles.
    pub dead_time_cycles: u32,
    /// Period, in cycles.
    pub period_cycles: u64,
}

#[derive(Debug, Clone)]
pub(super) struct Timer {
    part: ChipModel,
    number: u32,
    registers: Registers,
    /// Cycle up to which the timer is advanced.
    seen: u64,
    /// Cycles of the prescaler since its last count.
    divided: u64,
    /// Position in the period, in counts. Counting up and down: counts since the last minimum.
    phase: u64,
    /// Effective values of registers with preload: prescaler, compare values, repetitions.
    prescaler: u64,
    compares: [u32; 4],
    repetitions: u32,
    /// Edges of the trigger outputs since they were last taken.
    edges: Vec<Edge>,
    /// Changes of the main output enable since they were last taken: cycle, whether it is set.
    switched: Vec<(u64, bool)>,
    /// Levels of TRGO and TRGO2.
    levels: [bool; 2],
    has_gates: bool,
}

impl Timer {
    pub(super) fn new(part: ChipModel, number: u32) -> Self {
        let class = match number {
            1 => "TIM1",
            2 | 5 => "TIM2",
            _ => "TIM3",
        };
        Self {
            part,
            number,
            registers: Registers::new(part, class, &format!("TIM{number}")),
            seen: 0,
            divided: 0,
            phase: 0,
            prescaler: 0,
            compares: [0; 4],
            repetitions: 0,
            edges: Vec::new(),
            switched: Vec::new(),
            levels: [false; 2],
            has_gates: number == 1,
        }
    }

    pub(super) fn reset(&mut self, now: u64) {
        let mut switched = std::mem::take(&mut self.switched);
        if self.registers.has(BDTR, MOE) {
            switched.push((now, false));
        }
        *self = Self { seen: now, switched, ..Self::new(self.part, self.number) };
    }

    pub(super) fn registers(&self) -> &Registers {
        &self.registers
    }

    fn is_counting(&self) -> bool {
        self.registers.has(CR1, CEN) && !self.is_encoder()
    }

    fn is_encoder(&self) -> bool {
        matches!(self.registers.bits(SMCR, 0, 3), 1..=3)
    }

    fn is_up_and_down(&self) -> bool {
        self.registers.bits(CR1, CMS, 2) != 0
    }

    fn top(&self) -> u64 {
        self.registers.get(ARR).into()
    }

    /// Period in counts.
    fn period(&self) -> u64 {
        if self.is_up_and_down() { (2 * self.top()).max(1) } else { self.top() + 1 }
    }

    #[expect(clippy::cast_possible_truncation, reason = "never more than ARR")]
    fn count(&self) -> u32 {
        let up_to_top = if self.is_up_and_down() && self.phase > self.top() {
            2 * self.top() - self.phase
        } else {
            self.phase
        };
        up_to_top as u32
    }

    /// Turns an encoder's shaft by this number of counts.
    pub(super) fn turn(&mut self, counts: i64) {
        if self.is_encoder() && self.registers.has(CR1, CEN) {
            let period = i64::try_from(self.top() + 1).unwrap_or(i64::MAX);
            let phase = i64::try_from(self.phase).unwrap_or(0) + counts;
            self.phase = phase.rem_euclid(period).unsigned_abs();
        }
    }

    /// The pulses at the bridge; `None` while the main output is off or the counter is stopped.
    pub(super) fn pulses(&self) -> Option<Pulses> {
        if !self.has_gates || !self.registers.has(BDTR, MOE) || !self.is_counting() {
            return None;
        }
        #[expect(clippy::cast_precision_loss, reason = "20 bits")]
        let top = if self.is_up_and_down() { self.top() } else { self.top() + 1 } as f64;
        let duties = [0, 1, 2].map(|channel: usize| {
            let place = u32::try_from(channel).unwrap_or(0);
            let mode = self.registers.bits(CCMR1 + place / 2 * 4, place % 2 * 8 + 4, 3);
            let is_on = self.registers.has(CCER, place * 4);
            let compare = self.compares.get(channel).copied().unwrap_or(0);
            (is_on && mode == 6).then(|| (f64::from(compare) / top).min(1.0))
        });
        Some(Pulses {
            duties,
            dead_time_cycles: dead_time(self.registers.bits(BDTR, 0, 8)),
            period_cycles: self.period() * (self.prescaler + 1),
        })
    }

    /// Whether the complementary outputs for the low sides of the bridge are enabled.
    pub(super) fn is_complementary(&self) -> bool {
        [2, 6, 10].into_iter().all(|bit| self.registers.has(CCER, bit))
    }

    pub(super) fn read(&mut self, offset: u32, access: &mut Access<'_>) -> u32 {
        self.advance(access.at.cycle);
        match offset {
            CNT => self.count(),
            CR1 if self.is_up_and_down() => {
                let is_down = self.phase >= self.top();
                self.registers.read(offset, access) & !(1 << DIR) | u32::from(is_down) << DIR
            }
            _ => self.registers.read(offset, access),
        }
    }

    pub(super) fn write(&mut self, offset: u32, value: u32, access: &mut Access<'_>) {
        self.advance(access.at.cycle);
        match offset {
            SR => self.registers.set(SR, self.registers.get(SR) & value),
            EGR => {
                if value & 1 == 1 && !self.registers.has(CR1, UDIS) {
                    (self.phase, self.divided) = (0, 0);
                    self.update();
                    if !self.registers.has(CR1, URS) {
                        self.registers.set_bit(SR, UPDATE, true);
                    }
                    self.pulse(&[Select::RESET, Select::UPDATE], access.at.cycle);
                }
            }
            CNT => {
                self.registers.write(offset, value, access);
                self.phase = u64::from(value) % self.period();
                self.divided = 0;
            }
            DMA_ADDRESS if self.has_gates => self.registers.write(offset, value, access),
            CCR1..BDTR => {
                self.registers.write(offset, value, access);
                let channel = (offset - CCR1) / 4;
                let is_preloaded = self.registers.has(CCMR1 + channel / 2 * 4, channel % 2 * 8 + 3);
                if !is_preloaded && let Some(compare) = self.compares.get_mut(channel as usize) {
                    *compare = value;
                }
            }
            BDTR if self.has_gates => {
                let was_on = self.registers.has(BDTR, MOE);
                self.registers.write(offset, value, access);
                let is_on = self.registers.has(BDTR, MOE);
                if is_on != was_on {
                    self.switched.push((access.at.cycle, is_on));
                }
            }
            CR1 => {
                let was_counting = self.is_counting();
                self.registers.write(offset, value, access);
                if !was_counting && self.is_counting() {
                    (self.seen, self.divided) = (access.at.cycle, 0);
                }
            }
            _ => self.registers.write(offset, value, access),
        }
        self.see_levels(access.at.cycle);
    }

    /// An update event: preloaded values take effect.
    fn update(&mut self) {
        self.prescaler = self.registers.get(PSC).into();
        for (channel, compare) in (0..CHANNELS).zip(&mut self.compares) {
            *compare = self.registers.get(CCR1 + 4 * channel);
        }
        self.repetitions = self.registers.get(RCR);
    }

    /// Counts until the phase reaches `target`, at least 1.
    fn distance(&self, target: u64) -> u64 {
        let period = self.period();
        // Avoids a slow division, which is rarely needed.
        let [target, phase] =
            [target, self.phase].map(|count| if count < period { count } else { count % period });
        if target > phase { target - phase } else { target + period - phase }
    }

    /// Bit in SR of each of these flags, with the counts until the flag would be set. Counting up and down,
    /// compare matches set the flag only on the way up (CMS 2), only on the way down (CMS 1) or both ways.
    fn coming(&self, flags: u32) -> impl Iterator<Item = (u32, u64)> {
        let mode = self.registers.bits(CR1, CMS, 2);
        let period = self.period();
        (0..CHANNELS).zip(self.compares).filter_map(move |(channel, compare)| {
            let compare = u64::from(compare);
            if flags >> (channel + 1) & 1 == 0 || compare > self.top() {
                return None;
            }
            let up = self.distance(compare);
            let down = self.distance(period - compare);
            let counts = match mode {
                1 => down,
                3 => up.min(down),
                _ => up,
            };
            Some((channel + 1, counts))
        })
    }

    /// Counts until the counter overflows or changes direction.
    fn counts_to_update(&self) -> u64 {
        let overflow = self.distance(self.top() + u64::from(!self.is_up_and_down()));
        if self.is_up_and_down() { overflow.min(self.distance(0)) } else { overflow }
    }

    /// Cycle in which this number of counts has passed.
    fn cycle_of(&self, counts: u64) -> u64 {
        (self.seen + counts * (self.prescaler + 1)).saturating_sub(self.divided)
    }

    pub(super) fn advance(&mut self, now: u64) {
        while self.is_counting() {
            let cycles = self.divided + now.saturating_sub(self.seen);
            let counts = cycles / (self.prescaler + 1);
            let to_update = self.counts_to_update();
            let to_stop = to_update.min(self.counts_to_edge().unwrap_or(u64::MAX));
            let passed = counts.min(to_stop);
            let flags = self.registers.get(SR);
            let reached = self.coming(!flags).filter(|(_, distance)| *distance <= passed);
            let flags = reached.fold(flags, |flags, (bit, _)| flags | 1 << bit);
            self.registers.set(SR, flags);
            let at = self.cycle_of(passed);
            self.phase = (self.phase + passed) % self.period();
            if counts < to_stop {
                self.divided = cycles % (self.prescaler + 1);
                self.seen = now;
                return;
            }
            (self.seen, self.divided) = (at, 0);
            if passed == to_update {
                self.repetitions = match self.repetitions {
                    0 => {
                        if !self.registers.has(CR1, UDIS) {
                            self.update();
                            self.registers.set_bit(SR, UPDATE, true);
                            self.pulse(&[Select::UPDATE], at);
                        }
                        self.registers.get(RCR)
                    }
                    left => left - 1,
                };
            }
            self.see_levels(at);
        }
        self.seen = now;
    }

    /// Cycle of the next interrupt or trigger.
    pub(super) fn next_event(&self) -> u64 {
        if !self.is_counting() {
            return u64::MAX;
        }
        let wanted = self.registers.get(DIER) & !self.registers.get(SR);
        let compare = self.coming(wanted).map(|(_, counts)| self.cycle_of(counts)).min();
        let edge = self.counts_to_edge().map(|counts| self.cycle_of(counts));
        let triggers = self.has_gates && self.selects().contains(&Select::UPDATE);
        let update = (wanted & 1 == 1 || triggers || compare.is_some() || edge.is_some())
            .then(|| self.cycle_of(self.counts_to_update()));
        // An update can change the compare values, so it is an event, too.
        [compare, edge, update].into_iter().flatten().min().unwrap_or(u64::MAX)
    }

    /// Flags of SR with an enabled interrupt.
    pub(super) fn interrupts(&self) -> u32 {
        self.registers.get(SR) & self.registers.get(DIER)
    }
}

/// Dead time of BDTR.DTG in cycles, with DTS at the bus clock.
fn dead_time(code: u32) -> u32 {
    match code >> 5 {
        0..=3 => code,
        4 | 5 => (64 + (code & 0x3F)) * 2,
        6 => (32 + (code & 0x1F)) * 8,
        _ => (32 + (code & 0x1F)) * 16,
    }
}
