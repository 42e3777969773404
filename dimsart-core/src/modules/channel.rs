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

/// Channels that a link can carry: as many as CAN has short identifiers.
pub(super) const CHANNELS: core::ops::RangeInclusive<u32> = 0..=2047;

/// Place of the channel's first wave, the one with counters.
pub(super) fn first_wave(device: &DeviceDescriptor, types: &[TypeRef]) -> Option<usize> {
    let is_wave = |found: &DataType| found.unit == Unit::Wave;
    types.iter().position(|signal| device.data_type(signal.id).is_some_and(is_wave))
}

/// Words of a packet that are samples.
pub(super) fn samples(device: &DeviceDescriptor, types: &[TypeRef]) -> u8 {
    u8::try_from(types.len() * device.dof()).unwrap_or(u8::MAX)
}

/// What a packet of the channel carries.
pub(super) fn content(device: &DeviceDescriptor, types: &[TypeRef]) -> Content {
    let counters = first_wave(device, types).map_or(0, |_| 2 * device.dof());
    let counters = u8::try_from(counters).unwrap_or(u8::MAX);
    let words = samples(device, types).saturating_add(counters);
    let found = types.iter().filter_map(|signal| device.data_type(signal.id));
    let found: Vec<&DataType, MAX_CHANNEL_TYPES> = found.collect();
    Content::of_channel(words, &found, device.axes())
}
