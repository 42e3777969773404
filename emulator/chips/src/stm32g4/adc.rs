//! Analog-to-digital converter (RM0440, chapter 21): regular conversions, started by the program, and
//! injected sequences, started by the program or by timer 1. Conversions run one after the other.
//!
//! ```text
//! trigger ──latency──▶ sampling ──12.5 cycles──▶ JDR1, JEOC ──▶ sampling ...  JDRn, JEOC, JEOS
//!                             ▲ voltage at this instant
//! ```
//! Not modelled, and a violation if selected: triggered, continuous and discontinuous regular conversions,
//! DMA, oversampling, analog watchdogs, offsets, differential inputs, resolutions below 12 bits, the queue of
//! injected sequences.

mod common;
#[cfg(test)]
mod tests;

use cycles::processor::AccessPoint;

use super::ChipModel;
use super::clock::Clock;
use super::registers::Registers;
use super::timer::{Edge, Output};
use super::violation::{Access, Violation};

pub(super) use self::common::{Common, Ticks};

const ISR: u32 = 0x00;
const IER: u32 = 0x04;
const CR: u32 = 0x08;
const CFGR: u32 = 0x0C;
const SMPR1: u32 = 0x14;
const SMPR2: u32 = 0x18;
const SQR1: u32 = 0x30;
const SQR4: u32 = 0x3C;
const DR: u32 = 0x40;
const JSQR: u32 = 0x4C;
const JDR1: u32 = 0x80;
const JDR4: u32 = 0x8C;

// Bits of CR.
const ADEN: u32 = 0;
const ADDIS: u32 = 1;
const ADSTART: u32 = 2;
const JADSTART: u32 = 3;
const ADSTP: u32 = 4;
const JADSTP: u32 = 5;
const ADVREGEN: u32 = 28;
const DEEPPWD: u32 = 29;
const ADCAL: u32 = 31;
/// Bits that a program sets and the hardware clears.
const SET_ONLY: u32 = 1 << ADCAL | 0x3F;
// Bits of ISR and IER.
const ADRDY: u32 = 0;
const EOSMP: u32 = 1;
const EOC: u32 = 2;
const EOS: u32 = 3;
const OVR: u32 = 4;
const JEOC: u32 = 5;
const JEOS: u32 = 6;
/// Bit of CFGR: an overrun overwrites data. All other bits except JQDIS are not modelled.
const OVRMOD: u32 = 12;
/// Bit of SMPR1: extends the shortest sampling time by one cycle.
const SMPPLUS: u32 = 31;

/// Startup time of the regulator (data sheet, `tADCVREG_STUP`).
const REGULATOR_S: f64 = 20e-6;
/// Duration of a calibration (data sheet, tCAL).
const CALIBRATION_TICKS: u64 = 116;
/// Time after a calibration during which ADEN is ignored (21.4.9).
const DEAF_TICKS: u64 = 4;
/// From ADEN to ADRDY: one conversion (data sheet, tSTAB).
const START_TICKS: u64 = 15;
/// Sampling times of `SMPx`, in half ticks (21.7.7).
const SAMPLING_HALVES: [u64; 8] = [5, 13, 25, 49, 95, 185, 495, 1281];
/// Conversion of 12 bits, in half ticks.
const CONVERSION_HALVES: u64 = 25;
/// Maximum clock frequency of one ADC alone, and of several ADCs together (data sheet, fADC at VDDA of 2.7 V
/// and more).
const MAX_ALONE_HZ: f64 = 60e6;
const MAX_TOGETHER_HZ: f64 = 52e6;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Group {
    Regular,
    Injected,
}

#[derive(Debug, Clone, Copy)]
struct Conversion {
    group: Group,
    /// Position in its sequence, from 0.
    place: u32,
    /// Cycle of the end of sampling.
    samples_at: u64,
    ends_at: u64,
    /// Result; `None` before the end of sampling.
    counts: Option<u32>,
}

/// An instant at which an ADC samples the voltage of a channel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sampling {
    pub(super) converter: u32,
    pub(super) channel: u32,
    /// Cycle, and the instruction that started the conversion.
    pub(super) at: AccessPoint,
}

#[derive(Debug, Clone)]
pub(super) struct Adc {
    part: ChipModel,
    number: u32,
    registers: Registers,
    /// Common clock at the last write to CR.
    ticks: Ticks,
    regulated_at: Option<u64>,
    calibrated_at: Option<u64>,
    /// First cycle in which ADEN is accepted.
    hears_from: u64,
    ready_at: Option<u64>,
    running: Option<Conversion>,
    /// Position of a regular conversion that an injected sequence has interrupted.
    interrupted: Option<u32>,
    /// Instructions that started the regular and the injected conversions.
    regular_by: u32,
    injected_by: u32,
    /// End of an injected sequence whose flag has not been cleared.
    unanswered: Option<u64>,
    /// Minimum and maximum cycles until the flag was cleared.
    answered: Option<(u64, u64)>,
}

