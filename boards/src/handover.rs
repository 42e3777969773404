//! Bounded lock-free queues between priorities, with wake-up.
//!
//! Interrupts are never masked, so tasks below the tick cannot delay it.

use core::future::poll_fn;
use core::sync::atomic::{AtomicU32, Ordering::Relaxed};
use core::task::{Context, Poll};

use atomic_waker::AtomicWaker;
use heapless::spsc::{Consumer, Producer, Queue};

/// The waiting receiver. Separate functions, because of their many callers.
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

/// A queue of at most `N` - 1 items with one sender and one receiver.
pub struct ItemQueue<T, const N: usize> {
    queue: Queue<T, N>,
    both: Both,
}

/// State shared by both ends.
struct Both {
    waiting: Sleeper,
    /// Written by the sender only.
    dropped: AtomicU32,
}

impl Both {
    fn count(&self) {
        self.dropped.store(self.dropped.load(Relaxed).saturating_add(1), Relaxed);
    }
}

impl<T, const N: usize> Default for ItemQueue<T, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T, const N: usize> ItemQueue<T, N> {
    /// Creates an empty queue.
    #[must_use]
    pub const fn new() -> Self {
        let both = Both { waiting: Sleeper::new(), dropped: AtomicU32::new(0) };
        Self { queue: Queue::new(), both }
    }

    /// Returns its two ends.
    pub fn split(&'static mut self) -> (QueueSender<T>, QueueReceiver<T>) {
        let (producer, consumer) = self.queue.split();
        (QueueSender { producer, both: &self.both }, QueueReceiver { consumer, both: &self.both })
    }
}

/// The sending end.
pub struct QueueSender<T: 'static> {
    producer: Producer<'static, T>,
    both: &'static Both,
}

impl<T> QueueSender<T> {
    /// Sends an item, or drops and counts it if the queue is full. Does not block.
    pub fn send(&mut self, item: T) {
        if self.producer.enqueue(item).is_err() {
            self.both.count();
        }
        self.both.waiting.wake();
    }

    /// Like [`send`](Self::send), but keeps a number of places free for more important items.
    pub fn send_with_reserve(&mut self, item: T, places: usize) {
        if self.producer.len() + places < self.producer.capacity() {
            self.send(item);
        } else {
            self.both.count();
        }
    }

    /// Waits until the queue is empty, so that the next items are not dropped. Polls, because the receiver
    /// does not wake the sender: for rare items from tasks below the tick.
    pub async fn wait_empty(&mut self) {
        poll_fn(|context| {
            if self.producer.is_empty() {
                return Poll::Ready(());
            }
            context.waker().wake_by_ref();
            Poll::Pending
        })
        .await;
    }

    /// Returns the number of dropped items.
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.both.dropped.load(Relaxed)
    }
}

/// The receiving end.
pub struct QueueReceiver<T: 'static> {
    consumer: Consumer<'static, T>,
    both: &'static Both,
}

impl<T> QueueReceiver<T> {
    /// Returns the number of items that the sender dropped.
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.both.dropped.load(Relaxed)
    }

    /// Takes an item, if any. Does not block.
    pub fn try_receive(&mut self) -> Option<T> {
        self.consumer.dequeue()
    }

    /// Borrows an item, if any, and then drops it: avoids moving large items.
    pub fn receive_in_place<R>(&mut self, look: impl FnOnce(&T) -> R) -> Option<R> {
        let found = self.consumer.peek().map(look);
        drop(self.consumer.dequeue());
        found
    }

    /// Waits until there is an item.
    pub async fn ready_to_receive(&mut self) {
        poll_fn(|context| {
            self.both.waiting.register(context);
            if self.consumer.ready() { Poll::Ready(()) } else { Poll::Pending }
        })
        .await;
    }

    /// Waits for an item.
    pub async fn receive(&mut self) -> T {
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
        let (mut giver, mut taker) = Box::leak(Box::new(ItemQueue::<u8, 4>::new())).split();
        for _ in 0..10 {
            giver.send_with_reserve(0, 2);
        }
        giver.send(1);
        giver.send_with_reserve(0, 2);
        giver.send(2);
        assert_eq!([(); 4].map(|()| taker.try_receive()), [Some(0), Some(1), Some(2), None]);
        assert_eq!(giver.dropped(), 10);
    }

    #[test]
    fn who_waits_until_it_is_taken_has_nothing_dropped() {
        let (mut giver, mut taker) = Box::leak(Box::new(ItemQueue::<u8, 2>::new())).split();
        let give = async {
            for item in [1, 2, 3] {
                giver.send(item);
                giver.wait_empty().await;
            }
            giver.dropped()
        };
        let take = async {
            let mut taken = Vec::new();
            for turn in 0..40 {
                // Busy most of the time.
                if turn % 10 == 9 {
                    taken.extend(taker.try_receive());
                }
                yield_now().await;
            }
            taken
        };
        assert_eq!(block_on(join(give, take)), (0, [1, 2, 3].into()));
    }
}
