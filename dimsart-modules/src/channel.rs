//! Channel: the packet layout shared by a sending and a receiving communication module.
//!
//! A packet contains the words of each signal, of any format and shape, in the order of the `ADD_DATA` commands. They
//! are followed, per axis, by the two counters of the channel's first wave: totals of all that was ever sent, from
//! which the receiver recovers the content of lost packets.
//!
//! A channel carries either all axes or a single one: the element of a vector, the diagonal element of a square, every
//! word of any other signal. This lets a coordinator of six axes talk to single-axis joint controllers.

use core::cell::Cell;
use core::ops::RangeInclusive;

use heapless::Vec;

use dimsart_core::limits::{MAX_CHANNEL_TYPES, MAX_DOF};
use dimsart_core::{AxisKind, Content, DataType, DeviceDescriptor, Format, Shape, TypeRef, Unit};

/// Port names of a channel's signals.
pub(super) const CHANNEL_PORTS: [&str; MAX_CHANNEL_TYPES] = ["DATA_1", "DATA_2", "DATA_3", "DATA_4"];

/// Names of the memories that average its waves.
pub(super) const BLOCK_PORTS: [&str; MAX_CHANNEL_TYPES] = ["BLOCK_1", "BLOCK_2", "BLOCK_3", "BLOCK_4"];

/// Channels of a link: as many as CAN has 11-bit identifiers.
pub(super) const CHANNELS: RangeInclusive<u32> = 0..=2047;

/// Link numbers; the same range for all controllers, so that schemes are portable. A link that the controller lacks is
/// refused at plug-in.
pub(super) const LINKS: RangeInclusive<u32> = 0..=7;

/// Ticks per packet.
pub(super) const EVERY_TICKS: RangeInclusive<u32> = 1..=100;

/// Axis that a channel carries; the last value means all axes.
pub(super) const AXES: RangeInclusive<u32> = 0..=ALL_AXES;

/// Value of `CTX_AXIS` and `CRX_AXIS` for all axes.
#[expect(clippy::cast_possible_truncation, reason = "a few")]
pub(super) const ALL_AXES: u32 = MAX_DOF as u32;

/// Marks in [`Parts`] a signal that is carried as a whole.
const WHOLE: u8 = u8::MAX;

/// Returns the index of the channel's first wave, which has the counters.
pub(super) fn first_wave(device: &DeviceDescriptor, types: &[TypeRef]) -> Option<usize> {
    types.iter().position(|signal| is_wave(device, *signal))
}

/// Checks whether a signal is a wave: unit `sqrt(W)`, one `f32` per axis.
pub(super) fn is_wave(device: &DeviceDescriptor, signal: TypeRef) -> bool {
    let is_wave = |found: &DataType| (found.unit, found.format, found.shape) == WAVE;
    device.data_type(signal.id).is_some_and(is_wave)
}

const WAVE: (Unit, Format, Shape) = (Unit::Wave, Format::F32, Shape::Vector);

/// The words of each signal that a channel carries: one word for a single axis, or all.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Parts(u32);

impl Parts {
    /// Creates the parts of a channel for one axis or for [all](ALL_AXES).
    fn new(device: &DeviceDescriptor, types: &[TypeRef], axis: u32) -> Self {
        let mut parts = [WHOLE; MAX_CHANNEL_TYPES];
        if axis < ALL_AXES {
            let axis = axis.to_le_bytes()[0];
            for (part, signal) in parts.iter_mut().zip(types) {
                *part = match device.data_type(signal.id).map(|found| found.shape) {
                    Some(Shape::Vector) => axis,
                    Some(Shape::Square) => axis * (low_byte(device.dof()) + 1),
                    _ => WHOLE,
                };
            }
        }
        Self(u32::from_le_bytes(parts))
    }

    /// Returns the carried part of the next signal's words.
    #[inline(never)]
    pub(super) fn next<'a>(&mut self, words: &'a [Cell<u32>]) -> &'a [Cell<u32>] {
        let [part, ..] = self.0.to_le_bytes();
        self.0 = self.0 >> 8 | u32::from(WHOLE) << 24;
        match part {
            WHOLE => words,
            part => words.get(usize::from(part)..).unwrap_or_default().get(..1).unwrap_or_default(),
        }
    }
}

impl dimsart_core::words::Words for Parts {
    const COUNT: usize = 1;

    #[inline(always)]
    fn load(words: &[Cell<u32>]) -> Self {
        Self(u32::load(words))
    }

    #[inline(always)]
    fn store(self, words: &[Cell<u32>]) {
        self.0.store(words);
    }
}

fn low_byte(number: usize) -> u8 {
    number.to_le_bytes()[0]
}

