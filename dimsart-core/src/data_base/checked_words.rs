//! Words that are checked after the call that writes them.

use core::cell::Cell;

use crate::data_base::storage::Block;

/// Words of format `f32` that cannot be larger than this.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CheckedWords {
    block: Block,
    /// Largest magnitude, the bits of an `f32` without its sign, shifted to the left.
    largest: u32,
}

impl CheckedWords {
    pub(crate) fn new(block: Block, largest: f32) -> Self {
        Self { block, largest: largest.to_bits() << 1 }
    }

    /// Whether a word is what it cannot be. Bits of finite numbers, without their sign, count up with the magnitude, and
    /// those of what is not finite are above.
    #[inline(always)]
    pub(crate) fn is_wrong(&self, word: u32) -> bool {
        word << 1 > self.largest
    }

    /// Whether one of all words, as far as they are its own, is what it cannot be.
    #[inline(always)]
    pub(crate) fn has_wrong(&self, words: &[Cell<u32>]) -> bool {
        let Some(own) = words.get(self.block.range()) else { return false };
        own.iter().any(|word| self.is_wrong(word.get()))
    }

    /// Takes in the words of another one, if they lie right behind its own.
    pub(crate) fn take_in(&mut self, other: Self) -> bool {
        let is_behind = self.block.range().end == other.block.range().start;
        if is_behind && self.largest == other.largest {
            self.block.words += other.block.words;
        }
        is_behind && self.largest == other.largest
    }
}
