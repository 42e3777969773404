//! USART and LPUART, asynchronous with 8 data bits (RM0440, chapters 37 and 38), and the serial line.

use std::collections::VecDeque;

use super::ChipModel;
use super::registers::Registers;
use super::violation::Access;

const CR1: u32 = 0x00;
const CR3: u32 = 0x08;
const BRR: u32 = 0x0C;
const RQR: u32 = 0x18;
const ISR: u32 = 0x1C;
const ICR: u32 = 0x20;
const RDR: u32 = 0x24;
const TDR: u32 = 0x28;
const PRESC: u32 = 0x2C;

// Bits of CR1.
const UE: u32 = 0;
const RE: u32 = 2;
const TE: u32 = 3;
const FIFOEN: u32 = 29;
// Bits of CR3.
const EIE: u32 = 0;
const DMAR: u32 = 6;
const DMAT: u32 = 7;
// Bits of ISR; the interrupt enable bits of CR1 have the same positions from IDLE to TXE.
const ORE: u32 = 3;
const IDLE: u32 = 4;
const RXNE: u32 = 5;
const TC: u32 = 6;
const TXE: u32 = 7;
const TEACK: u32 = 21;
const REACK: u32 = 22;
/// Flags that a program clears by ICR: errors, `IDLE` and `TC`.
const CLEARABLE: u32 = 0x5F;

/// Start, 8 data bits, stop.
const BITS_PER_BYTE: u64 = 10;
/// Size of an enabled FIFO.
const FIFO_BYTES: usize = 8;
/// Dividers of PRESC.
const PRESCALERS: [u64; 12] = [1, 2, 4, 6, 8, 10, 12, 16, 32, 64, 128, 256];

#[derive(Debug, Clone)]
pub(super) struct Usart {
    registers: Registers,
    is_low_power: bool,
    /// Bytes in transit to the chip.
    coming: VecDeque<u8>,
    /// Cycle in which the next of these bytes is complete.
    received_at: u64,
    /// Cycle in which the line has been idle for the duration of a byte.
    silent_at: u64,
    /// The byte that is being sent, and the cycle of its end.
    sending: Option<(u8, u64)>,
    /// Bytes that wait to be sent.
    waiting: VecDeque<u8>,
    /// Received bytes that have not been read.
    received: VecDeque<u8>,
    /// Sent bytes, each with the cycle of its end.
    sent: Vec<(u64, u8)>,
    /// Number of bytes lost by overruns.
    pub(super) overruns: u64,
}

impl Usart {
    pub(super) fn new(part: ChipModel, name: &str) -> Self {
        let is_low_power = name.starts_with("LP");
        let mut usart = Self {
            registers: Registers::new(part, if is_low_power { "LPUART" } else { "USART" }, name),
            is_low_power,
            coming: VecDeque::new(),
            received_at: u64::MAX,
            silent_at: u64::MAX,
            sending: None,
            waiting: VecDeque::new(),
            received: VecDeque::new(),
            sent: Vec::new(),
            overruns: 0,
        };
        usart.reset();
        usart
    }

    pub(super) fn reset(&mut self) {
        self.registers.reset();
        self.registers.set(ISR, 1 << TC | 1 << TXE);
        (self.sending, self.silent_at) = (None, u64::MAX);
        self.waiting.clear();
        self.received.clear();
    }

    pub(super) fn registers(&self) -> &Registers {
        &self.registers
    }

    /// Cycles per byte on the line; `None` before a bit rate is set.
    fn byte_cycles(&self) -> Option<u64> {
        let divider = u64::from(self.registers.get(BRR));
        let prescaler = PRESCALERS.get(self.registers.get(PRESC) as usize).copied().unwrap_or(1);
        let fraction = if self.is_low_power { 256 } else { 1 };
        (divider > 0).then_some(divider * prescaler * BITS_PER_BYTE / fraction)
    }

    /// Bus cycles per bit.
    pub(super) fn bit_cycles(&self) -> Option<f64> {
        #[expect(clippy::cast_precision_loss, reason = "some thousand")]
        self.byte_cycles().map(|cycles| cycles as f64 / BITS_PER_BYTE as f64)
    }

    /// Appends bytes to the bytes in transit to the chip.
    pub(super) fn receive(&mut self, bytes: &[u8], now: u64) {
        if self.coming.is_empty() {
            self.received_at = now + self.byte_cycles().unwrap_or(0);
        }
        self.coming.extend(bytes);
    }

    pub(super) fn take_sent(&mut self) -> Vec<(u64, u8)> {
        std::mem::take(&mut self.sent)
    }

    /// Whether bytes to the chip are still in transit.
    pub(super) fn is_receiving(&self) -> bool {
        !self.coming.is_empty()
    }

    fn is_on(&self, direction: u32) -> bool {
        self.registers.has(CR1, UE) && self.registers.has(CR1, direction)
    }

