//! The channel that a sending and a receiving comm module agree on.
//!
//! Words of a packet: the samples of every type, in the order of the `ADD_DATA` commands; behind them, per
//! axis, the two counters of the channel's first wave: all that was ever sent, so that what a lost
//! packet carried can be made up for.

use heapless::Vec;

use crate::limits::MAX_CHANNEL_TYPES;
use crate::{Content, DataType, DeviceDescriptor, TypeRef, Unit};

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

/// Whether a signal is a wave.
pub(super) fn is_wave(device: &DeviceDescriptor, signal: TypeRef) -> bool {
    device.data_type(signal.id).is_some_and(|found| found.unit == Unit::Wave)
}

/// Words of a packet that are samples.
pub(super) fn samples(device: &DeviceDescriptor, types: &[TypeRef]) -> u32 {
    u32::try_from(types.len() * device.dof()).unwrap_or(u32::MAX)
}

/// What decides, beside its types, what the words of a packet are.
pub(super) struct Layout {
    pub(super) every_ticks: u32,
    pub(super) has_counters: bool,
}

impl Layout {
    /// What a packet of the channel carries.
    pub(super) fn content(&self, device: &DeviceDescriptor, types: &[TypeRef]) -> Content {
        let counters =
            first_wave(device, types).filter(|_| self.has_counters).map_or(0, |_| 2 * device.dof());
        let words = u8::try_from(types.len() * device.dof() + counters).unwrap_or(u8::MAX);
        let found = types.iter().filter_map(|signal| device.data_type(signal.id));
        let found: Vec<&DataType, MAX_CHANNEL_TYPES> = found.collect();
        let every = u8::try_from(self.every_ticks).unwrap_or(u8::MAX);
        Content::of_channel(words, &found, device.axes(), every, self.has_counters)
    }

    /// Time from a packet to the next one, `s`.
    #[expect(clippy::cast_precision_loss, reason = "at most 100")]
    pub(super) fn period_s(&self, device: &DeviceDescriptor) -> f32 {
        device.sample_period_s() * self.every_ticks as f32
    }
}
