//! FDCAN (RM0440, chapter 44): Bosch's M_CAN with a fixed layout of its message RAM.
//!
//! ```text
//! program ──▶ TX buffers ──offer──▶ CanBus ──Passage──▶ filters ──▶ RX FIFOs ──▶ program
//!                                  (who goes, who hears it, what becomes of it)
//! ```
//! The bus decides about whole frames and says what will become of each; the controller lets it happen at that time.
//! Without a bus, what is to be sent waits for ever.
//!
//! Not modelled, and a violation where a program asks for it: test modes, the timeout counter, timestamps from timer 3. A
//! controller that is stopped in the middle of a frame does not spoil that frame for others.

mod buffers;
mod errors;
mod fifo;
mod filters;
mod message;
mod ram;
mod rates;

use std::collections::VecDeque;

pub use message::{Message, WireBits};
pub(crate) use rates::Rates;

use self::buffers::{Buffers, Request};
use self::errors::Errors;
use self::fifo::Fifo;
use self::ram::{ELEMENT_BYTES, RX_FIFOS, Ram, TX_BUFFERS, TX_EVENTS};
use super::Part;
use super::registers::Registers;
use super::violation::Access;

const DBTP: u32 = 0x0C;
const TEST: u32 = 0x10;
const RWD: u32 = 0x14;
const CCCR: u32 = 0x18;
const NBTP: u32 = 0x1C;
const TSCC: u32 = 0x20;
const TSCV: u32 = 0x24;
const TOCC: u32 = 0x28;
const ECR: u32 = 0x40;
const PSR: u32 = 0x44;
const TDCR: u32 = 0x48;
const IR: u32 = 0x50;
const IE: u32 = 0x54;
const ILS: u32 = 0x58;
const ILE: u32 = 0x5C;
const RXGFC: u32 = 0x80;
const XIDAM: u32 = 0x84;
const HPMS: u32 = 0x88;
const RXF0S: u32 = 0x90;
const RXF0A: u32 = 0x94;
const RXF1S: u32 = 0x98;
const RXF1A: u32 = 0x9C;
const TXBC: u32 = 0xC0;
const TXFQS: u32 = 0xC4;
const TXBRP: u32 = 0xC8;
const TXBAR: u32 = 0xCC;
const TXBCR: u32 = 0xD0;
const TXBTO: u32 = 0xD4;
const TXBCF: u32 = 0xD8;
const TXBTIE: u32 = 0xDC;
const TXBCIE: u32 = 0xE0;
const TXEFS: u32 = 0xE4;
const TXEFA: u32 = 0xE8;
const CKDIV: u32 = 0x100;

// Of CCCR.
const INIT: u32 = 0;
const CCE: u32 = 1;
const ASM: u32 = 2;
const CSA: u32 = 3;
const CSR: u32 = 4;
const MON: u32 = 5;
const DAR: u32 = 6;
const FDOE: u32 = 8;
const BRSE: u32 = 9;
const PXHD: u32 = 12;
/// Bits that a program changes only while INIT and CCE are set: DAR, FDOE, BRSE, PXHD, EFBI, TXP, NISO.
const PROTECTED: u32 = 0xF340;
/// Bits that it sets only then, and clears at any time: ASM, MON, TEST.
const PROTECTED_FROM_SETTING: u32 = 0xA4;
const TEST_MODE: u32 = 7;
/// Of DBTP.
const TDC: u32 = 23;
/// Of TXBC: a queue, no FIFO.
const TFQM: u32 = 24;
/// Of RXGFC: FIFO 1's, then FIFO 0's in the next bit.
const F1OM: u32 = 8;

// Of IR and IE.
const RF0N: u32 = 0;
const RF0L: u32 = 2;
const RF1N: u32 = 3;
const HPM: u32 = 6;
const TC: u32 = 7;
const TCF: u32 = 8;
const TFE: u32 = 9;
const TEFN: u32 = 10;
const TEFF: u32 = 11;
const TEFL: u32 = 12;
const TSW: u32 = 13;
const EP: u32 = 17;
const EW: u32 = 18;
const BO: u32 = 19;
const PEA: u32 = 21;
const PED: u32 = 22;
/// Bits of IR that each bit of ILS puts on a line.
const GROUPS: [u32; 7] = [
    0b111,
    0b111 << RF1N,
    0b111 << HPM,
    0b1111 << TFE,
    0b111 << TSW,
    0b11 << 16,
    0b11_1111 << EW,
];

