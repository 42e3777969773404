//! Words that are checked after the call that writes them.

use core::cell::Cell;

use crate::data_base::storage::Block;

/// A span of `f32` words with a maximum magnitude.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CheckedWords {
    block: Block,
    /// Maximum magnitude: `f32` bits without the sign, shifted left.
    largest: u32,
}

impl CheckedWords {
    pub(crate) fn new(block: Block, largest: f32) -> Self {
        Self { block, largest: largest.to_bits() << 1 }
    }

    /// Returns whether a word is out of range. Without the sign, the bits of finite numbers increase with the
    /// magnitude; infinity and NaN are above.
    #[inline(always)]
    pub(crate) fn is_wrong(&self, word: u32) -> bool {
        word << 1 > self.largest
    }

    /// Returns whether any word of its span is out of range.
    #[inline(always)]
    pub(crate) fn has_wrong(&self, words: &[Cell<u32>]) -> bool {
        let Some(own) = words.get(self.block.range()) else { return false };
        own.iter().any(|word| self.is_wrong(word.get()))
    }

    /// Merges an adjacent span.
    pub(crate) fn take_in(&mut self, other: Self) -> bool {
        let is_behind = self.block.range().end == other.block.range().start;
        if is_behind && self.largest == other.largest {
            self.block.words += other.block.words;
        }
        is_behind && self.largest == other.largest
    }
}
