//! Identification of a packet's contents.

use core::cell::Cell;

use crate::packet::checksum::CRC;
use crate::signal::{AxisKind, DataType, Shape, Words};

/// Layout version of samples and counters in a packet.
const LAYOUT: u8 = 4;

/// Number of words of a packet and a 16-bit id of their meaning.
///
/// Both ends compute it; a receiver refuses packets with another content.
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
    /// Creates a content of `words` words with a known id.
    #[must_use]
    pub const fn new(words: u8, id: u16) -> Self {
        // Combined into one number, so that a tick needs one comparison.
        Self((id as u32) << 8 | words as u32)
    }

    /// Computes the content of a channel that carries `types` in this order, on a device with these axes,
    /// every `every_ticks` ticks, with or without counters of its first wave.
    ///
    /// The id is the low half of a CRC-32 over: layout version, `every_ticks`, 1 if there are counters, the
    /// kind of every axis (linear if no type's unit depends on it), and unit, format and shape of every type
    /// by number. It excludes the type numbers, because `CH1_WAVES` of one end is `CH2_WAVES` of the other.
    /// Types of the same unit, format and shape differ only by their order.
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
        // Waves have the same unit on every axis, so a rotary joint can be coupled to a linear tool.
        let tells_axes = |data_type: &&DataType| data_type.unit.depends_on_axis();
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

    /// Returns the number of words.
    #[must_use]
    pub const fn words(self) -> u8 {
        let [words, ..] = self.0.to_le_bytes();
        words
    }

    /// Returns the id of their meaning.
    #[must_use]
    pub const fn id(self) -> u16 {
        let [_, low, high, _] = self.0.to_le_bytes();
        u16::from_le_bytes([low, high])
    }
}