/// No error since the program asked last.
const NO_CHANGE: u32 = 7;
/// Recessive bits that let a controller take part.
const IDLE_BITS: f64 = 11.0;
/// So often, where it was off the bus. ISO 11898-1 asks for 128 times; the controller adds one.
const SEQUENCES_AFTER_BUS_OFF: u32 = 129;
/// Most that TDCO and the quanta before a sample may be.
const LONGEST_COMPENSATED_PRESCALER: u32 = 1;

/// What a frame came to for one controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// It sent the frame and somebody acknowledged it.
    Sent,
    /// The frame came in.
    Received,
    /// It sent the frame, and there was an error.
    NotSent(Error),
    /// The frame came with an error; whether this controller was the first to say so.
    NotReceived { error: Error, is_first: bool },
    /// It does not take part, and waits for the bus to be idle.
    Ignored,
}

/// What `PSR.LEC` says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Error {
    Stuff = 1,
    Form = 2,
    Acknowledge = 3,
    /// It sent recessive, and read dominant.
    Recessive = 4,
    /// It sent dominant, and read recessive.
    Dominant = 5,
}

/// A frame on the bus as one controller meets it; times in its cycles.
#[derive(Debug, Clone)]
pub(crate) struct Passage {
    pub(crate) message: Message,
    pub(crate) begins: u64,
    /// When its outcome shows.
    pub(crate) ends: u64,
    /// When the next one may begin.
    pub(crate) free: u64,
    pub(crate) outcome: Outcome,
    /// Whether an error was in the part of the data bit rate.
    pub(crate) is_data_error: bool,
}

/// A frame that a controller would send.
#[derive(Debug, Clone)]
pub(crate) struct Offer {
    pub(crate) message: Message,
    /// From when on.
    pub(crate) since: u64,
}

/// How far it takes part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Presence {
    /// INIT is set.
    Out,
    /// It waits for so many idle sequences, from the cycle on in which the bus became recessive.
    Joining { sequences: u32, since: u64 },
    In,
}

/// The controller.
#[derive(Debug)]
pub(crate) struct Fdcan {
    part: Part,
    registers: Registers,
    /// Of its own clock; none while that does not run.
    kernel_hz: Option<f64>,
    bus_hz: f64,
    presence: Presence,
    buffers: Buffers,
    received: [Fifo; 2],
    events: Fifo,
    errors: Errors,
    /// `PSR.LEC` and `PSR.DLEC`.
    last_errors: [u32; 2],
    /// Of the last FD frame: `RESI`, `RBRS` and `RFDF` of PSR.
    last_fd: u32,
    passages: VecDeque<Passage>,
    /// When an error-passive sender may go on.
    suspended_until: u64,
    idle_at: u64,
    timestamps_since: u64,
    wraps_seen: u64,
    /// Whether a bus is connected.
    pub(crate) is_wired: bool,
}

impl Fdcan {
    pub(super) fn new(part: Part) -> Self {
        Self {
            part,
            registers: Registers::new(part, "FDCAN", "FDCAN1"),
            kernel_hz: None,
            bus_hz: 1.0,
            presence: Presence::Out,
            buffers: Buffers::default(),
            received: [Fifo::default(); 2],
            events: Fifo::default(),
            errors: Errors::default(),
            last_errors: [NO_CHANGE; 2],
            last_fd: 0,
            passages: VecDeque::new(),
            suspended_until: 0,
            idle_at: 0,
            timestamps_since: 0,
            wraps_seen: 0,
            is_wired: false,
        }
    }

    pub(super) fn reset(&mut self) {
        let Self { kernel_hz, bus_hz, is_wired, .. } = *self;
        *self = Self { kernel_hz, bus_hz, is_wired, ..Self::new(self.part) };
    }

    pub(super) fn registers(&self) -> &Registers {
        &self.registers
    }

