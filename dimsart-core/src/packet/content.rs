//! What a packet carries, as one number that both ends work out for themselves.

use core::cell::Cell;

use crate::packet::checksum::CRC;
use crate::signal::{AxisKind, DataType, Shape, Words};

/// Version of how samples and counters lie in a packet.
const LAYOUT: u8 = 4;

/// Number of words of a packet, and an id that stands for what they mean.
///
/// Two ends agree on a channel when their contents are equal; the receiver refuses any other packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Content(u32);

impl Words for Content {
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

impl Content {
    /// A content of `words` words with a known id.
    #[must_use]
    pub const fn new(words: u8, id: u16) -> Self {
        // One number, so that a tick compares once.
        Self((id as u32) << 8 | words as u32)
    }

    /// The content of a channel of `types`, in this order, on a device with these axes, that sends in every
    /// `every_ticks`-th tick, with the counters of its first wave or without.
    ///
    /// The id is the low half of a CRC-32 over the version of this layout, `every_ticks`, 1 for counters, the kind of
    /// every axis (linear, where the units of no type depend on it), and of every type its unit, format and shape, by
    /// number. It does not hold the types themselves: what
    /// leaves as `CH1_WAVES` arrives as `CH2_WAVES`. Types of one unit, format and shape are told apart by their order
    /// alone.
    #[must_use]
    pub fn of_channel(
        words: u8,
        types: &[&DataType],
        axes: &[AxisKind],
        every_ticks: u8,
        has_counters: bool,
    ) -> Self {
        let mut digest = CRC.digest();
        digest.update(&[LAYOUT, every_ticks, u8::from(has_counters)]);
        // Waves are the same on every axis: a joint that turns can be coupled to a tool that slides.
        let tells_axes = |data_type: &&DataType| data_type.unit.is_of_axis();
        let kinds_matter = types.iter().any(tells_axes);
        for axis in axes {
            digest.update(&[if kinds_matter { *axis } else { AxisKind::Linear } as u8]);
        }
        for data_type in types {
            let [shape, rows, columns] = match data_type.shape {
                Shape::Scalar => [0; 3],
                Shape::Vector => [1, 0, 0],
                Shape::Matrix(rows, columns) => [2, rows, columns],
                Shape::Square => [3, 0, 0],
            };
            digest.update(&[data_type.unit as u8, data_type.format as u8, shape, rows, columns]);
        }
        let [low, high, ..] = digest.finalize().to_le_bytes();
        Self::new(words, u16::from_le_bytes([low, high]))
    }

    /// Number of words.
    #[must_use]
    pub const fn words(self) -> u8 {
        let [words, ..] = self.0.to_le_bytes();
        words
    }

    /// What stands for their meaning.
    #[must_use]
    pub const fn id(self) -> u16 {
        let [_, low, high, _] = self.0.to_le_bytes();
        u16::from_le_bytes([low, high])
    }
}