/// Returns a bit mask of the signals that are not `f32`; bit 0 is the first signal.
#[inline(never)]
pub(super) fn not_f32(device: &DeviceDescriptor, types: &[TypeRef]) -> u32 {
    types.iter().rev().fold(0, |set, signal| {
        let is_not_f32 = device.data_type(signal.id).is_some_and(|found| found.format != Format::F32);
        set << 1 | u32::from(is_not_f32)
    })
}

/// Settings that, with the signals, determine the layout of a packet.
pub(super) struct Layout {
    pub(super) every_ticks: u32,
    pub(super) has_counters: bool,
    /// The single axis carried, or [`ALL_AXES`].
    pub(super) axis: u32,
}

/// Precomputed values of a channel for the tick.
pub(super) struct Prepared {
    pub(super) content: Content,
    /// Number of sample words in a packet.
    pub(super) samples: u32,
    pub(super) parts: Parts,
    /// Index of the wave whose counters are in the packet; `u32::MAX` without one.
    pub(super) counted: u32,
    /// Index of its first word in the packet.
    pub(super) counted_at: u32,
    /// Packet period, `s`.
    pub(super) period_s: f32,
}

impl Layout {
    /// Computes the values that do not change from tick to tick.
    #[inline(never)]
    pub(super) fn prepare(&self, device: &DeviceDescriptor, types: &[TypeRef]) -> Prepared {
        let (counted, counted_at) = self.counted(device, types);
        #[expect(clippy::cast_precision_loss, reason = "at most 100")]
        let period_s = device.sample_period_s() * self.every_ticks as f32;
        Prepared {
            content: self.content(device, types),
            samples: self.samples(device, types),
            parts: Parts::new(device, types, self.axis),
            counted,
            counted_at,
            period_s,
        }
    }

    /// Checks that the device has the carried axis.
    pub(super) fn has_axis(&self, device: &DeviceDescriptor) -> bool {
        !self.axes(device).is_empty()
    }

    /// Returns the number of sample words in a packet.
    #[inline(never)]
    fn samples(&self, device: &DeviceDescriptor, types: &[TypeRef]) -> u32 {
        let (mut samples, dof) = (0_u32, self.axes(device).len());
        for signal in types {
            let words = device.data_type(signal.id).map_or(0, |found| found.shape.words(dof));
            samples = samples.saturating_add(u32::try_from(words).unwrap_or(u32::MAX));
        }
        samples
    }

    /// Returns the number of words in a packet.
    #[inline(never)]
    pub(super) fn packet_words(&self, device: &DeviceDescriptor, types: &[TypeRef]) -> usize {
        let counters = self.wave(device, types).map_or(0, |_| 2 * device.dof());
        usize::try_from(self.samples(device, types)).unwrap_or(usize::MAX).saturating_add(counters)
    }

    /// Returns the description of a packet's content.
    fn content(&self, device: &DeviceDescriptor, types: &[TypeRef]) -> Content {
        let words = u8::try_from(self.packet_words(device, types)).unwrap_or(u8::MAX);
        let found = types.iter().filter_map(|signal| device.data_type(signal.id));
        let found: Vec<&DataType, MAX_CHANNEL_TYPES> = found.collect();
        let every = u8::try_from(self.every_ticks).unwrap_or(u8::MAX);
        Content::of_channel(words, &found, self.axes(device), every, self.wave(device, types).is_some())
    }

    /// Returns the index of the wave whose counters are in the packet and of its first word; both `u32::MAX` without one.
    fn counted(&self, device: &DeviceDescriptor, types: &[TypeRef]) -> (u32, u32) {
        let Some(place) = self.wave(device, types) else { return (u32::MAX, u32::MAX) };
        let before = types.get(..place).unwrap_or_default();
        (u32::try_from(place).unwrap_or(u32::MAX), self.samples(device, before))
    }

    /// Returns the axes of the device that are carried.
    fn axes<'a>(&self, device: &'a DeviceDescriptor) -> &'a [AxisKind] {
        let axes = device.axes();
        if self.axis >= ALL_AXES {
            return axes;
        }
        let axis = usize::try_from(self.axis).unwrap_or(usize::MAX);
        axes.get(axis..).unwrap_or_default().get(..1).unwrap_or_default()
    }

    /// Returns whether packets carry counters; never for a single axis.
    fn has_counters(&self) -> bool {
        self.has_counters && self.axis >= ALL_AXES
    }

    /// Returns the index of the wave that has counters.
    #[inline(never)]
    fn wave(&self, device: &DeviceDescriptor, types: &[TypeRef]) -> Option<usize> {
        first_wave(device, types).filter(|_| self.has_counters())
    }
}
