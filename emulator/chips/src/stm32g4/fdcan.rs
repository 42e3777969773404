//! FDCAN (RM0440, chapter 44): Bosch's `M_CAN` with a fixed layout of its message RAM.
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
mod layout;
mod message;
mod ram;
mod rates;
mod setup;
mod store;
mod traffic;

use std::collections::VecDeque;

pub(crate) use message::LENGTHS;
pub use message::{Message, WireBits};
pub(crate) use rates::Rates;
pub(crate) use traffic::{Error, Offer, Outcome, Passage};

use self::buffers::Buffers;
use self::errors::Errors;
use self::fifo::Fifo;
use self::layout::{
    CCCR, CCE, CKDIV, DBTP, ECR, FDOE, GROUPS, HPMS, IDLE_BITS, IE, ILE, ILS, IR, MON, NBTP, NO_CHANGE, PSR,
    PXHD, RF0L, RF1N, RWD, RXF0A, RXF0S, RXF1A, RXF1S, RXGFC, TDC, TDCR, TEFL, TEST, TFQM, TOCC, TSCC, TSCV,
    TSW, TXBAR, TXBC, TXBCF, TXBCR, TXBRP, TXBTO, TXEFA, TXEFS, TXFQS, XIDAM,
};
use self::ram::{ELEMENT_BYTES, Ram, TX_BUFFERS};
use super::Part;
use super::registers::Registers;
use super::violation::Access;

/// How far it takes part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Presence {
    /// INIT is set.
    Out,
    /// It waits for so many idle sequences, from the cycle on in which the bus became recessive.
    Joining {
        sequences: u32,
        since: u64,
    },
    In,
}

/// The controller.
#[derive(Debug, Clone)]
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
                access
                    .violates(format!("{} is written, which can only be read", self.registers.name(offset)));
            }
            _ => self.registers.write(offset, value, access),
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
