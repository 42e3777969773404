//! FDCAN (RM0440, chapter 44): Bosch's `M_CAN` with a fixed layout of its message RAM.
//!
//! ```text
//! program ──▶ TX buffers ──offer──▶ CanBus ──Passage──▶ filters ──▶ RX FIFOs ──▶ program
//!                                   (arbitration, receivers, outcome)
//! ```
//! The bus decides the outcome of whole frames, with the time of each outcome; the controller applies it at
//! that time. Without a bus, pending frames wait forever.
//!
//! Not modelled, and a violation if selected: test modes, the timeout counter, timestamps from timer 3. A
//! controller that is stopped during a frame does not corrupt the frame for other nodes.

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
use super::ChipModel;
use super::registers::Registers;
use super::violation::Access;

/// Participation of the controller in bus traffic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Presence {
    /// INIT is set.
    Initialisation,
    /// The controller waits for this number of idle sequences, from the cycle in which the bus became
    /// recessive.
    Integrating {
        sequences: u32,
        since: u64,
    },
    In,
}

/// The controller.
#[derive(Debug, Clone)]
pub(crate) struct Fdcan {
    part: ChipModel,
    registers: Registers,
    /// Frequency of its own clock; `None` while the clock is off.
    kernel_hz: Option<f64>,
    bus_hz: f64,
    presence: Presence,
    buffers: Buffers,
    received: [Fifo; 2],
    events: Fifo,
    errors: Errors,
    /// `PSR.LEC` and `PSR.DLEC`.
    last_errors: [u32; 2],
    /// State of the last FD frame: `RESI`, `RBRS` and `RFDF` of PSR.
    last_fd: u32,
    passages: VecDeque<Passage>,
    /// Cycle from which an error-passive sender may send again.
    suspended_until: u64,
    idle_at: u64,
    timestamps_since: u64,
    wraps_seen: u64,
    /// Whether a bus is connected.
    pub(crate) is_wired: bool,
}

impl Fdcan {
    pub(super) fn new(part: ChipModel) -> Self {
        Self {
            part,
            registers: Registers::new(part, "FDCAN", "FDCAN1"),
            kernel_hz: None,
            bus_hz: 1.0,
            presence: Presence::Initialisation,
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

    /// Sets the frequencies of its own clock, and of the processor and the buses.
    pub(super) fn set_clock(&mut self, kernel_hz: Option<f64>, bus_hz: f64) {
        (self.kernel_hz, self.bus_hz) = (kernel_hz, bus_hz);
    }

    /// Cycles of this number of bits at the nominal rate.
    fn cycles(&self, bits: f64) -> u64 {
        let duration_s = self.rates().map_or(0.0, |rates| rates.nominal.duration_s);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "casts saturate")]
        let cycles = (bits * duration_s * self.bus_hz).round() as u64;
        cycles
    }

    /// Bit rates; `None` without a clock.
    pub(crate) fn rates(&self) -> Option<Rates> {
        self.kernel_hz.map(|hz| Rates::new(&self.registers, hz))
    }

    pub(crate) fn is_passive(&self) -> bool {
        self.errors.is_passive()
    }

    /// Whether the controller is bus-off, or has not recovered yet.
    pub(crate) fn is_off(&self) -> bool {
        self.errors.is_off()
    }

    /// Whether the controller takes part in a frame that starts at a cycle; `None` while INIT is set.
    pub(crate) fn takes_part(&self, begins: u64) -> Option<bool> {
        match self.presence {
            Presence::Initialisation => None,
            Presence::Integrating { .. } => Some(self.joined_at().is_some_and(|at| at <= begins)),
            Presence::In => Some(true),
        }
    }

    /// Whether the controller sends acknowledges and error flags: not in bus monitoring mode.
    pub(crate) fn speaks(&self) -> bool {
        !self.registers.has(CCCR, MON)
    }

    pub(crate) fn knows_fd(&self) -> bool {
        self.registers.has(CCCR, FDOE)
    }

    /// Whether the controller ignores a frame with an unknown format until its end, instead of aborting it.
    pub(crate) fn tolerates_unknown(&self) -> bool {
        !self.registers.has(CCCR, PXHD)
    }

    /// Whether transmitter delay compensation is enabled.
    pub(crate) fn compensates_delay(&self) -> bool {
        self.registers.has(DBTP, TDC)
    }

    fn is_queue(&self) -> bool {
        self.registers.has(TXBC, TFQM)
    }

    /// The pending TX buffer at an offset of message RAM.
    pub(super) fn pending_at(&self, offset: u32) -> Option<u32> {
        let place = offset.checked_sub(TX_BUFFERS)? / ELEMENT_BYTES;
        (self.buffers.pending() >> place.min(31) & 1 == 1).then_some(place)
    }

    fn joined_at(&self) -> Option<u64> {
        match self.presence {
            Presence::Integrating { sequences, since } => {
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

    /// `PSR`; a read clears the state of the last frame.
    fn status(&mut self, now: u64) -> u32 {
        let activity = match (self.presence, self.passages.front()) {
            (Presence::Initialisation | Presence::Integrating { .. }, _) => 0,
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

    /// Counts of the timestamp counter: one count per nominal bit times prescaler.
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
                        "{} acknowledges element {value}, which is empty",
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
                access.violates(format!("{} is written, but is read-only", self.registers.name(offset)));
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
