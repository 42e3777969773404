//! I²C master with 7-bit addresses (RM0440, chapter 41), and the device at its wires. Reload, interrupts and
//! slave mode are not modelled.

mod wires;

use super::ChipModel;
use super::registers::Registers;
use super::violation::Access;

pub(super) use self::wires::{Bus, Pins};
pub use self::wires::{I2cDevice, I2cEvent};

const CR1: u32 = 0x00;
const CR2: u32 = 0x04;
const TIMINGR: u32 = 0x10;
const ISR: u32 = 0x18;
const ICR: u32 = 0x1C;
const RXDR: u32 = 0x24;
const TXDR: u32 = 0x28;

// Bits of CR1.
const PE: u32 = 0;
const DNF: u32 = 8;
const ANFOFF: u32 = 12;
const RXDMAEN: u32 = 15;
/// Interrupts, transmit DMA, slave mode, wake-up.
const NOT_MODELLED: u32 = 0x00FF_40FE;
/// Bits that may change only while the peripheral is off.
const FILTERS: u32 = 1 << ANFOFF | 0xF << DNF;
// Bits of CR2.
const RD_WRN: u32 = 10;
const ADD10: u32 = 11;
const START: u32 = 13;
const STOP: u32 = 14;
const NBYTES: u32 = 16;
const RELOAD: u32 = 24;
const AUTOEND: u32 = 25;
// Bits of ISR.
const TXE: u32 = 0;
const TXIS: u32 = 1;
const RXNE: u32 = 2;
const NACKF: u32 = 4;
const STOPF: u32 = 5;
const TC: u32 = 6;
const BUSY: u32 = 15;
/// Flags that a program clears by ICR.
const CLEARABLE: u32 = 0x3F38;

/// Minimum and maximum delay of the analog filter, `s` (data sheet, "I2C analog filter").
const FILTER_S: [f64; 2] = [50e-9, 260e-9];
/// Delay until a clock edge is detected, in cycles of the peripheral's own clock.
const SYNCHRONIZED_CYCLES: f64 = 2.0;
/// Duration in bits of a byte with its acknowledge (`BYTE_BITS`), and of a START or STOP (`EDGE_BITS`).
const BYTE_BITS: f64 = 9.0;
const EDGE_BITS: f64 = 0.5;

/// State of a transfer.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    Idle,
    /// A START and the address; never ends while a line is held low.
    Address,
    Sending(u8),
    Receiving(u8),
    /// A byte was received while the previous byte is unread: the clock is held low.
    Full(u8),
    /// The clock is held low until the program continues the transfer.
    Held,
    Stopping,
}

#[derive(Debug, Clone)]
pub(super) struct I2c {
    name: String,
    registers: Registers,
    phase: Phase,
    ends_at: u64,
    /// Bytes of the transfer that have not started.
    left: u32,
    to_send: Option<u8>,
    received: Option<u8>,
    pins: Pins,
    bus: Bus,
    /// Frequency of the bus clock, which clocks the peripheral.
    hz: f64,
}

impl I2c {
    pub(super) fn new(part: ChipModel, name: &str) -> Self {
        Self {
            name: name.to_owned(),
            registers: Registers::new(part, "I2C", name),
            phase: Phase::Idle,
            ends_at: u64::MAX,
            left: 0,
            to_send: None,
            received: None,
            pins: Pins::default(),
            bus: Bus::default(),
            hz: 1.0,
        }
    }

    pub(super) fn reset(&mut self) {
        self.let_go();
        self.registers.reset();
        self.pins = Pins::default();
    }

    /// Aborts the transfer. A device that is sending a byte continues to send.
    fn let_go(&mut self) {
        self.bus.is_held |= matches!(self.phase, Phase::Receiving(_) | Phase::Full(_));
        (self.phase, self.ends_at, self.left) = (Phase::Idle, u64::MAX, 0);
        (self.to_send, self.received) = (None, None);
    }

    pub(super) fn registers(&self) -> &Registers {
        &self.registers
    }

    pub(super) fn bus(&mut self) -> &mut Bus {
        &mut self.bus
    }

    /// Updates the state of the pins.
    pub(super) fn see_pins(&mut self, pins: Pins, hz: f64, access: &mut Access<'_>) {
        self.advance(access.at.cycle);
        if pins.is_connected && !pins.is_open_drain {
            access.violates(format!("a pin of {} is not open-drain", self.name));
        }
        self.bus.see_clock(pins.clock);
        (self.pins, self.hz) = (pins, hz);
    }

