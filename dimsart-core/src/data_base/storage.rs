//! Fixed-size storage of variable-length blocks without fragmentation.
//!
//! Blocks of signals and memories are contiguous from the start, blocks of module instances from the end.
//! Freeing a block closes the gap, so the free words are contiguous between them. A block at the start is
//! identified by an index, which stays valid while its words move; a move of a block at the end is reported
//! to its instance.

use heapless::vec::VecView;

/// A list in provided memory.
pub(crate) type List<T> = &'static mut VecView<T>;

/// Reason why an allocation failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StorageError {
    /// No free slot.
    OutOfSlots,
    /// Not enough free words.
    OutOfMemory {
        /// Requested words.
        wanted: usize,
        /// Free words.
        free: usize,
    },
}

/// Location of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Block {
    pub(crate) offset: u16,
    pub(crate) words: u16,
}

impl Block {
    /// Location of a free slot: after the last word of any storage.
    pub(crate) const FREE: Self = Self { offset: u16::MAX, words: 0 };

    /// Marks a handle with its port number, between declaration and wiring.
    pub(crate) const fn of_port(port: u8) -> Self {
        Self { offset: port as u16, words: u16::MAX }
    }

    /// Returns the port number of a handle during declaration.
    pub(crate) fn port(self) -> Option<u8> {
        u8::try_from(self.offset).ok().filter(|_| self.words == u16::MAX)
    }

    #[inline(always)]
    pub(crate) const fn from_word(word: u32) -> Self {
        let [offset, offset_high, words, words_high] = word.to_le_bytes();
        Self {
            offset: u16::from_le_bytes([offset, offset_high]),
            words: u16::from_le_bytes([words, words_high]),
        }
    }

    #[inline(always)]
    pub(crate) const fn to_word(self) -> u32 {
        (self.words as u32) << 16 | self.offset as u32
    }

    /// Splits the block after `words` words.
    pub(crate) fn split_at(self, words: usize) -> (Self, Self) {
        let first = u16::try_from(words).map_or(self.words, |words| words.min(self.words));
        let behind = Self { offset: self.offset + first, words: self.words - first };
        (Self { words: first, ..self }, behind)
    }

    #[inline]
    pub(crate) fn range(self) -> core::ops::Range<usize> {
        let start = usize::from(self.offset);
        start..start + usize::from(self.words)
    }
}

/// Provided words, shared by up to one block per slot.
#[derive(Debug)]
pub(crate) struct Storage {
    blocks: &'static mut [Block],
    /// Words used at the start.
    used: usize,
    /// Words used at the end.
    used_at_end: usize,
    pub(crate) words: &'static mut [u32],
}

impl Storage {
    pub(crate) fn new(blocks: &'static mut [Block], words: &'static mut [u32]) -> Self {
        blocks.fill(Block::FREE);
        Self { blocks, used: 0, used_at_end: 0, words }
    }

    /// Frees all blocks.
    pub(crate) fn clear(&mut self) {
        self.blocks.fill(Block::FREE);
        self.used = 0;
        self.used_at_end = 0;
    }

    /// Returns the number of free words.
    pub(crate) fn free_words(&self) -> usize {
        self.words.len().saturating_sub(self.used + self.used_at_end)
    }

    /// Returns the number of used slots.
    pub(crate) fn used_slots(&self) -> usize {
        self.blocks.iter().filter(|block| **block != Block::FREE).count()
    }

    /// Allocates `words` words, all zero. Nothing changes on an error.
    pub(crate) fn take(&mut self, words: usize) -> Result<u8, StorageError> {
        let free = self.free_words();
        let no_room = StorageError::OutOfMemory { wanted: words, free };
        let index =
            self.blocks.iter().position(|block| *block == Block::FREE).ok_or(StorageError::OutOfSlots)?;
        let place = u16::try_from(self.used).ok().zip(u16::try_from(words).ok());
        let (offset, length) = place.filter(|_| words <= free).ok_or(no_room)?;
        if let Some(block) = self.blocks.get_mut(index) {
            *block = Block { offset, words: length };
        }
        if let Some(fresh) = self.words.get_mut(self.used..self.used + words) {
            fresh.fill(0);
        }
        self.used += words;
        u8::try_from(index).map_err(|_| StorageError::OutOfSlots)
    }

    /// Frees a block and closes its gap. A free index is ignored.
    pub(crate) fn give_back(&mut self, index: u8) {
        let Some(block) = self.blocks.get_mut(usize::from(index)) else { return };
        let gone = core::mem::replace(block, Block::FREE);
        if gone == Block::FREE {
            return;
        }
        let (start, length) = (usize::from(gone.offset), usize::from(gone.words));
        if let Some(tail) = self.words.get_mut(start..self.used) {
            tail.copy_within(length.min(tail.len()).., 0);
        }
        self.used -= length;
        for block in self.blocks.iter_mut().filter(|block| **block != Block::FREE) {
            if block.offset > gone.offset {
                block.offset -= gone.words;
            }
        }
    }