impl Adc {
    /// Returns ADC1 or ADC2.
    pub(super) fn new(part: ChipModel, number: u32) -> Self {
        Self {
            part,
            number,
            registers: Registers::new(part, "ADC", &format!("ADC{number}")),
            ticks: Ticks::default(),
            regulated_at: None,
            calibrated_at: None,
            hears_from: 0,
            ready_at: None,
            running: None,
            interrupted: None,
            regular_by: 0,
            injected_by: 0,
            unanswered: None,
            answered: None,
        }
    }

    pub(super) fn reset(&mut self) {
        *self = Self::new(self.part, self.number);
    }

    pub(super) fn registers(&self) -> &Registers {
        &self.registers
    }

    pub(super) fn is_on(&self) -> bool {
        self.registers.has(CR, ADEN)
    }

    pub(super) fn flags(&self) -> u32 {
        self.registers.get(ISR)
    }

    /// The trigger output of timer 1 that injected sequences wait for.
    pub(super) fn awaits(&self) -> Option<Output> {
        let waits = self.registers.has(CR, JADSTART) && self.registers.bits(JSQR, 7, 2) != 0;
        if waits { self.trigger_output() } else { None }
    }

    fn trigger_output(&self) -> Option<Output> {
        match self.registers.bits(JSQR, 2, 5) {
            0 => Some(Output::Trgo),
            8 => Some(Output::Trgo2),
            _ => None,
        }
    }

    pub(super) fn read(&mut self, offset: u32, access: &mut Access<'_>) -> u32 {
        if offset == DR {
            self.registers.set_bit(ISR, EOC, false);
        }
        self.registers.read(offset, access)
    }

    /// Writes a register. `is_alone`: the other ADC is off.
    pub(super) fn write(
        &mut self,
        offset: u32,
        value: u32,
        ticks: Result<Ticks, String>,
        is_alone: bool,
        clock: &Clock,
        access: &mut Access<'_>,
    ) {
        let is_started = self.registers.has(CR, ADSTART) || self.registers.has(CR, JADSTART);
        match offset {
            ISR => {
                self.registers.set(ISR, self.registers.get(ISR) & !value);
                if value >> JEOS & 1 == 1
                    && let Some(ended) = self.unanswered.take()
                {
                    let cycles = access.at.cycle - ended;
                    let (least, most) = self.answered.unwrap_or((cycles, cycles));
                    self.answered = Some((least.min(cycles), most.max(cycles)));
                }
            }
            CR => {
                match ticks {
                    Ok(ticks) => self.ticks = ticks,
                    Err(why) if value & SET_ONLY != 0 => access.violates(why),
                    Err(_) => {}
                }
                self.control(value, is_alone, clock, access);
            }
            DR | JDR1..=JDR4 => {
                access.violates(format!("{} is written, but is read-only", self.registers.name(offset)))
            }
            IER => self.registers.write(offset, value, access),
            SMPR1 | SMPR2 | SQR1..=SQR4 | JSQR | CFGR => {
                if is_started {
                    let name = self.registers.name(offset);
                    access.violates(format!("{name} is written while conversions are started"));
                }
                self.registers.write(offset, value, access);
                if offset == CFGR && value & !(1 << OVRMOD) != 1 << 31 {
                    access.violates(format!(
                        "{} is set to {value:#010x}: not modelled",
                        self.registers.name(CFGR)
                    ));
                }
            }
            _ => {
                let before = self.registers.get(offset);
                self.registers.write(offset, value, access);
                if self.registers.get(offset) != before {
                    access.violates(format!(
                        "{} is set to {value:#010x}: not modelled",
                        self.registers.name(offset)
                    ));
                }
            }
        }
    }

