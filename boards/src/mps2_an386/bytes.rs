//! A lock-free byte queue between priorities, used through shared references.
//!
//! An interrupt owns nothing, so it cannot hold an end of a [`ItemQueue`](crate::handover::ItemQueue).

use core::future::poll_fn;
use core::sync::atomic::{AtomicU8, AtomicUsize, Ordering};
use core::task::Poll;

use crate::handover::Sleeper;

/// A queue of up to `N` bytes (a power of two), with one writer and one reader.
pub(super) struct Bytes<const N: usize> {
    bytes: [AtomicU8; N],
    /// Bytes written and read since the start, both wrapping.
    put: AtomicUsize,
    taken: AtomicUsize,
    reader: Sleeper,
    writer: Sleeper,
}

impl<const N: usize> Bytes<N> {
    pub(super) const fn new() -> Self {
        const { assert!(N.is_power_of_two(), "the counts wrap at a multiple of the length") };
        Self {
            bytes: [const { AtomicU8::new(0) }; N],
            put: AtomicUsize::new(0),
            taken: AtomicUsize::new(0),
            reader: Sleeper::new(),
            writer: Sleeper::new(),
        }
    }

    /// Writes as many bytes as fit; returns their number.
    pub(super) fn try_write(&self, bytes: &[u8]) -> usize {
        let (put, taken) = (self.put.load(Ordering::Relaxed), self.taken.load(Ordering::Acquire));
        let room = N.saturating_sub(put.wrapping_sub(taken));
        let mut count = 0;
        for byte in bytes.iter().take(room) {
            self.place(put.wrapping_add(count)).store(*byte, Ordering::Relaxed);
            count += 1;
        }
        self.put.store(put.wrapping_add(count), Ordering::Release);
        self.reader.wake();
        count
    }

    /// Returns whether the queue is empty.
    pub(super) fn is_empty(&self) -> bool {
        self.put.load(Ordering::Relaxed) == self.taken.load(Ordering::Relaxed)
    }

    /// Reads as many bytes as fit; returns their number.
    pub(super) fn try_read(&self, bytes: &mut [u8]) -> usize {
        let (put, taken) = (self.put.load(Ordering::Acquire), self.taken.load(Ordering::Relaxed));
        let mut count = 0;
        for byte in bytes.iter_mut().take(put.wrapping_sub(taken)) {
            *byte = self.place(taken.wrapping_add(count)).load(Ordering::Relaxed);
            count += 1;
        }
        self.taken.store(taken.wrapping_add(count), Ordering::Release);
        self.writer.wake();
        count
    }

    /// Waits for bytes and reads them.
    pub(super) async fn read(&self, bytes: &mut [u8]) -> usize {
        wait(&self.reader, || self.try_read(bytes)).await
    }

    /// Waits for room and writes as many bytes as fit.
    pub(super) async fn write(&self, bytes: &[u8]) -> usize {
        wait(&self.writer, || self.try_write(bytes)).await
    }

    #[expect(clippy::indexing_slicing, reason = "a remainder is smaller than the length")]
    fn place(&self, count: usize) -> &AtomicU8 {
        &self.bytes[count % N]
    }
}

/// Waits until `attempt` transfers at least one byte.
async fn wait(waiting: &Sleeper, mut attempt: impl FnMut() -> usize) -> usize {
    poll_fn(|context| {
        waiting.register(context);
        match attempt() {
            0 => Poll::Pending,
            count => Poll::Ready(count),
        }
    })
    .await
}
