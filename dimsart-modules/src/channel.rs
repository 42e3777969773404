//! The channel that a sending and a receiving comm module agree on.
//!
//! Words of a packet: the words of every type, of any format and shape, in the order of the `ADD_DATA` commands; behind
//! them, per axis, the two counters of the channel's first wave: all that was ever sent, so that what a lost
//! packet carried can be made up for.
//!
//! A channel carries all axes or one of them: of a vector its element, of a square the one on the diagonal, of all else
//! every word. So a coordinator of six axes talks to joint controllers of one axis each.

use core::cell::Cell;
use core::ops::RangeInclusive;

use heapless::Vec;

use dimsart_core::limits::{MAX_CHANNEL_TYPES, MAX_DOF};
use dimsart_core::{AxisKind, Content, DataType, DeviceDescriptor, Format, Shape, TypeRef, Unit};

/// Names of the ports of a channel's types.
pub(super) const CHANNEL_PORTS: [&str; MAX_CHANNEL_TYPES] = ["DATA_1", "DATA_2", "DATA_3", "DATA_4"];

/// Names of the memories in which the means of its waves are worked out.
pub(super) const BLOCK_PORTS: [&str; MAX_CHANNEL_TYPES] = ["BLOCK_1", "BLOCK_2", "BLOCK_3", "BLOCK_4"];

/// Channels that a link can carry: as many as CAN has short identifiers.
pub(super) const CHANNELS: RangeInclusive<u32> = 0..=2047;

/// Links, by their numbers; the same for all controllers, so that they know the same schemes. One that a controller has not
/// is refused when the module is plugged in.
pub(super) const LINKS: RangeInclusive<u32> = 0..=7;

/// Ticks from a packet to the next one.
pub(super) const EVERY_TICKS: RangeInclusive<u32> = 1..=100;

/// Axes that a channel can carry alone; the last one stands for all.
pub(super) const AXES: RangeInclusive<u32> = 0..=ALL_AXES;

/// Value of `CTX_AXIS` and `CRX_AXIS` for all axes.
#[expect(clippy::cast_possible_truncation, reason = "a few")]
pub(super) const ALL_AXES: u32 = MAX_DOF as u32;

/// In [`Parts`], of a signal that is carried as a whole.
const WHOLE: u8 = u8::MAX;

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

/// Which words of each of a channel's signals it carries: one for the axis it is of, or all.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Parts(u32);

impl Parts {
    /// Of a channel for one axis, or for [all](ALL_AXES).
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

    /// The part of the next signal's words.
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

/// Which types of a channel are not `f32`, a bit each, that of the first one lowest.
#[inline(never)]
pub(super) fn not_f32(device: &DeviceDescriptor, types: &[TypeRef]) -> u32 {
    types.iter().rev().fold(0, |set, signal| {
        let is_not_f32 = device.data_type(signal.id).is_some_and(|found| found.format != Format::F32);
        set << 1 | u32::from(is_not_f32)
    })
}

/// What decides, beside its types, what the words of a packet are.
pub(super) struct Layout {
    pub(super) every_ticks: u32,
    pub(super) has_counters: bool,
    /// The axis that is carried alone, or [`ALL_AXES`].
    pub(super) axis: u32,
}

/// What of a channel a tick needs.
pub(super) struct Prepared {
    pub(super) content: Content,
    /// Words of a packet that are samples.
    pub(super) samples: u32,
    pub(super) parts: Parts,
    /// Place of the wave whose counters are in the packet, behind all signals where there is none.
    pub(super) counted: u32,
    /// First of its words in the packet.
    pub(super) counted_at: u32,
    /// Time from a packet to the next one, `s`.
    pub(super) period_s: f32,
}

impl Layout {
    /// Works out what is the same in every tick.
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

    /// Whether the device has the axis that is carried.
    pub(super) fn has_axis(&self, device: &DeviceDescriptor) -> bool {
        !self.axes(device).is_empty()
    }

    /// Words of a packet that are samples.
    #[inline(never)]
    fn samples(&self, device: &DeviceDescriptor, types: &[TypeRef]) -> u32 {
        let (mut samples, dof) = (0_u32, self.axes(device).len());
        for signal in types {
            let words = device.data_type(signal.id).map_or(0, |found| found.shape.words(dof));
            samples = samples.saturating_add(u32::try_from(words).unwrap_or(u32::MAX));
        }
        samples
    }

    /// Words of a packet.
    #[inline(never)]
    pub(super) fn packet_words(&self, device: &DeviceDescriptor, types: &[TypeRef]) -> usize {
        let counters = self.wave(device, types).map_or(0, |_| 2 * device.dof());
        usize::try_from(self.samples(device, types)).unwrap_or(usize::MAX).saturating_add(counters)
    }

    /// What a packet of the channel carries.
    fn content(&self, device: &DeviceDescriptor, types: &[TypeRef]) -> Content {
        let words = u8::try_from(self.packet_words(device, types)).unwrap_or(u8::MAX);
        let found = types.iter().filter_map(|signal| device.data_type(signal.id));
        let found: Vec<&DataType, MAX_CHANNEL_TYPES> = found.collect();
        let every = u8::try_from(self.every_ticks).unwrap_or(u8::MAX);
        Content::of_channel(words, &found, self.axes(device), every, self.wave(device, types).is_some())
    }

    /// Place of the wave whose counters are in the packet, behind all signals where there is none; and the first of
    /// its words.
    fn counted(&self, device: &DeviceDescriptor, types: &[TypeRef]) -> (u32, u32) {
        let Some(place) = self.wave(device, types) else { return (u32::MAX, u32::MAX) };
        let before = types.get(..place).unwrap_or_default();
        (u32::try_from(place).unwrap_or(u32::MAX), self.samples(device, before))
    }

    /// Those of the device that are carried.
    fn axes<'a>(&self, device: &'a DeviceDescriptor) -> &'a [AxisKind] {
        let axes = device.axes();
        if self.axis >= ALL_AXES {
            return axes;
        }
        let axis = usize::try_from(self.axis).unwrap_or(usize::MAX);
        axes.get(axis..).unwrap_or_default().get(..1).unwrap_or_default()
    }

    /// A wave's counters are of all its axes.
    fn has_counters(&self) -> bool {
        self.has_counters && self.axis >= ALL_AXES
    }

    /// Place of the wave that has counters.
    #[inline(never)]
    fn wave(&self, device: &DeviceDescriptor, types: &[TypeRef]) -> Option<usize> {
        first_wave(device, types).filter(|_| self.has_counters())
    }
}