    /// Its clock, and that of the buses and the processor.
    pub(super) fn set_clock(&mut self, kernel_hz: Option<f64>, bus_hz: f64) {
        (self.kernel_hz, self.bus_hz) = (kernel_hz, bus_hz);
    }

    /// Cycles of so many bits at the nominal rate.
    fn cycles(&self, bits: f64) -> u64 {
        let duration_s = self.rates().map_or(0.0, |rates| rates.nominal.duration_s);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "casts saturate")]
        let cycles = (bits * duration_s * self.bus_hz).round() as u64;
        cycles
    }

    /// Bit rates; none without a clock.
    pub(crate) fn rates(&self) -> Option<Rates> {
        self.kernel_hz.map(|hz| Rates::new(&self.registers, hz))
    }

    pub(crate) fn is_passive(&self) -> bool {
        self.errors.is_passive()
    }

    /// Error counters of what it sends and what it receives.
    pub(crate) fn error_counters(&self) -> (u32, u32) {
        (self.errors.transmit, self.errors.receive)
    }

    /// Whether it left the bus for its errors, or has not yet come back.
    pub(crate) fn is_off(&self) -> bool {
        self.errors.is_off()
    }

    /// Whether it takes part in a frame that begins at a cycle; none where it is not there at all.
    pub(crate) fn takes_part(&self, begins: u64) -> Option<bool> {
        match self.presence {
            Presence::Out => None,
            Presence::Joining { .. } => Some(self.joined_at().is_some_and(|at| at <= begins)),
            Presence::In => Some(true),
        }
    }

    /// Whether it says by dominant bits what it has seen: an acknowledge, an error.
    pub(crate) fn speaks(&self) -> bool {
        !self.registers.has(CCCR, MON)
    }

    pub(crate) fn knows_fd(&self) -> bool {
        self.registers.has(CCCR, FDOE)
    }

    /// Whether it waits for the end of a frame of a kind that it does not know, instead of breaking it off.
    pub(crate) fn tolerates_unknown(&self) -> bool {
        !self.registers.has(CCCR, PXHD)
    }

    /// Whether what it sends is compared with what it reads back as late as the transceiver gives it back.
    pub(crate) fn compensates_delay(&self) -> bool {
        self.registers.has(DBTP, TDC)
    }

    fn is_queue(&self) -> bool {
        self.registers.has(TXBC, TFQM)
    }

    /// The buffer whose message is at a place of message RAM, while it is to be sent.
    pub(super) fn pending_at(&self, offset: u32) -> Option<u32> {
        let place = offset.checked_sub(TX_BUFFERS)? / ELEMENT_BYTES;
        (self.buffers.pending() >> place.min(31) & 1 == 1).then_some(place)
    }

    fn joined_at(&self) -> Option<u64> {
        match self.presence {
            Presence::Joining { sequences, since } => {
                Some(since + self.cycles(IDLE_BITS * f64::from(sequences)))
            }
            _ => None,
        }
    }

    pub(super) fn read(&mut self, offset: u32, ram: &mut [u8], access: &mut Access<'_>) -> u32 {
        self.advance(access.at.cycle, ram);
        let stored = self.registers.read(offset, access);
        match offset {
            PSR => self.status(access.at.cycle),
            ECR => {
                let value = self.errors.register();
                self.errors.logged = 0;
                value
            }
            IR => {
                self.see_wrap(access.at.cycle);
                self.registers.get(IR)
            }
            RXF0S => self.received[0].register(),
            RXF1S => self.received[1].register(),
            TXFQS => self.buffers.register(self.is_queue()),
            TXBRP => self.buffers.pending(),
            TXBTO => self.buffers.sent,
            TXBCF => self.buffers.cancelled,
            TXEFS => self.events.register(),
            TSCV => self.timestamp(access.at.cycle),
            _ => stored,
        }
    }

    /// `PSR`; what it says of the last frame is said once.
    fn status(&mut self, now: u64) -> u32 {
        let activity = match (self.presence, self.passages.front()) {
            (Presence::Out | Presence::Joining { .. }, _) => 0,
            (Presence::In, Some(passage)) if passage.begins <= now => match passage.outcome {
                Outcome::Sent | Outcome::NotSent(_) => 3,
                _ => 2,
            },
            _ => 1,
        };
        let [error, data_error] = std::mem::replace(&mut self.last_errors, [NO_CHANGE; 2]);
        error
            | activity << 3
            | u32::from(self.errors.is_passive()) << 5
            | u32::from(self.errors.is_warned()) << 6
            | u32::from(self.errors.is_off()) << 7
            | data_error << 8
            | std::mem::take(&mut self.last_fd)
    }

    /// Counts of the timestamp's counter: one per nominal bit and prescaler.
    fn counts(&self, now: u64) -> u64 {
        if self.registers.bits(TSCC, 0, 2) != 1 {
            return 0;
        }
        let count = self.cycles(f64::from(self.registers.bits(TSCC, 16, 4) + 1)).max(1);
        now.saturating_sub(self.timestamps_since) / count
    }

    fn timestamp(&self, now: u64) -> u32 {
        u32::try_from(self.counts(now) & 0xFFFF).unwrap_or(0)
    }

    fn see_wrap(&mut self, now: u64) {
        let wraps = self.counts(now) >> 16;
        if wraps > self.wraps_seen {
            self.raise(TSW);
        }
        self.wraps_seen = wraps;
    }

    fn raise(&mut self, flag: u32) {
        self.registers.set_bit(IR, flag, true);
    }

    fn may_configure(&self) -> bool {
        self.registers.get(CCCR) & 3 == 3
    }

    pub(super) fn write(&mut self, offset: u32, value: u32, ram: &mut [u8], access: &mut Access<'_>) {
        self.advance(access.at.cycle, ram);
        let now = access.at.cycle;
        match offset {
            CCCR => self.control(value, access),
            NBTP | DBTP | TDCR | TSCC | TOCC | RWD | RXGFC | XIDAM | TXBC | CKDIV | TEST => {
                self.configure(offset, value, access);
            }
            IR => {
                self.see_wrap(now);
                self.registers.set(IR, self.registers.get(IR) & !value);
                for (fifo, lost) in self.received.iter_mut().zip([RF0L, RF0L + RF1N]) {
                    fifo.has_lost &= value >> lost & 1 == 0;
                }
                self.events.has_lost &= value >> TEFL & 1 == 0;
            }
            TSCV => {
                (self.timestamps_since, self.wraps_seen) = (now, 0);
            }
            RXF0A | RXF1A | TXEFA => {
                self.registers.write(offset, value, access);
                let [first, second] = &mut self.received;
                let fifo = match offset {
                    RXF0A => first,
                    RXF1A => second,
                    _ => &mut self.events,
                };
                if !fifo.acknowledge(value) {
                    access.violates(format!(
                        "{} acknowledges element {value}, which holds nothing",
                        self.registers.name(offset)
                    ));
                }
            }
            TXBAR | TXBCR => {
                self.registers.write(offset, value, access);
                self.registers.set(offset, 0);
                if self.registers.has(CCCR, CCE) {
                    access.violates(format!("{} is written while CCE is set", self.registers.name(offset)));
                } else if offset == TXBAR {
                    (0..buffers::COUNT)
                        .filter(|place| value >> place & 1 == 1)
                        .for_each(|place| self.request(place, ram, access));
                } else {
                    (0..buffers::COUNT)
                        .filter(|place| value >> place & 1 == 1)
                        .for_each(|place| self.cancel(place, now));
                }
            }
            PSR | ECR | HPMS | RXF0S | RXF1S | TXFQS | TXBRP | TXBTO | TXBCF | TXEFS => {
                access.violates(format!("{} is written, which can only be read", self.registers.name(offset)));
            }
            _ => self.registers.write(offset, value, access),
        }
    }

    /// A register that holds how the controller works.
    fn configure(&mut self, offset: u32, value: u32, access: &mut Access<'_>) {
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
            RXGFC if too_many => "FDCAN1_RXGFC counts more filters than message RAM holds",
            TOCC if value & 1 == 1 => "FDCAN1_TOCC starts the timeout counter: not modelled",
            TSCC if mode > 1 => "FDCAN1_TSCC takes timestamps from timer 3: not modelled",
            TEST if value >> 4 & 7 != 0 => "FDCAN1_TEST asks for a test mode: not modelled",
            DBTP if compensates && prescaler > LONGEST_COMPENSATED_PRESCALER => {
                "FDCAN1_DBTP compensates delay with a prescaler above 2"
            }
            _ => return,
        };
        access.violates(fault);
    }

    fn control(&mut self, value: u32, access: &mut Access<'_>) {
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

    /// What setting CCE does to the state.
    fn clear(&mut self) {
        self.buffers = Buffers::default();
        self.received = [Fifo::default(); 2];
        self.events = Fifo::default();
        self.registers.set(HPMS, 0);
    }

    fn leave(&mut self) {
        self.presence = Presence::Out;
        self.passages.clear();
        self.buffers.on_wire = None;
    }

    /// INIT was cleared.
    fn join(&mut self, access: &mut Access<'_>) {
        if self.kernel_hz.is_none() {
            access.violates("FDCAN1 is started, and the clock that RCC_CCIPR selects for it does not run");
            return;
        }
        let sequences = if self.errors.is_off() { SEQUENCES_AFTER_BUS_OFF } else { 1 };
        self.presence = Presence::Joining { sequences, since: access.at.cycle };
    }

    fn request(&mut self, place: usize, ram: &mut [u8], access: &mut Access<'_>) {
        let is_queue = self.is_queue();
        if self.buffers.get(place).is_some() || !is_queue && !self.buffers.is_next(place) {
            access.violates(format!("FDCAN1_TXBAR asks for buffer {place}, which is not the next free one"));
            return;
        }
        if self.registers.get(CCCR) & (1 << MON | 1 << ASM) != 0 {
            access.violates("FDCAN1_TXBAR asks to send in a mode that only listens");
            return;
        }
        let message = self.message(place, ram);
        let request = Request { message, since: access.at.cycle, is_cancelled: false };
        self.buffers.request(place, request, is_queue);
    }

    fn message(&self, place: usize, ram: &mut [u8]) -> Message {
        let ram = Ram(ram);
        let begin = TX_BUFFERS + ELEMENT_BYTES * u32::try_from(place).unwrap_or(0);
        let word = |word: usize| ram.word(begin + 4 * u32::try_from(word).unwrap_or(0));
        let allows = |bit: u32| self.registers.has(CCCR, bit);
        Message {
            is_from_passive: self.errors.is_passive() && allows(FDOE) && word(1) >> 21 & 1 == 1,
            ..Message::from_words(word, allows(FDOE), allows(BRSE))
        }
    }

    fn cancel(&mut self, place: usize, now: u64) {
        let is_queue = self.is_queue();
        // Since the bus was last idle, it may have begun: the bus will say.
        let may_be_on_wire = self.buffers.on_wire == Some(place)
            || self.is_wired
                && self.presence == Presence::In
                && self.buffers.next(is_queue) == Some(place)
                && self.idle_at.max(self.suspended_until) <= now;
        let Some(Some(request)) = self.buffers.requests.get_mut(place) else { return };
        request.is_cancelled = true;
        if !may_be_on_wire {
            self.give_up(place);
        }
    }

    /// A request ends without having been sent.
    fn give_up(&mut self, place: usize) {
        self.buffers.finish(place, self.is_queue());
        self.buffers.cancelled |= 1 << place;
        if self.registers.has(TXBCIE, u32::try_from(place).unwrap_or(0)) {
            self.raise(TCF);
        }
    }

    /// What it would send next.
    pub(crate) fn offer(&self) -> Option<Offer> {
        let place = self.buffers.next(self.is_queue()).filter(|_| self.buffers.on_wire.is_none())?;
        let request = self.buffers.get(place)?;
        let joined = match self.presence {
            Presence::Out => return None,
            Presence::Joining { .. } => self.joined_at()?,
            Presence::In => 0,
        };
        let since = request.since.max(self.suspended_until).max(joined);
        Some(Offer { message: request.message.clone(), since })
    }

    /// The bus has decided all that begins up to now: what was cancelled and has not begun does not begin.
    /// Whether something has changed by that.
    pub(crate) fn settle(&mut self) -> bool {
        let before = self.buffers.cancelled;
        for place in 0..buffers::COUNT {
            let is_over = self.buffers.get(place).is_some_and(|request| request.is_cancelled)
                && self.buffers.on_wire != Some(place);
            if is_over {
                self.give_up(place);
            }
        }
        self.buffers.cancelled != before
    }

    /// A frame begins on the bus.
    pub(crate) fn begin(&mut self, passage: Passage) {
        if let Some(joined_at) = self.joined_at() {
            if joined_at <= passage.begins {
                self.enter();
            } else if let Presence::Joining { sequences, since } = self.presence {
                let passed = passage.begins.saturating_sub(since) / self.cycles(IDLE_BITS).max(1);
                let left = sequences.saturating_sub(u32::try_from(passed).unwrap_or(u32::MAX)).max(1);
                self.presence = Presence::Joining { sequences: left, since: self.quiet_since(&passage) };
            }
        }
        match passage.outcome {
            Outcome::Sent | Outcome::NotSent(_) => self.buffers.on_wire = self.buffers.next(self.is_queue()),
            Outcome::Ignored if self.presence == Presence::In => {
                self.presence = Presence::Joining { sequences: 1, since: self.quiet_since(&passage) };
            }
            _ => {}
        }
        self.idle_at = passage.free;
        self.passages.push_back(passage);
    }

    /// Behind any frame, 11 recessive bits end when the next one may begin.
    fn quiet_since(&self, passage: &Passage) -> u64 {
        passage.free.saturating_sub(self.cycles(IDLE_BITS))
    }

    /// It takes part from now on.
    fn enter(&mut self) {
        self.presence = Presence::In;
        if self.errors.is_off() {
            let before = self.errors;
            self.errors = Errors { logged: before.logged, ..Errors::default() };
            self.see_errors(before);
        }
    }

    pub(super) fn advance(&mut self, now: u64, ram: &mut [u8]) {
        while let Some(passage) = self.passages.pop_front_if(|passage| passage.ends <= now) {
            self.end(&passage, &mut Ram(ram));
        }
        if self.joined_at().is_some_and(|at| at <= now) {
            self.enter();
        }
    }

    pub(super) fn next_event(&self) -> u64 {
        let passage = self.passages.front().map_or(u64::MAX, |passage| passage.ends);
        passage.min(self.joined_at().unwrap_or(u64::MAX))
    }

    /// What a frame leaves behind.
    fn end(&mut self, passage: &Passage, ram: &mut Ram<'_>) {
        let before = self.errors;
        let is_passive = before.is_passive();
        match passage.outcome {
            Outcome::Ignored => {}
            Outcome::Sent => {
                self.errors.has_sent();
                self.last_errors[0] = 0;
                self.sent(passage, ram);
            }
            Outcome::Received => {
                self.errors.has_received();
                self.last_errors[0] = 0;
                self.receive(passage, ram);
            }
            Outcome::NotSent(error) => {
                self.errors.has_not_sent(error == Error::Acknowledge);
                self.note_error(error, passage.is_data_error);
                if let Some(place) = self.buffers.on_wire.take() {
                    let is_over = self.registers.has(CCCR, DAR)
                        || self.buffers.get(place).is_some_and(|request| request.is_cancelled);
                    if is_over {
                        self.give_up(place);
                    }
                }
            }
            Outcome::NotReceived { error, is_first } => {
                self.errors.has_not_received(is_first);
                self.note_error(error, passage.is_data_error);
            }
        }
        if matches!(passage.outcome, Outcome::Sent | Outcome::NotSent(_)) && is_passive {
            self.suspended_until = passage.free + self.cycles(8.0);
        }
        self.see_errors(before);
    }

    fn note_error(&mut self, error: Error, is_data_error: bool) {
        self.last_errors[usize::from(is_data_error)] = error as u32;
        self.raise(if is_data_error { PED } else { PEA });
    }

    /// Flags of what has changed with the counters.
    fn see_errors(&mut self, before: Errors) {
        let now = self.errors;
        let changes = [
            (EW, before.is_warned() != now.is_warned()),
            (EP, before.is_passive() != now.is_passive()),
            (BO, before.is_off() != now.is_off()),
        ];
        changes.into_iter().filter(|(_, changed)| *changed).for_each(|(flag, _)| self.raise(flag));
        if now.is_off() && !before.is_off() {
            self.registers.set_bit(CCCR, INIT, true);
            self.leave();
        }
    }

    fn sent(&mut self, passage: &Passage, ram: &mut Ram<'_>) {
        let Some(place) = self.buffers.on_wire else { return };
        let was_cancelled = self.buffers.get(place).is_some_and(|request| request.is_cancelled);
        let number = u32::try_from(place).unwrap_or(0);
        self.buffers.finish(place, self.is_queue());
        self.buffers.sent |= 1 << place;
        if was_cancelled {
            self.buffers.cancelled |= 1 << place;
        }
        if self.registers.has(TXBTIE, number) {
            self.raise(TC);
        }
        if self.buffers.pending() == 0 && !self.is_queue() {
            self.raise(TFE);
        }
        let second = ram.word(TX_BUFFERS + ELEMENT_BYTES * number + 4);
        if second >> 23 & 1 == 0 {
            return;
        }
        let Some(place) = self.events.put(false) else {
            self.raise(TEFL);
            return;
        };
        let kind = if was_cancelled { 2 } else { 1 };
        let begin = TX_EVENTS + 8 * place;
        ram.set(begin, passage.message.first_word());
        let stamp = self.timestamp(passage.begins);
        ram.set(begin + 4, second & 0xFF00_0000 | kind << 22 | passage.message.second_word() | stamp);
        self.raise(TEFN);
        if self.events.is_full() {
            self.raise(TEFF);
        }
    }

    fn receive(&mut self, passage: &Passage, ram: &mut Ram<'_>) {
        let message = &passage.message;
        if message.is_fd {
            self.last_fd = u32::from(message.is_from_passive) << 11
                | u32::from(message.switches_rate) << 12
                | 1 << 13;
        }
        let found = filters::look_up(&self.registers, ram, message);
        let stamp = self.timestamp(passage.begins);
        let overwrites = [1, 0].map(|bit| self.registers.has(RXGFC, F1OM + bit));
        let mut stored = None;
        let mut flags = Vec::new();
        if let Some(number) = found.fifo
            && let Some(fifo) = self.received.get_mut(number)
        {
            let first_flag = if number == 0 { RF0N } else { RF1N };
            stored = fifo.put(overwrites.get(number).copied().unwrap_or(false));
            match stored {
                None => flags.push(first_flag + RF0L),
                Some(place) => {
                    let begin = RX_FIFOS.get(number).copied().unwrap_or(0) + ELEMENT_BYTES * place;
                    let filter = found.filter.map_or(1 << 31, |filter| filter << 24);
                    ram.set(begin, message.first_word());
                    ram.set(begin + 4, filter | message.second_word() | stamp);
                    for (chunk, offset) in message.data.chunks(4).zip((begin + 8..).step_by(4)) {
                        let word = chunk.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte));
                        ram.set(offset, word);
                    }
                    flags.push(first_flag);
                    if fifo.is_full() {
                        flags.push(first_flag + 1);
                    }
                }
            }
        }
        if found.has_priority {
            let storage = match (found.fifo, stored) {
                (None, _) => 0,
                (Some(_), None) => 1,
                (Some(number), Some(_)) => 2 + u32::try_from(number).unwrap_or(0),
            };
            let filter = found.filter.unwrap_or(0);
            let list = u32::from(message.is_extended) << 15;
            self.registers.set(HPMS, list | filter << 8 | storage << 6 | stored.unwrap_or(0));
            flags.push(HPM);
        }
        flags.into_iter().for_each(|flag| self.raise(flag));
    }

    /// Both interrupt lines.
    pub(super) fn interrupts(&self) -> [bool; 2] {
        let flags = self.registers.get(IR) & self.registers.get(IE);
        if flags == 0 {
            return [false; 2];
        }
        let lines = self.registers.get(ILS);
        let selected = GROUPS.iter().enumerate().filter(|(group, _)| lines >> group & 1 == 1);
        let second: u32 = selected.map(|(_, bits)| bits).sum();
        let enabled = self.registers.get(ILE);
        [flags & !second != 0 && enabled & 1 == 1, flags & second != 0 && enabled >> 1 & 1 == 1]
    }
}
