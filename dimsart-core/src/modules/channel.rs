//! The channel that a sending and a receiving comm module agree on.
//!
//! Words of a packet: the words of every type, of any format and shape, in the order of the `ADD_DATA` commands; behind
//! them, per axis, the two counters of the channel's first wave: all that was ever sent, so that what a lost
//! packet carried can be made up for.

use heapless::Vec;

use crate::limits::MAX_CHANNEL_TYPES;
use crate::{Content, DataType, DeviceDescriptor, Format, Shape, TypeRef, Unit};

/// Names of the ports of a channel's types.
pub(super) const CHANNEL_PORTS: [&str; MAX_CHANNEL_TYPES] = ["DATA_1", "DATA_2", "DATA_3", "DATA_4"];

/// Names of the memories in which the means of its waves are worked out.
pub(super) const BLOCK_PORTS: [&str; MAX_CHANNEL_TYPES] = ["BLOCK_1", "BLOCK_2", "BLOCK_3", "BLOCK_4"];

/// Channels that a link can carry: as many as CAN has short identifiers.
pub(super) const CHANNELS: core::ops::RangeInclusive<u32> = 0..=2047;

/// Ticks from a packet to the next one.
pub(super) const EVERY_TICKS: core::ops::RangeInclusive<u32> = 1..=100;

/// Place of the channel's first wave, the one with counters.
pub(super) fn first_wave(device: &DeviceDescriptor, types: &[TypeRef]) -> Option<usize> {
    types.iter().position(|signal| is_wave(device, *signal))
}

/// Whether a signal is a wave: an `f32` on each axis.
pub(super) fn is_wave(device: &DeviceDescriptor, signal: TypeRef) -> bool {
    let is_wave = |found: &DataType| (found.unit, found.format, found.shape) == WAVE;
    device.data_type(signal.id).is_some_and(is_wave)
}

const WAVE: (Unit, Format, Shape) = (Unit::Wave, Format::F32, Shape::Vector);

/// Words of a packet that are samples.
#[inline(never)]
pub(super) fn samples(device: &DeviceDescriptor, types: &[TypeRef]) -> u32 {
    let mut samples = 0_u32;
    for signal in types {
        let words = device.data_type(signal.id).map_or(0, |found| found.shape.words(device.dof()));
        samples = samples.saturating_add(u32::try_from(words).unwrap_or(u32::MAX));
    }
    samples
}

/// Which types of a channel are not `f32`, a bit each, that of the first one lowest.
#[inline(never)]
pub(super) fn not_f32(device: &DeviceDescriptor, types: &[TypeRef]) -> u32 {
    types.iter().rev().fold(0, |set, signal| {
        let is_not_f32 = device.data_type(signal.id).is_some_and(|found| found.format != Format::F32);
        set << 1 | u32::from(is_not_f32)
    })
}

/// Words of a packet.
pub(super) fn packet_words(device: &DeviceDescriptor, types: &[TypeRef], has_counters: bool) -> usize {
    let wave = first_wave(device, types).filter(|_| has_counters);
    let counters = wave.map_or(0, |_| 2 * device.dof());
    usize::try_from(samples(device, types)).unwrap_or(usize::MAX).saturating_add(counters)
}

/// What decides, beside its types, what the words of a packet are.
pub(super) struct Layout {
    pub(super) every_ticks: u32,
    pub(super) has_counters: bool,
}

impl Layout {
    /// What a packet of the channel carries.
    #[inline(never)]
    pub(super) fn content(&self, device: &DeviceDescriptor, types: &[TypeRef]) -> Content {
        let words = u8::try_from(packet_words(device, types, self.has_counters)).unwrap_or(u8::MAX);
        let found = types.iter().filter_map(|signal| device.data_type(signal.id));
        let found: Vec<&DataType, MAX_CHANNEL_TYPES> = found.collect();
        let every = u8::try_from(self.every_ticks).unwrap_or(u8::MAX);
        Content::of_channel(words, &found, device.axes(), every, self.has_counters)
    }

    /// Place of the wave whose counters are in the packet, behind all signals where there is none; and the first of
    /// its words.
    pub(super) fn counted(&self, device: &DeviceDescriptor, types: &[TypeRef]) -> (u32, u32) {
        let wave = first_wave(device, types).filter(|_| self.has_counters);
        let Some(place) = wave else { return (u32::MAX, u32::MAX) };
        let before = types.get(..place).unwrap_or_default();
        (u32::try_from(place).unwrap_or(u32::MAX), samples(device, before))
    }

    /// Time from a packet to the next one, `s`.
    #[expect(clippy::cast_precision_loss, reason = "at most 100")]
    pub(super) fn period_s(&self, device: &DeviceDescriptor) -> f32 {
        device.sample_period_s() * self.every_ticks as f32
    }
}