    /// Duration of a bit, `s`: low and high time of the clock, and twice the delay until a clock edge is
    /// detected.
    fn bit_s(&self, filter_s: f64) -> f64 {
        let [low_s, high_s] = self.clock_s();
        let filter_s = if self.registers.has(CR1, ANFOFF) { 0.0 } else { filter_s };
        let digital = f64::from(self.registers.bits(CR1, DNF, 4));
        low_s + high_s + 2.0 * (filter_s + (digital + SYNCHRONIZED_CYCLES) / self.hz)
    }

    fn clock_s(&self) -> [f64; 2] {
        [0, 8].map(|place| self.timing_s(place, 8))
    }

    /// Time set by a field of the timing register, `s`.
    fn timing_s(&self, place: u32, width: u32) -> f64 {
        let prescaler = self.registers.bits(TIMINGR, 28, 4) + 1;
        let [prescaler, count] = [prescaler, self.registers.bits(TIMINGR, place, width) + 1].map(f64::from);
        prescaler * count / self.hz
    }

    /// Maximum cycles of this number of bits: with the slowest filter.
    fn cycles(&self, bits: f64) -> u64 {
        let [_, slowest_s] = FILTER_S;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some thousand")]
        let cycles = (bits * self.bit_s(slowest_s) * self.hz).ceil() as u64;
        cycles
    }

    fn go(&mut self, phase: Phase, from: u64, bits: f64) {
        (self.phase, self.ends_at) = (phase, from + self.cycles(bits));
    }

    fn hold(&mut self, phase: Phase) {
        (self.phase, self.ends_at) = (phase, u64::MAX);
    }

    fn is_reading(&self) -> bool {
        self.registers.has(CR2, RD_WRN)
    }

    pub(super) fn read(&mut self, offset: u32, access: &mut Access<'_>) -> u32 {
        self.advance(access.at.cycle);
        match offset {
            RXDR if self.received.is_none() => {
                access.violates(format!("{}_RXDR is read while it is empty", self.name));
                self.registers.get(RXDR)
            }
            RXDR => self.take_received(access.at.cycle),
            ISR => self.flags(),
            _ => self.registers.read(offset, access),
        }
    }

    pub(super) fn write(&mut self, offset: u32, value: u32, access: &mut Access<'_>) {
        self.advance(access.at.cycle);
        let (before, is_on) = (self.registers.get(offset), self.registers.has(CR1, PE));
        let changed = before ^ value;
        match offset {
            CR1 if value & NOT_MODELLED != 0 => {
                access.violates(format!("{}_CR1 is set to {value:#010x}: not modelled", self.name));
            }
            CR1 if is_on && changed & FILTERS != 0 => {
                access.violates(format!("the filters of {} are changed while it is on", self.name));
            }
            TIMINGR if is_on => {
                access.violates(format!("{}_TIMINGR is written while the I²C is on", self.name))
            }
            CR2 if before >> START & 1 == 1 && changed != 0 => {
                access.violates(format!("{}_CR2 is changed while a START is pending", self.name));
            }
            ICR => {
                self.registers.set(ISR, self.registers.get(ISR) & !(value & CLEARABLE));
                return;
            }
            TXDR if self.to_send.is_some() => {
                access.violates(format!("{}_TXDR is written while it is full", self.name));
            }
            _ => {}
        }
        self.registers.write(offset, value, access);
        match offset {
            CR1 if !self.registers.has(CR1, PE) => {
                self.let_go();
                self.registers.set(ISR, 0);
                self.registers.set(CR2, self.registers.get(CR2) & !(1 << START | 1 << STOP));
            }
            TXDR => {
                self.to_send = Some(value.to_le_bytes()[0]);
                if self.phase == Phase::Held && !self.registers.has(ISR, TC) {
                    self.go_on(access.at.cycle);
                }
            }
            CR2 => self.command(access),
            _ => {}
        }
    }

