//! SPI master with frames of 4 to 16 bits (RM0440, chapter 39), and the device at its wires. DMA, CRC and I²S
//! are not modelled.

mod wires;

use std::collections::VecDeque;

use cycles::instruction::Width;

use super::ChipModel;
use super::registers::Registers;
use super::violation::Access;

pub(super) use self::wires::{Chip, Pins};
pub use self::wires::{SpiDevice, SpiEvent};

const CR1: u32 = 0x00;
const CR2: u32 = 0x04;
const SR: u32 = 0x08;
const DR: u32 = 0x0C;

// Bits of CR1.
const MSTR: u32 = 2;
const SPE: u32 = 6;
const SSI: u32 = 8;
const SSM: u32 = 9;
/// Bits that may change only while the SPI is off: mode, master, clock rate, bit order, data lines.
const FIXED: u32 = 0xAEBF;
// Bits of CR2; interrupts.
const DMA: u32 = 0b11;
const ERRIE: u32 = 5;
const RXNEIE: u32 = 6;
const TXEIE: u32 = 7;
const DS: u32 = 8;
const FRXTH: u32 = 12;
// Bits of SR.
const RXNE: u32 = 0;
const TXE: u32 = 1;
const OVR: u32 = 6;
const BSY: u32 = 7;
const FRLVL: u32 = 9;
const FTLVL: u32 = 11;

/// Size of each FIFO.
const FIFO_BYTES: u32 = 4;

/// A frame in transfer.
#[derive(Debug, Clone, Copy)]
struct Frame {
    sent: u32,
    ends_at: u64,
}

#[derive(Debug, Clone)]
pub(super) struct Spi {
    name: String,
    registers: Registers,
    shifting: Option<Frame>,
    waiting: VecDeque<u32>,
    received: VecDeque<u32>,
    /// Whether the data register was read since the last overrun.
    has_read: bool,
    pins: Pins,
    chip: Option<Chip>,
    /// Frequency of the bus clock.
    hz: f64,
}

impl Spi {
    pub(super) fn new(part: ChipModel, name: &str) -> Self {
        Self {
            name: name.to_owned(),
            registers: Registers::new(part, "SPI", name),
            shifting: None,
            waiting: VecDeque::new(),
            received: VecDeque::new(),
            has_read: false,
            pins: Pins::default(),
            chip: None,
            hz: 1.0,
        }
    }

    pub(super) fn reset(&mut self) {
        self.registers.reset();
        (self.shifting, self.pins) = (None, Pins::default());
        self.waiting.clear();
        self.received.clear();
    }

    pub(super) fn registers(&self) -> &Registers {
        &self.registers
    }

    pub(super) fn wire(&mut self, chip: Option<Chip>) {
        self.chip = chip;
    }

    pub(super) fn device(&mut self) -> Option<&mut SpiDevice> {
        self.chip.as_mut().map(|chip| &mut chip.device)
    }

    pub(super) fn selected_at(&self) -> Option<u64> {
        self.chip.as_ref().and_then(Chip::selected_at)
    }

    /// The select pin of the device.
    pub(super) fn select_pin(&self) -> Option<(char, u32)> {
        self.chip.as_ref().map(|chip| chip.select)
    }

    /// Updates the state of the pins.
    pub(super) fn see_pins(&mut self, pins: Pins, hz: f64, access: &mut Access<'_>) {
        self.advance(access.at.cycle);
        (self.pins, self.hz) = (pins, hz);
        let is_busy = self.shifting.is_some();
        if let Some(chip) = &mut self.chip {
            chip.see(pins.is_selected, is_busy, hz, access);
        }
    }

    fn bits(&self) -> u32 {
        // Reserved values mean 8 bits.
        match self.registers.bits(CR2, DS, 4) {
            0..=2 => 8,
            less => less + 1,
        }
    }

    fn bytes(&self) -> u32 {
        if self.bits() > 8 { 2 } else { 1 }
    }

    fn divider(&self) -> u64 {
        2 << self.registers.bits(CR1, 3, 3)
    }

    /// Checks that an access to the data register has the width of a frame: two frames in one access are not
    /// modelled.
    fn check_width(&self, width: Width, access: &mut Access<'_>) {
        let is_right = match width {
            Width::Byte => self.bytes() == 1,
            Width::Half => self.bytes() == 2,
            Width::Word => false,
        };
        if !is_right {
            access.violates(format!("{}_DR is accessed with a width other than the frame width", self.name));
        }
    }

    pub(super) fn read(&mut self, offset: u32, width: Width, access: &mut Access<'_>) -> u32 {
        self.advance(access.at.cycle);
        match offset {
            DR => {
                self.check_width(width, access);
                self.has_read = true;
                match self.received.pop_front() {
                    Some(frame) => self.registers.set(DR, frame),
                    None => access.violates(format!("{}_DR is read while its RX FIFO is empty", self.name)),
                }
                self.registers.get(DR)
            }
            SR => {
                let flags = self.flags();
                // Cleared by reading data, then status.
                if self.has_read {
                    self.registers.set_bit(SR, OVR, false);
                }
                flags
            }
            _ => self.registers.read(offset, access),
        }
    }