    pub(super) fn read(&mut self, offset: u32, access: &mut Access<'_>) -> u32 {
        self.advance(access.at.cycle);
        if offset == RDR {
            return self.take_received();
        }
        self.registers.read(offset, access)
    }

    pub(super) fn write(&mut self, offset: u32, value: u32, access: &mut Access<'_>) {
        self.advance(access.at.cycle);
        match offset {
            ICR => {
                self.registers.write(offset, value, access);
                self.registers.set(ICR, 0);
                self.registers.set(ISR, self.registers.get(ISR) & !(value & CLEARABLE));
            }
            RQR => {
                if value >> 3 & 1 == 1 {
                    self.received.clear();
                    self.registers.set_bit(ISR, RXNE, false);
                }
            }
            TDR => self.send(value, access.at.cycle),
            CR1 => {
                self.registers.write(offset, value, access);
                self.registers.set_bit(ISR, TEACK, self.is_on(TE));
                self.registers.set_bit(ISR, REACK, self.is_on(RE));
            }
            BRR => {
                if self.registers.has(CR1, UE) {
                    access.violates(format!("{} is written while the UART is on", self.registers.name(BRR)));
                }
                self.registers.write(offset, value, access);
            }
            _ => self.registers.write(offset, value, access),
        }
    }

    fn send(&mut self, value: u32, now: u64) {
        let byte = value.to_le_bytes()[0];
        if !self.is_on(TE) {
            return;
        }
        self.registers.set_bit(ISR, TC, false);
        if self.sending.is_none() {
            self.sending = Some((byte, now + self.byte_cycles().unwrap_or(0)));
        } else {
            self.waiting.push_back(byte);
            self.registers.set_bit(ISR, TXE, self.waiting.len() < self.depth());
        }
    }

    /// Number of bytes that are buffered in each direction.
    fn depth(&self) -> usize {
        if self.registers.has(CR1, FIFOEN) { FIFO_BYTES } else { 1 }
    }

    pub(super) fn advance(&mut self, now: u64) {
        while let Some((byte, at)) = self.sending.filter(|(_, at)| *at <= now) {
            self.sent.push((at, byte));
            self.sending = self.waiting.pop_front().map(|byte| (byte, at + self.byte_cycles().unwrap_or(0)));
            self.registers.set_bit(ISR, TXE, true);
            if self.sending.is_none() {
                self.registers.set_bit(ISR, TC, true);
            }
        }
        // One byte at a time: the program or the DMA takes it before the next byte.
        if self.received_at <= now
            && let Some(byte) = self.coming.pop_front()
        {
            let byte_cycles = self.byte_cycles().unwrap_or(0);
            let at = self.received_at;
            self.silent_at = at + byte_cycles;
            self.received_at = if self.coming.is_empty() { u64::MAX } else { at + byte_cycles };
            if !self.is_on(RE) {
            } else if self.received.len() >= self.depth() {
                self.registers.set_bit(ISR, ORE, true);
                self.overruns += 1;
            } else {
                self.received.push_back(byte);
                self.registers.set_bit(ISR, RXNE, true);
            }
        }
        if self.silent_at <= now {
            self.silent_at = u64::MAX;
            if self.coming.is_empty() && self.is_on(RE) {
                self.registers.set_bit(ISR, IDLE, true);
            }
        }
    }

    pub(super) fn next_event(&self) -> u64 {
        let sent = self.sending.map_or(u64::MAX, |(_, at)| at);
        let received = if self.coming.is_empty() { u64::MAX } else { self.received_at };
        sent.min(received).min(self.silent_at)
    }

    /// Whether the UART requests a DMA transfer.
    pub(super) fn wants_dma(&self, is_receiving: bool) -> bool {
        if is_receiving {
            self.registers.has(CR3, DMAR) && self.registers.has(ISR, RXNE)
        } else {
            self.registers.has(CR3, DMAT) && self.registers.has(ISR, TXE) && self.is_on(TE)
        }
    }

    /// Takes the received byte, for the program or the DMA.
    pub(super) fn take_received(&mut self) -> u32 {
        if let Some(byte) = self.received.pop_front() {
            self.registers.set(RDR, byte.into());
        }
        self.registers.set_bit(ISR, RXNE, !self.received.is_empty());
        self.registers.get(RDR)
    }

    /// Sends a byte from the DMA.
    pub(super) fn put_to_send(&mut self, byte: u32, now: u64) {
        self.send(byte, now);
    }

    pub(super) fn interrupts(&self) -> bool {
        let flags = self.registers.get(ISR);
        let by_cr1 = flags & self.registers.get(CR1) & (1 << IDLE | 1 << RXNE | 1 << TC | 1 << TXE);
        let by_error = flags & 0xF != 0 && self.registers.has(CR3, EIE);
        let by_overrun = flags >> ORE & 1 == 1 && self.registers.has(CR1, RXNE);
        by_cr1 != 0 || by_error || by_overrun
    }
}
