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

/// Where a block lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Block {
    pub(crate) offset: u16,
    pub(crate) words: u16,
}

impl Block {
    /// That of a free slot: beyond the last word of any storage, so that there is nothing to reach.
    pub(crate) const FREE: Self = Self { offset: u16::MAX, words: 0 };

    #[inline]
    fn range(self) -> core::ops::Range<usize> {
        let start = usize::from(self.offset);
        start..start + usize::from(self.words)
    }
}

/// `WORDS` words shared by at most [`MAX_SLOTS`] blocks. Fresh, it is all zero bits.
#[derive(Debug, Clone)]
pub(crate) struct Storage<const WORDS: usize> {
    pub(crate) words: [u32; WORDS],
    blocks: [Option<Block>; MAX_SLOTS],
    used: usize,
}

impl<const WORDS: usize> Storage<WORDS> {
    pub(crate) const fn new() -> Self {
        const { assert!(WORDS < u16::MAX as usize, "a Data Base holds at most 65534 words") };
        Self { words: [0; WORDS], blocks: [None; MAX_SLOTS], used: 0 }
    }

    /// Takes every block back.
    pub(crate) fn clear(&mut self) {
        self.blocks.fill(None);
        self.used = 0;
    }

    /// Words not taken.
    pub(crate) fn free_words(&self) -> usize {
        WORDS.saturating_sub(self.used)
    }

    /// Slots taken.
    pub(crate) fn taken_slots(&self) -> usize {
        self.blocks.iter().flatten().count()
    }

    /// Takes `words` words, all zero. Nothing changes on an error.
    pub(crate) fn take(&mut self, words: usize) -> Result<u8, StorageError> {
        let free = self.free_words();
        let no_room = StorageError::NoRoom { wanted: words, free };
        let index = self.blocks.iter().position(Option::is_none).ok_or(StorageError::NoSlot)?;
        let (Ok(offset), Ok(length), Ok(index)) =
            (u16::try_from(self.used), u16::try_from(words), u8::try_from(index))
        else {
            return Err(no_room);
        };
        if words > free {
            return Err(no_room);
        }
        let block = self.blocks.get_mut(usize::from(index)).ok_or(StorageError::NoSlot)?;
        *block = Some(Block { offset, words: length });
        if let Some(fresh) = self.words.get_mut(self.used..self.used + words) {
            fresh.fill(0);
        }
        self.used += words;
        Ok(index)
    }

    /// Gives a block back and closes the gap it leaves. A free index is ignored.
    pub(crate) fn give_back(&mut self, index: u8) {
        let Some(gone) = self.blocks.get_mut(usize::from(index)).and_then(Option::take) else { return };
        let (start, length) = (usize::from(gone.offset), usize::from(gone.words));
        if let Some(tail) = self.words.get_mut(start..self.used) {
            tail.copy_within(length.min(tail.len()).., 0);
        }
        self.used -= length;
        for block in self.blocks.iter_mut().flatten().filter(|block| block.offset > gone.offset) {
            block.offset -= gone.words;
        }
    }

    /// Where a block lies; [`Block::FREE`] for a free index.
    pub(crate) fn block(&self, index: u8) -> Block {
        self.blocks.get(usize::from(index)).copied().flatten().unwrap_or(Block::FREE)
    }

    /// The words of a block; none for a free one.
    #[inline]
    pub(crate) fn words(&self, block: Block) -> Option<&[u32]> {
        self.words.get(block.range())
    }

    /// The words of a block, to be written.
    #[inline]
    pub(crate) fn words_mut(&mut self, block: Block) -> Option<&mut [u32]> {
        self.words.get_mut(block.range())
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
        storage.words_mut(storage.block(b)).unwrap().copy_from_slice(&[7, 8, 9]);
        assert_eq!(storage.take(3), Err(StorageError::NoRoom { wanted: 3, free: 2 }));
        storage.give_back(a);
        assert_eq!(storage.words(storage.block(b)).unwrap(), [7, 8, 9]);
        let c = storage.take(5).unwrap();
        assert_eq!(storage.words(storage.block(c)).unwrap(), [0; 5]);
        assert_eq!(storage.free_words(), 0);
    }

    #[test]
    fn an_empty_block_survives_its_neighbours() {
        let mut storage = Storage::<4>::new();
        let empty = storage.take(0).unwrap();
        let full = storage.take(4).unwrap();
        storage.give_back(empty);
        storage.words_mut(storage.block(full)).unwrap().fill(5);
        let empty = storage.take(0).unwrap();
        storage.give_back(full);
        assert_eq!(storage.words(storage.block(empty)).unwrap(), []);
        assert_eq!(storage.free_words(), 4);
    }
}
