//! A DMA controller with its request multiplexer (RM0440, chapters 12 and 13): one item per request.

use super::ChipModel;
use super::registers::Registers;
use super::violation::Access;

const ISR: u32 = 0x00;
const IFCR: u32 = 0x04;
const CHANNEL: u32 = 0x08;
const CHANNEL_BYTES: u32 = 0x14;
const CHANNELS: u32 = 8;

// Bits of a channel's CCR.
const EN: u32 = 0;
const DIR: u32 = 4;
const CIRC: u32 = 5;
const MINC: u32 = 7;
// Of a channel's four bits of ISR; the first bit is set if any other bit is set.
const TC: u32 = 1;
const HT: u32 = 2;

/// A channel's transfer for a request.
#[derive(Debug, Clone, Copy)]
pub(super) struct Transfer {
    pub(super) channel: u32,
    /// Memory address.
    pub(super) address: u32,
    /// Whether the transfer is from memory to the peripheral.
    pub(super) is_read: bool,
}

#[derive(Debug, Clone)]
pub(super) struct Dma {
    registers: Registers,
    /// Number of items with which each channel was started.
    counts: [u32; CHANNELS as usize],
}

impl Dma {
    pub(super) fn new(part: ChipModel, name: &str) -> Self {
        Self { registers: Registers::new(part, "DMA", name), counts: [0; CHANNELS as usize] }
    }

    pub(super) fn reset(&mut self) {
        self.registers.reset();
    }

    pub(super) fn registers(&self) -> &Registers {
        &self.registers
    }

    pub(super) fn read(&mut self, offset: u32, access: &mut Access<'_>) -> u32 {
        self.registers.read(offset, access)
    }

    pub(super) fn write(&mut self, offset: u32, value: u32, access: &mut Access<'_>) {
        if offset == IFCR {
            let cleared = (0..CHANNELS).fold(0, |cleared, channel| {
                let flags = value >> (4 * channel) & 0xF;
                // Clearing the first flag clears all flags of the channel.
                cleared | (if flags & 1 == 1 { 0xF } else { flags }) << (4 * channel)
            });
            let flags = self.registers.get(ISR) & !cleared;
            self.registers.set(ISR, with_any(flags));
            return;
        }
        let Some(place) = offset.checked_sub(CHANNEL) else { return };
        let (channel, register) = (place / CHANNEL_BYTES, place % CHANNEL_BYTES);
        let control = CHANNEL + channel * CHANNEL_BYTES;
        let was_on = self.registers.has(control, EN);
        if was_on && register != 0 {
            access.violates(format!("{} is written while its channel is on", self.registers.name(offset)));
        }
        self.registers.write(offset, value, access);
        // A channel that is switched off and on again continues, unless its count is written.
        if register == 4
            && let Some(count) = self.counts.get_mut(channel as usize)
        {
            *count = self.registers.get(control + 4);
        }
    }

    /// A channel's transfer for a request now; `None` if the channel is off or complete.
    pub(super) fn transfer(&self, channel: u32) -> Option<Transfer> {
        let control = CHANNEL + channel * CHANNEL_BYTES;
        let left = self.registers.get(control + 4);
        if !self.registers.has(control, EN) || left == 0 {
            return None;
        }
        let done = self.counts.get(channel as usize)? - left;
        let bytes = 1 << self.registers.bits(control, 10, 2);
        let offset = if self.registers.has(control, MINC) { done * bytes } else { 0 };
        let address = self.registers.get(control + 12) + offset;
        Some(Transfer { channel, address, is_read: self.registers.has(control, DIR) })
    }

    /// Counts an item that a channel has moved.
    pub(super) fn moved(&mut self, channel: u32) {
        let control = CHANNEL + channel * CHANNEL_BYTES;
        let count = self.counts.get(channel as usize).copied().unwrap_or(0);
        let left = self.registers.get(control + 4).saturating_sub(1);
        let mut flags = self.registers.get(ISR);
        if left == count / 2 {
            flags |= 1 << (4 * channel + HT);
        }
        if left == 0 {
            flags |= 1 << (4 * channel + TC);
        }
        self.registers.set(ISR, with_any(flags));
        let goes_round = left == 0 && self.registers.has(control, CIRC);
        self.registers.set(control + 4, if goes_round { count } else { left });
    }

    /// Channels that request an interrupt, as bits.
    pub(super) fn interrupts(&self) -> u32 {
        let flags = self.registers.get(ISR);
        let wants = |channel: &u32| {
            let enabled = self.registers.get(CHANNEL + channel * CHANNEL_BYTES) & 0xE;
            flags >> (4 * channel) & enabled != 0
        };
        (0..if flags == 0 { 0 } else { CHANNELS }).filter(wants).map(|channel| 1 << channel).sum()
    }
}

/// Sets the first flag of each channel if any of its other flags is set.
fn with_any(flags: u32) -> u32 {
    (0..CHANNELS).fold(flags & 0xEEEE_EEEE, |flags, channel| {
        let any = flags >> (4 * channel) & 0xE != 0;
        flags | u32::from(any) << (4 * channel)
    })
}
