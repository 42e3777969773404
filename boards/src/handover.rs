//! From one priority to another: a bounded lock-free queue and somebody to wake.
//!
//! Nothing in it masks interrupts: what is handed over below the tick never holds a tick up.

use core::future::poll_fn;
use core::sync::atomic::{AtomicU32, Ordering::Relaxed};
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
    both: Both,
}

/// What both ends look at.
struct Both {
    waiting: Sleeper,
    /// Written by the giver alone.
    dropped: AtomicU32,
}

impl Both {
    fn count(&self) {
        self.dropped.store(self.dropped.load(Relaxed).saturating_add(1), Relaxed);
    }
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
        let both = Both { waiting: Sleeper::new(), dropped: AtomicU32::new(0) };
        Self { queue: Queue::new(), both }
    }

    /// Its two ends.
    pub fn split(&'static mut self) -> (Giver<T>, Taker<T>) {
        let (producer, consumer) = self.queue.split();
        (Giver { producer, both: &self.both }, Taker { consumer, both: &self.both })
    }
}

/// The end that items go in at.
pub struct Giver<T: 'static> {
    producer: Producer<'static, T>,
    both: &'static Both,
}

impl<T> Giver<T> {
    /// Hands an item over, or drops and counts it when the queue is full. Never waits.
    pub fn give(&mut self, item: T) {
        if self.producer.enqueue(item).is_err() {
            self.both.count();
        }
        self.both.waiting.wake();
    }

    /// As [`give`](Self::give), but leaves so many places free for what matters more.
    pub fn give_sparingly(&mut self, item: T, places: usize) {
        if self.producer.len() + places < self.producer.capacity() {
            self.give(item);
        } else {
            self.both.count();
        }
    }

    /// Waits until all that was handed over is taken, so that nothing of what is given next is dropped. Asks again and
    /// again, for a taker wakes nobody: for what is seldom given, from below the tick.
    pub async fn taken(&mut self) {
        poll_fn(|context| {
            if self.producer.is_empty() {
                return Poll::Ready(());
            }
            context.waker().wake_by_ref();
            Poll::Pending
        })
        .await;
    }

    /// Items dropped since the start.
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.both.dropped.load(Relaxed)
    }
}

/// The end that items come out at.
pub struct Taker<T: 'static> {
    consumer: Consumer<'static, T>,
    both: &'static Both,
}

impl<T> Taker<T> {
    /// Items that the other end dropped since the start.
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.both.dropped.load(Relaxed)
    }

    /// Takes an item if there is one. Never waits.
    pub fn take(&mut self) -> Option<T> {
        self.consumer.dequeue()
    }

    /// Shows an item where it lies, if there is one, and then drops it: for what is too large to be moved about.
    pub fn take_in_place<R>(&mut self, look: impl FnOnce(&T) -> R) -> Option<R> {
        let found = self.consumer.peek().map(look);
        drop(self.consumer.dequeue());
        found
    }

    /// Waits until there is an item.
    pub async fn ready(&mut self) {
        poll_fn(|context| {
            self.both.waiting.register(context);
            if self.consumer.ready() { Poll::Ready(()) } else { Poll::Pending }
        })
        .await;
    }

    /// Waits for an item.
    pub async fn next(&mut self) -> T {
        poll_fn(|context| {
            self.both.waiting.register(context);
            self.consumer.dequeue().map_or(Poll::Pending, Poll::Ready)
        })
        .await
    }
}

#[cfg(test)]
mod tests {
    use std::boxed::Box;
    use std::vec::Vec;

    use embassy_futures::block_on;
    use embassy_futures::join::join;
    use embassy_futures::yield_now;

    use super::*;

    #[test]
    fn what_is_given_sparingly_leaves_room_for_what_matters_more() {
        let (mut giver, mut taker) = Box::leak(Box::new(Handover::<u8, 4>::new())).split();
        for _ in 0..10 {
            giver.give_sparingly(0, 2);
        }
        giver.give(1);
        giver.give_sparingly(0, 2);
        giver.give(2);
        assert_eq!([(); 4].map(|()| taker.take()), [Some(0), Some(1), Some(2), None]);
        assert_eq!(giver.dropped(), 10);
    }

    #[test]
    fn who_waits_until_it_is_taken_has_nothing_dropped() {
        let (mut giver, mut taker) = Box::leak(Box::new(Handover::<u8, 2>::new())).split();
        let give = async {
            for item in [1, 2, 3] {
                giver.give(item);
                giver.taken().await;
            }
            giver.dropped()
        };
        let take = async {
            let mut taken = Vec::new();
            for turn in 0..40 {
                // Busy with something else most of the time.
                if turn % 10 == 9 {
                    taken.extend(taker.take());
                }
                yield_now().await;
            }
            taken
        };
        assert_eq!(block_on(join(give, take)), (0, [1, 2, 3].into()));
    }
}