    /// Allocates `words` words at the end, all zero, in front of the previous ones. Nothing changes on an
    /// error.
    pub(crate) fn take_at_end(&mut self, words: usize) -> Result<Block, StorageError> {
        let free = self.free_words();
        let no_room = StorageError::OutOfMemory { wanted: words, free };
        if words > free {
            return Err(no_room);
        }
        let offset = self.words.len().saturating_sub(self.used_at_end + words);
        let numbers = u16::try_from(offset).ok().zip(u16::try_from(words).ok());
        let (offset, words) = numbers.ok_or(no_room)?;
        let block = Block { offset, words };
        if let Some(fresh) = self.words_mut(block) {
            fresh.fill(0);
        }
        self.used_at_end += usize::from(words);
        Ok(block)
    }

    /// Allocates a copy of a block at the end. Nothing changes on an error.
    pub(crate) fn take_copy_at_end(&mut self, other: Block) -> Result<Block, StorageError> {
        let own = self.take_at_end(other.words.into())?;
        if self.words.len() >= other.range().end {
            self.words.copy_within(other.range(), own.range().start);
        }
        Ok(own)
    }

    /// Frees a block at the end: the blocks in front of it move towards the end by its length.
    pub(crate) fn give_back_at_end(&mut self, gone: Block) {
        let start = self.words.len().saturating_sub(self.used_at_end);
        if let Some(moved) = self.words.get_mut(start..gone.range().end) {
            let rest = moved.len().saturating_sub(gone.words.into());
            moved.copy_within(..rest, moved.len() - rest);
        }
        self.used_at_end = self.used_at_end.saturating_sub(gone.words.into());
    }

    /// Zeroes all blocks at the start.
    pub(crate) fn zero_blocks(&mut self) {
        self.words.get_mut(..self.used).unwrap_or_default().fill(0);
    }

    /// Returns whether a block is in use.
    pub(crate) fn is_taken(&self, index: u8) -> bool {
        self.block(index) != Block::FREE
    }

    /// Returns the location of a block; [`Block::FREE`] for a free index.
    pub(crate) fn block(&self, index: u8) -> Block {
        self.blocks.get(usize::from(index)).copied().unwrap_or(Block::FREE)
    }

    /// Returns the words of a block; none for a free block.
    #[inline]
    pub(crate) fn words(&self, block: Block) -> Option<&[u32]> {
        self.words.get(block.range())
    }

    /// Returns the words of a block, mutably.
    #[inline]
    pub(crate) fn words_mut(&mut self, block: Block) -> Option<&mut [u32]> {
        self.words.get_mut(block.range())
    }
}

#[cfg(test)]
mod tests {
    use std::boxed::Box;

    use super::*;

    fn storage<const WORDS: usize>() -> Storage {
        Storage::new(Box::leak(Box::new([Block::FREE; 4])), Box::leak(Box::new([0; WORDS])))
    }

    #[test]
    fn a_gap_is_closed_and_contents_move_with_their_block() {
        let mut storage = storage::<8>();
        let a = storage.take(3).unwrap();
        let b = storage.take(3).unwrap();
        storage.words_mut(storage.block(b)).unwrap().copy_from_slice(&[7, 8, 9]);
        assert_eq!(storage.take(3), Err(StorageError::OutOfMemory { wanted: 3, free: 2 }));
        storage.give_back(a);
        assert_eq!(storage.words(storage.block(b)).unwrap(), [7, 8, 9]);
        let c = storage.take(5).unwrap();
        assert_eq!(storage.words(storage.block(c)).unwrap(), [0; 5]);
        assert_eq!(storage.free_words(), 0);
    }

    #[test]
    fn what_is_taken_at_the_end_moves_there_when_a_gap_is_closed() {
        let mut storage = storage::<8>();
        storage.take(1).unwrap();
        let [a, b, c] = [3, 1, 2].map(|words| storage.take_at_end(words).unwrap());
        assert_eq!([a, b, c].map(|block| block.offset), [5, 4, 2]);
        for (block, value) in [(a, 1), (b, 2), (c, 3)] {
            storage.words_mut(block).unwrap().fill(value);
        }
        assert_eq!(storage.take_at_end(2), Err(StorageError::OutOfMemory { wanted: 2, free: 1 }));
        storage.give_back_at_end(b);
        assert_eq!(storage.words, [0, 0, 3, 3, 3, 1, 1, 1], "free words are unchanged");
        assert_eq!(storage.take_at_end(2).unwrap(), Block { offset: 1, words: 2 });
        assert_eq!(storage.words[1..3], [0, 0]);
    }

    #[test]
    fn a_handle_is_the_word_it_is_kept_in() {
        for block in [Block::FREE, Block { offset: 0x1234, words: 0xFEDC }, Block::of_port(255)] {
            assert_eq!(Block::from_word(block.to_word()), block);
        }
        assert_eq!([Block::of_port(7), Block::FREE].map(Block::port), [Some(7), None]);
    }

    #[test]
    fn an_empty_block_survives_its_neighbours() {
        let mut storage = storage::<4>();
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
