//! Words that one context shows another one: always whole, always the newest, and nobody waits.
//!
//! Three buffers: one is the writer's, one the reader's, and the third holds what was written last. A write and a read
//! end by exchanging their own buffer for that one, which is a single atomic operation. So each takes the same few steps
//! whatever the other one does, in whichever of the two it is interrupted, and words of two writes never mix.
//!
//! `tests/snapshot_orders.rs` runs this very file through every order that the memory model allows.

use super::atomic::{AtomicU8, AtomicU32, Ordering};

/// In the word that says which buffer was written last: nobody has read it yet.
const IS_NEW: u8 = 4;
/// Whose buffers these are at first.
const WRITERS: u8 = 0;
const LAST: u8 = 1;
const READERS: u8 = 2;

/// `N` words, from one writer to one reader.
#[derive(Debug)]
pub struct Snapshot<const N: usize> {
    buffers: [[AtomicU32; N]; 3],
    last: AtomicU8,
}

impl<const N: usize> Snapshot<N> {
    pub(super) const fn of(buffers: [[AtomicU32; N]; 3], last: AtomicU8) -> Self {
        Self { buffers, last }
    }

    /// The two ends. Nothing has been written yet, whatever was before.
    pub fn split(&mut self) -> (SnapshotWriter<'_, N>, SnapshotReader<'_, N>) {
        self.last.store(LAST, Ordering::Relaxed);
        (SnapshotWriter { snapshot: self, own: WRITERS }, SnapshotReader { snapshot: self, own: READERS })
    }

    fn buffer(&self, index: u8) -> &[AtomicU32] {
        self.buffers.get(usize::from(index)).map_or(&[], |buffer| buffer)
    }
}

/// The end that writes.
#[derive(Debug)]
pub struct SnapshotWriter<'a, const N: usize> {
    snapshot: &'a Snapshot<N>,
    own: u8,
}

impl<const N: usize> SnapshotWriter<'_, N> {
    /// Shows these words, `N` of them at most; the last ones keep what they had two writes or more ago if there are fewer.
    pub fn write(&mut self, words: impl IntoIterator<Item = u32>) {
        for (place, word) in self.snapshot.buffer(self.own).iter().zip(words) {
            place.store(word, Ordering::Relaxed);
        }
        // Release: what was just stored. Acquire: the reader is done with the buffer that comes back.
        self.own = self.snapshot.last.swap(self.own | IS_NEW, Ordering::AcqRel) & !IS_NEW;
    }
}

/// The end that reads.
#[derive(Debug)]
pub struct SnapshotReader<'a, const N: usize> {
    snapshot: &'a Snapshot<N>,
    own: u8,
}

impl<const N: usize> SnapshotReader<'_, N> {
    /// Takes over what was written last; says whether that is new.
    pub fn update(&mut self) -> bool {
        let is_new = self.snapshot.last.load(Ordering::Relaxed) & IS_NEW != 0;
        if is_new {
            // Acquire: what the writer stored. Release: nothing more is read from the buffer that is given back.
            self.own = self.snapshot.last.swap(self.own, Ordering::AcqRel) & !IS_NEW;
        }
        is_new
    }

    /// The words as of the last [`update`](Self::update); all zero before the first one that was new.
    pub fn words(&self) -> impl Iterator<Item = u32> + '_ {
        self.snapshot.buffer(self.own).iter().map(|word| word.load(Ordering::Relaxed))
    }
}