    fn control(&mut self, value: u32, is_alone: bool, clock: &Clock, access: &mut Access<'_>) {
        let now = access.at.cycle;
        let before = self.registers.get(CR);
        let gets = |bit: u32| value >> bit & 1 == 1 && before >> bit & 1 == 0;
        let has = |bit: u32| before >> bit & 1 == 1;
        self.registers.write(CR, value & !SET_ONLY | before & SET_ONLY, access);
        let name = format!("ADC{}", self.number);
        if self.registers.has(CR, DEEPPWD) || !self.registers.has(CR, ADVREGEN) {
            if self.registers.has(CR, DEEPPWD) && self.registers.has(CR, ADVREGEN) {
                access.violates(format!("{name}'s regulator is switched on in deep power-down"));
            }
            self.regulated_at = None;
        } else if self.regulated_at.is_none() {
            self.regulated_at = Some(now + clock.cycles(REGULATOR_S));
        }
        let is_regulated = self.regulated_at.is_some_and(|at| at <= now);
        if gets(ADCAL) {
            if !is_regulated {
                access.violates(format!("{name} is calibrated less than 20 us after its regulator's start"));
            }
            if has(ADEN) {
                access.violates(format!("{name} is calibrated while it is on"));
            }
            self.registers.set_bit(CR, ADCAL, true);
            self.calibrated_at = Some(now + self.ticks.cycles(CALIBRATION_TICKS));
        }
        if gets(ADEN) && now >= self.hears_from {
            if has(ADCAL) {
                access.violates(format!("{name} is switched on during its calibration"));
            }
            if !is_regulated {
                access.violates(format!("{name} is switched on less than 20 us after its regulator's start"));
            }
            self.registers.set_bit(CR, ADEN, true);
            self.ready_at = Some(now + self.ticks.cycles(START_TICKS));
        }
        if gets(ADDIS) && has(ADEN) {
            if has(ADSTART) || has(JADSTART) {
                access.violates(format!("{name} is switched off while conversions are started"));
            }
            (self.ready_at, self.running, self.interrupted) = (None, None, None);
            self.registers.set(CR, self.registers.get(CR) & !0x3F);
        }
        for (stop, start, group) in [(ADSTP, ADSTART, Group::Regular), (JADSTP, JADSTART, Group::Injected)] {
            if gets(stop) {
                self.stop(start, group);
            }
        }
        for (start, group) in [(ADSTART, Group::Regular), (JADSTART, Group::Injected)] {
            if gets(start) {
                self.check_start(is_alone, access);
                self.registers.set_bit(CR, start, true);
                self.start(group, access);
            }
        }
    }

    fn stop(&mut self, start: u32, group: Group) {
        self.registers.set_bit(CR, start, false);
        if self.running.is_some_and(|running| running.group == group) {
            self.running = None;
        }
        if group == Group::Regular {
            self.interrupted = None;
        }
    }

    fn check_start(&self, is_alone: bool, access: &mut Access<'_>) {
        let name = format!("ADC{}", self.number);
        if !self.registers.has(CR, ADEN) || self.ready_at.is_some() {
            access.violates(format!("{name} is started before it is ready"));
        }
        let max_hz = if is_alone { MAX_ALONE_HZ } else { MAX_TOGETHER_HZ };
        if self.ticks.hz > max_hz {
            access.violates(format!(
                "{name} runs at {} MHz, but the data sheet allows at most {} MHz",
                self.ticks.hz / 1e6,
                max_hz / 1e6
            ));
        }
    }

    fn start(&mut self, group: Group, access: &mut Access<'_>) {
        let AccessPoint { cycle: now, code } = access.at;
        match group {
            Group::Regular => self.regular_by = code,
            Group::Injected => self.injected_by = code,
        }
        match group {
            Group::Regular => {
                if self.registers.bits(CFGR, 10, 2) != 0 {
                    access.violates(format!(
                        "ADC{}'s regular conversions wait for a trigger: not modelled",
                        self.number
                    ));
                } else if self.running.is_some() {
                    self.interrupted = Some(0);
                } else {
                    self.begin(Group::Regular, 0, now + self.ticks.latency);
                }
            }
            Group::Injected if self.registers.bits(JSQR, 7, 2) == 0 => self.inject(now),
            Group::Injected if self.trigger_output().is_none() => {
                let code = self.registers.bits(JSQR, 2, 5);
                access.violates(format!("ADC{}'s JEXTSEL is {code}: not modelled", self.number));
            }
            Group::Injected => {}
        }
    }

    /// Handles an edge of a trigger output of timer 1.
    pub(super) fn see(&mut self, edge: Edge, violations: &mut Vec<Violation>) {
        let on = self.registers.bits(JSQR, 7, 2);
        let is_wanted = if edge.is_rising { on & 1 == 1 } else { on & 2 == 2 };
        if self.awaits() != Some(edge.output) || !is_wanted {
            return;
        }
        if self.running.is_some_and(|running| running.group == Group::Injected) {
            let at = AccessPoint { cycle: edge.at, code: self.injected_by };
            Access { at, violations }
                .violates(format!("ADC{} is triggered while its injected sequence still runs", self.number));
            return;
        }
        self.inject(edge.at);
    }

    fn inject(&mut self, at: u64) {
        if let Some(Conversion { group: Group::Regular, place, .. }) = self.running {
            self.interrupted = Some(place);
        }
        self.begin(Group::Injected, 0, at + self.ticks.latency);
    }

