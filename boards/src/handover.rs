//! From one priority to another: a bounded lock-free queue and somebody to wake.
//!
//! Nothing in it masks interrupts: what is handed over below the tick never holds a tick up.

use core::future::poll_fn;
use core::task::{Context, Poll};

use atomic_waker::AtomicWaker;
use heapless::spsc::{Consumer, Producer, Queue};

/// Who waits at the other end. In functions of their own: there are many places that call them.
pub(crate) struct Sleeper(AtomicWaker);

impl Sleeper {
    pub(crate) const fn new() -> Self {
        Self(AtomicWaker::new())
    }

    #[inline(never)]
    pub(crate) fn wake(&self) {
        self.0.wake();
    }

    #[inline(never)]
    pub(crate) fn register(&self, context: &Context<'_>) {
        self.0.register(context.waker());
    }
}

/// A queue of at most `N` - 1 items with one giver and one taker.
pub struct Handover<T, const N: usize> {
    queue: Queue<T, N>,
    waiting: Sleeper,
}

impl<T, const N: usize> Default for Handover<T, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T, const N: usize> Handover<T, N> {
    /// An empty one.
    #[must_use]
    pub const fn new() -> Self {
        Self { queue: Queue::new(), waiting: Sleeper::new() }
    }

    /// Its two ends.
    pub fn split(&'static mut self) -> (Giver<T>, Taker<T>) {
        let (producer, consumer) = self.queue.split();
        (Giver { producer, waiting: &self.waiting, dropped: 0 }, Taker { consumer, waiting: &self.waiting })
    }
}

/// The end that items go in at.
pub struct Giver<T: 'static> {
    producer: Producer<'static, T>,
    waiting: &'static Sleeper,
    dropped: u32,
}

impl<T> Giver<T> {
    /// Hands an item over, or drops and counts it when the queue is full. Never waits.
    pub fn give(&mut self, item: T) {
        if self.producer.enqueue(item).is_err() {
            self.dropped = self.dropped.saturating_add(1);
        }
        self.waiting.wake();
    }

    /// As [`give`](Self::give), but leaves a place free for what matters more.
    pub fn give_sparingly(&mut self, item: T) {
        if self.producer.len() + 1 < self.producer.capacity() {
            self.give(item);
        } else {
            self.dropped = self.dropped.saturating_add(1);
        }
    }

    /// Items dropped since the start.
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.dropped
    }
}

/// The end that items come out at.
pub struct Taker<T: 'static> {
    consumer: Consumer<'static, T>,
    waiting: &'static Sleeper,
}

impl<T> Taker<T> {
    /// Takes an item if there is one. Never waits.
    pub fn take(&mut self) -> Option<T> {
        self.consumer.dequeue()
    }

    /// Waits for an item.
    pub async fn next(&mut self) -> T {
        poll_fn(|context| {
            self.waiting.register(context);
            self.consumer.dequeue().map_or(Poll::Pending, Poll::Ready)
        })
        .await
    }
}
