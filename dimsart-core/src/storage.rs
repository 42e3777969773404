//! Statically sized storage of variable-length blocks that never fragments.
//!
//! Blocks lie one behind the other; taking one out closes the gap, so whatever is free is one piece
//! at the end. A block is named by its index, which stays the same while its words move.

use crate::limits::MAX_SLOTS;

/// Why storage was not given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StorageError {
    /// Every one of the [`MAX_SLOTS`] slots is taken.
    NoSlot,
    /// The words do not fit.
    NoRoom {
        /// Words asked for.
        wanted: usize,
        /// Words free.
        free: usize,
    },
}

/// Where a block lies. A free slot has no length and `is_taken` is false.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Block {
    pub(crate) offset: u16,
    pub(crate) words: u16,
    is_taken: bool,
}

/// `WORDS` words shared by at most [`MAX_SLOTS`] blocks.
#[derive(Debug, Clone)]
pub(crate) struct Storage<const WORDS: usize> {
    pub(crate) words: [u32; WORDS],
    pub(crate) blocks: [Block; MAX_SLOTS],
    used: usize,
}

impl<const WORDS: usize> Storage<WORDS> {
    pub(crate) const fn new() -> Self {
        const { assert!(WORDS <= u16::MAX as usize, "a Data Base holds at most 65535 words") };
        let free = Block { offset: 0, words: 0, is_taken: false };
        Self { words: [0; WORDS], blocks: [free; MAX_SLOTS], used: 0 }
    }

    /// Words not taken.
    pub(crate) fn free_words(&self) -> usize {
        WORDS.saturating_sub(self.used)
    }

    /// Slots taken.
    pub(crate) fn taken_slots(&self) -> usize {
        self.blocks.iter().filter(|block| block.is_taken).count()
    }

    /// Takes `words` words, all zero. Nothing changes on an error.
    pub(crate) fn take(&mut self, words: usize) -> Result<u8, StorageError> {
        let free = self.free_words();
        let no_room = StorageError::NoRoom { wanted: words, free };
        let index = self.blocks.iter().position(|block| !block.is_taken).ok_or(StorageError::NoSlot)?;
        let (Ok(offset), Ok(length), Ok(index)) =
            (u16::try_from(self.used), u16::try_from(words), u8::try_from(index))
        else {
            return Err(no_room);
        };
        if words > free {
            return Err(no_room);
        }
        let block = self.blocks.get_mut(usize::from(index)).ok_or(StorageError::NoSlot)?;
        *block = Block { offset, words: length, is_taken: true };
        if let Some(fresh) = self.words.get_mut(self.used..self.used + words) {
            fresh.fill(0);
        }
        self.used += words;
        Ok(index)
    }

    /// Gives a block back and closes the gap it leaves. A free index is ignored.
    pub(crate) fn give_back(&mut self, index: u8) {
        let Some(block) = self.blocks.get_mut(usize::from(index)).filter(|block| block.is_taken) else {
            return;
        };
        let gone = core::mem::take(block);
        let (start, length) = (usize::from(gone.offset), usize::from(gone.words));
        if let Some(tail) = self.words.get_mut(start..self.used) {
            tail.rotate_left(length.min(tail.len()));
        }
        self.used -= length;
        for block in self.blocks.iter_mut().filter(|block| block.is_taken && block.offset > gone.offset) {
            block.offset -= gone.words;
        }
    }

    /// The words of a block; empty for a free index.
    pub(crate) fn words(&self, index: u8) -> &[u32] {
        let range = self.range(index);
        self.words.get(range).unwrap_or_default()
    }

    /// The words of a block, to be written.
    pub(crate) fn words_mut(&mut self, index: u8) -> &mut [u32] {
        let range = self.range(index);
        self.words.get_mut(range).unwrap_or_default()
    }

    fn range(&self, index: u8) -> core::ops::Range<usize> {
        let block = self.blocks.get(usize::from(index)).copied().unwrap_or_default();
        usize::from(block.offset)..usize::from(block.offset) + usize::from(block.words)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_is_closed_and_contents_move_with_their_block() {
        let mut storage = Storage::<8>::new();
        let a = storage.take(3).unwrap();
        let b = storage.take(3).unwrap();
        storage.words_mut(b).copy_from_slice(&[7, 8, 9]);
        assert_eq!(storage.take(3), Err(StorageError::NoRoom { wanted: 3, free: 2 }));
        storage.give_back(a);
        assert_eq!(storage.words(b), [7, 8, 9]);
        let c = storage.take(5).unwrap();
        assert_eq!(storage.words(c), [0; 5]);
        assert_eq!(storage.free_words(), 0);
    }

    #[test]
    fn an_empty_block_survives_its_neighbours() {
        let mut storage = Storage::<4>::new();
        let empty = storage.take(0).unwrap();
        let full = storage.take(4).unwrap();
        storage.give_back(empty);
        storage.words_mut(full).fill(5);
        let empty = storage.take(0).unwrap();
        storage.give_back(full);
        assert_eq!(storage.words(empty), []);
        assert_eq!(storage.free_words(), 4);
    }
}