    /// Starts sampling.
    fn begin(&mut self, group: Group, place: u32, at: u64) {
        let sampling = self.sampling_halves(self.channel(group, place));
        self.running = Some(Conversion {
            group,
            place,
            samples_at: at + self.ticks.half_cycles(sampling),
            ends_at: at + self.ticks.half_cycles(sampling + CONVERSION_HALVES),
            counts: None,
        });
    }

    fn channel(&self, group: Group, place: u32) -> u32 {
        match group {
            Group::Injected => self.registers.bits(JSQR, 9 + 6 * place, 5),
            Group::Regular => self.registers.bits(SQR1 + (place + 1) / 5 * 4, (place + 1) % 5 * 6, 5),
        }
    }

    fn sampling_halves(&self, channel: u32) -> u64 {
        let code = match channel {
            0..=9 => self.registers.bits(SMPR1, 3 * channel, 3),
            _ => self.registers.bits(SMPR2, 3 * channel.min(18) - 30, 3),
        };
        let halves = SAMPLING_HALVES.get(code as usize).copied().unwrap_or(0);
        if code == 0 && self.registers.has(SMPR1, SMPPLUS) { halves + 2 } else { halves }
    }

    /// Advances to cycle `now`; `sample` returns the counts of the sampled voltage.
    pub(super) fn advance(&mut self, now: u64, mut sample: impl FnMut(Sampling) -> u32) {
        if let Some(at) = self.calibrated_at.filter(|at| *at <= now) {
            self.calibrated_at = None;
            self.registers.set_bit(CR, ADCAL, false);
            self.hears_from = at + self.ticks.cycles(DEAF_TICKS);
        }
        if self.ready_at.is_some_and(|at| at <= now) {
            self.ready_at = None;
            self.registers.set_bit(ISR, ADRDY, true);
        }
        while let Some(running) = self.running {
            match running.counts {
                None if running.samples_at <= now => {
                    let code = match running.group {
                        Group::Regular => self.regular_by,
                        Group::Injected => self.injected_by,
                    };
                    let counts = sample(Sampling {
                        converter: self.number,
                        channel: self.channel(running.group, running.place),
                        at: AccessPoint { cycle: running.samples_at, code },
                    });
                    if running.group == Group::Regular {
                        self.registers.set_bit(ISR, EOSMP, true);
                    }
                    self.running = Some(Conversion { counts: Some(counts), ..running });
                }
                Some(counts) if running.ends_at <= now => self.finish(&running, counts),
                _ => return,
            }
        }
    }

    fn finish(&mut self, done: &Conversion, counts: u32) {
        self.running = None;
        let is_last = match done.group {
            Group::Injected => {
                self.registers.set(JDR1 + 4 * done.place, counts);
                self.registers.set_bit(ISR, JEOC, true);
                done.place == self.registers.bits(JSQR, 0, 2)
            }
            Group::Regular => {
                let is_lost = self.registers.has(ISR, EOC);
                if is_lost {
                    self.registers.set_bit(ISR, OVR, true);
                }
                if !is_lost || self.registers.has(CFGR, OVRMOD) {
                    self.registers.set(DR, counts);
                }
                self.registers.set_bit(ISR, EOC, true);
                done.place == self.registers.bits(SQR1, 0, 4)
            }
        };
        match done.group {
            group if !is_last => self.begin(group, done.place + 1, done.ends_at),
            Group::Regular => {
                self.registers.set_bit(ISR, EOS, true);
                self.registers.set_bit(CR, ADSTART, false);
            }
            Group::Injected => {
                self.registers.set_bit(ISR, JEOS, true);
                self.unanswered = Some(self.unanswered.unwrap_or(done.ends_at));
                if self.registers.bits(JSQR, 7, 2) == 0 {
                    self.registers.set_bit(CR, JADSTART, false);
                }
                if let Some(place) = self.interrupted.take() {
                    self.begin(Group::Regular, place, done.ends_at);
                }
            }
        }
    }

    pub(super) fn next_event(&self) -> u64 {
        let conversion = self
            .running
            .map(|running| if running.counts.is_none() { running.samples_at } else { running.ends_at });
        [self.calibrated_at, self.ready_at, conversion].into_iter().flatten().min().unwrap_or(u64::MAX)
    }

    /// Takes the minimum and maximum cycles from the end of an injected sequence until its flag was cleared,
    /// since the last call.
    pub(super) fn take_response_cycles(&mut self) -> Option<(u64, u64)> {
        self.answered.take()
    }

    pub(super) fn wants_interrupt(&self) -> bool {
        self.registers.get(ISR) & self.registers.get(IER) != 0
    }
}