    pub(super) fn write(&mut self, offset: u32, value: u32, width: Width, access: &mut Access<'_>) {
        self.advance(access.at.cycle);
        let (before, is_on) = (self.registers.get(offset), self.registers.has(CR1, SPE));
        match offset {
            DR => return self.put(value, width, access),
            CR1 if is_on && (before ^ value) & FIXED != 0 => {
                access.violates(format!("{}_CR1 is changed while the SPI is on", self.name));
            }
            CR1 if is_on && value >> SPE & 1 == 0 && self.shifting.is_some() => {
                access.violates(format!("{} is switched off during a frame", self.name));
            }
            CR2 if is_on && (before ^ value) >> DS & 0xF != 0 => {
                access.violates(format!("the frame size of {} is changed while the SPI is on", self.name));
            }
            CR2 if value & DMA != 0 => {
                access.violates(format!("{}_CR2 enables DMA: not modelled", self.name))
            }
            _ => {}
        }
        self.registers.write(offset, value, access);
        let has = |bit| self.registers.has(CR1, bit);
        if offset == CR1 && has(SPE) && !(has(MSTR) && has(SSM) && has(SSI)) {
            access.violates(format!("{} is on without MSTR, SSM and SSI: not modelled", self.name));
        }
    }

    fn put(&mut self, value: u32, width: Width, access: &mut Access<'_>) {
        self.check_width(width, access);
        if !self.registers.has(CR1, SPE) {
            return access.violates(format!("{}_DR is written while the SPI is off", self.name));
        }
        if self.held(&self.waiting) + self.bytes() > FIFO_BYTES {
            return access.violates(format!("{}_DR is written while its TX FIFO is full", self.name));
        }
        self.waiting.push_back(value & ((1 << self.bits()) - 1));
        if self.shifting.is_none() {
            #[expect(clippy::cast_precision_loss, reason = "at most 256")]
            let clock_hz = self.hz / self.divider() as f64;
            let mode = self.registers.bits(CR1, 0, 2);
            if let Some(chip) = self.chip.as_ref().filter(|_| self.pins.is_clocked) {
                chip.check(mode, clock_hz, self.hz, access);
            }
            self.begin(access.at.cycle);
        }
    }

    /// Starts the next waiting frame, if any.
    fn begin(&mut self, now: u64) {
        let ends_at = now + u64::from(self.bits()) * self.divider();
        self.shifting = self.waiting.pop_front().map(|sent| Frame { sent, ends_at });
    }

    pub(super) fn advance(&mut self, now: u64) {
        while let Some(Frame { sent, ends_at }) = self.shifting.filter(|frame| frame.ends_at <= now) {
            let received = self.exchange(sent);
            if self.held(&self.received) + self.bytes() > FIFO_BYTES {
                self.registers.set_bit(SR, OVR, true);
                self.has_read = false;
            } else {
                self.received.push_back(received);
            }
            self.begin(ends_at);
        }
    }

    /// Returns the frame that is received while a frame is sent.
    fn exchange(&mut self, sent: u32) -> u32 {
        let (bits, pins) = (self.bits(), self.pins);
        let sent = if pins.has_output { sent } else { 0 };
        let idle = if pins.pull == Some(true) { u32::MAX } else { 0 };
        let chip = self.chip.as_mut().filter(|chip| pins.is_clocked && chip.is_selected());
        let answer = chip.map_or(idle, |chip| chip.device.answer(SpiEvent::Frame { bits, sent }));
        if pins.has_input { answer & ((1 << bits) - 1) } else { 0 }
    }

    fn held(&self, fifo: &VecDeque<u32>) -> u32 {
        u32::try_from(fifo.len()).unwrap_or(0) * self.bytes()
    }

    fn flags(&self) -> u32 {
        let (received, waiting) = (self.held(&self.received), self.held(&self.waiting));
        let level = |bytes: u32| [0, 1, 2, 2, 3].get(bytes as usize).copied().unwrap_or(3);
        let threshold = if self.registers.has(CR2, FRXTH) { 1 } else { 2 };
        self.registers.get(SR) & (1 << OVR)
            | u32::from(received >= threshold) << RXNE
            | u32::from(waiting <= FIFO_BYTES / 2) << TXE
            | u32::from(self.shifting.is_some()) << BSY
            | level(received) << FRLVL
            | level(waiting) << FTLVL
    }

    pub(super) fn next_event(&self) -> u64 {
        self.shifting.map_or(u64::MAX, |frame| frame.ends_at)
    }

    pub(super) fn interrupts(&self) -> bool {
        let flags = self.flags();
        let wants = |bit, flag: u32| self.registers.has(CR2, bit) && flags >> flag & 1 == 1;
        wants(RXNEIE, RXNE) || wants(TXEIE, TXE) || wants(ERRIE, OVR)
    }
}