    fn command(&mut self, access: &mut Access<'_>) {
        if self.registers.has(CR2, RELOAD) || self.registers.has(CR2, ADD10) {
            access.violates(format!("{} uses RELOAD or a 10-bit address: not modelled", self.name));
        }
        let is_complete = self.registers.has(ISR, TC);
        let [starts, stops] = [START, STOP].map(|bit| self.registers.has(CR2, bit));
        if (starts || stops) && !self.registers.has(CR1, PE) {
            return access.violates(format!("{} is started or stopped while it is off", self.name));
        }
        if starts {
            if self.phase != Phase::Idle && !is_complete {
                return access.violates(format!("{} is started during a transfer", self.name));
            }
            self.registers.set_bit(ISR, TC, false);
            self.left = self.registers.bits(CR2, NBYTES, 8);
            self.hold(Phase::Address);
            if self.pins.is_connected && self.bus.is_free(self.pins) {
                let [fastest_s, _] = FILTER_S;
                self.bus.check(self.bit_s(fastest_s), self.clock_s(), self.timing_s(20, 4), access);
                self.registers.set_bit(ISR, BUSY, true);
                self.bus.read_at = if self.is_reading() { Some(access.at.cycle) } else { self.bus.read_at };
                self.go(Phase::Address, access.at.cycle, EDGE_BITS + BYTE_BITS);
            }
        } else if stops && is_complete {
            self.registers.set_bit(ISR, TC, false);
            self.go(Phase::Stopping, access.at.cycle, EDGE_BITS);
        }
    }

    pub(super) fn advance(&mut self, now: u64) {
        while self.ends_at <= now {
            let at = self.ends_at;
            match self.phase {
                Phase::Address => {
                    self.registers.set_bit(CR2, START, false);
                    let address = self.registers.bits(CR2, 1, 7);
                    let is_read = self.is_reading();
                    if self.bus.answer(address, I2cEvent::Started { is_read }) == 0 {
                        self.refuse(at);
                    } else {
                        self.go_on(at);
                    }
                }
                Phase::Sending(byte) => {
                    let address = self.registers.bits(CR2, 1, 7);
                    if self.bus.answer(address, I2cEvent::Written { byte }) == 0 {
                        self.refuse(at);
                    } else {
                        self.go_on(at);
                    }
                }
                Phase::Receiving(byte) if self.received.is_some() => self.hold(Phase::Full(byte)),
                Phase::Receiving(byte) => {
                    self.received = Some(byte);
                    self.go_on(at);
                }
                Phase::Stopping => {
                    self.registers.set_bit(ISR, STOPF, true);
                    self.registers.set_bit(ISR, BUSY, false);
                    self.registers.set_bit(CR2, STOP, false);
                    self.hold(Phase::Idle);
                }
                Phase::Idle | Phase::Held | Phase::Full(_) => self.ends_at = u64::MAX,
            }
        }
    }

    /// Handles a missing acknowledge: a STOP follows automatically.
    fn refuse(&mut self, at: u64) {
        self.registers.set_bit(ISR, NACKF, true);
        self.go(Phase::Stopping, at, EDGE_BITS);
    }

    /// Starts the next byte, or ends the transfer.
    fn go_on(&mut self, at: u64) {
        if self.left == 0 {
            if self.registers.has(CR2, AUTOEND) {
                return self.go(Phase::Stopping, at, EDGE_BITS);
            }
            self.registers.set_bit(ISR, TC, true);
            return self.hold(Phase::Held);
        }
        let address = self.registers.bits(CR2, 1, 7);
        if self.is_reading() {
            let [byte, ..] = self.bus.answer(address, I2cEvent::Read).to_le_bytes();
            self.go(Phase::Receiving(byte), at, BYTE_BITS);
        } else {
            let Some(byte) = self.to_send.take() else { return self.hold(Phase::Held) };
            self.go(Phase::Sending(byte), at, BYTE_BITS);
        }
        self.left -= 1;
    }

    pub(super) fn wants_dma(&self, is_receiving: bool) -> bool {
        is_receiving && self.registers.has(CR1, RXDMAEN) && self.received.is_some()
    }

    /// Takes the received byte, for the program or the DMA.
    pub(super) fn take_received(&mut self, now: u64) -> u32 {
        if let Some(byte) = self.received.take() {
            self.registers.set(RXDR, byte.into());
        }
        if let Phase::Full(byte) = self.phase {
            self.received = Some(byte);
            self.go_on(now);
        }
        self.registers.get(RXDR)
    }

    fn flags(&self) -> u32 {
        let is_sending = matches!(self.phase, Phase::Sending(_) | Phase::Held) && !self.is_reading();
        let wants = is_sending && self.left > 0 && self.to_send.is_none();
        self.registers.get(ISR) & !(1 << TXE)
            | u32::from(self.to_send.is_none()) << TXE
            | u32::from(wants) << TXIS
            | u32::from(self.received.is_some()) << RXNE
    }

    pub(super) fn next_event(&self) -> u64 {
        self.ends_at
    }
}
