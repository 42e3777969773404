//! Lock-free transfer of words between two contexts: always consistent, always the latest.
//!
//! There are three buffers: the writer's, the reader's, and the latest data. A write and a read end with one
//! atomic operation that exchanges their own buffer for the latest. So each takes a constant number of steps,
//! even if one interrupts the other, and words of two writes never mix.
//!
//! `tests/snapshot_orders.rs` runs this file through every order that the memory model allows.

use super::atomic::{AtomicU8, AtomicU32, Ordering};

/// Flag in the index of the latest buffer: not read yet.
const IS_NEW: u8 = 4;
/// Initial owners of the buffers.
const WRITERS: u8 = 0;
const LAST: u8 = 1;
const READERS: u8 = 2;

/// `N` words from one writer to one reader.
#[derive(Debug)]
pub struct Snapshot<const N: usize> {
    buffers: [[AtomicU32; N]; 3],
    last: AtomicU8,
}

impl<const N: usize> Snapshot<N> {
    pub(super) const fn of(buffers: [[AtomicU32; N]; 3], last: AtomicU8) -> Self {
        Self { buffers, last }
    }

    /// Resets the snapshot and returns its two ends.
    pub fn split(&mut self) -> (SnapshotWriter<'_, N>, SnapshotReader<'_, N>) {
        self.last.store(LAST, Ordering::Relaxed);
        (SnapshotWriter { snapshot: self, own: WRITERS }, SnapshotReader { snapshot: self, own: READERS })
    }

    fn buffer(&self, index: u8) -> &[AtomicU32] {
        self.buffers.get(usize::from(index)).map_or(&[], |buffer| buffer)
    }
}

/// The writer's end.
#[derive(Debug)]
pub struct SnapshotWriter<'a, const N: usize> {
    snapshot: &'a Snapshot<N>,
    own: u8,
}

impl<const N: usize> SnapshotWriter<'_, N> {
    /// Publishes up to `N` words. If there are fewer, the remaining words keep older values.
    pub fn write(&mut self, words: impl IntoIterator<Item = u32>) {
        for (place, word) in self.snapshot.buffer(self.own).iter().zip(words) {
            place.store(word, Ordering::Relaxed);
        }
        // Release the stored words; acquire the buffer that the reader has finished with.
        self.own = self.snapshot.last.swap(self.own | IS_NEW, Ordering::AcqRel) & !IS_NEW;
    }
}

/// The reader's end.
#[derive(Debug)]
pub struct SnapshotReader<'a, const N: usize> {
    snapshot: &'a Snapshot<N>,
    own: u8,
}

impl<const N: usize> SnapshotReader<'_, N> {
    /// Takes the latest data; returns whether they are new.
    pub fn update(&mut self) -> bool {
        let is_new = self.snapshot.last.load(Ordering::Relaxed) & IS_NEW != 0;
        if is_new {
            // Acquire the writer's words; release the buffer that is given back.
            self.own = self.snapshot.last.swap(self.own, Ordering::AcqRel) & !IS_NEW;
        }
        is_new
    }

    /// Returns the words of the last [`update`](Self::update); all zero before the first data.
    pub fn words(&self) -> impl Iterator<Item = u32> + '_ {
        self.snapshot.buffer(self.own).iter().map(|word| word.load(Ordering::Relaxed))
    }
}
