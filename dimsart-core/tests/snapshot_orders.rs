//! The snapshot between two engines, in every order of steps that the memory model allows.
//!
//! Loom does not move a load behind a later store, so it cannot show that the acquire of the writer's
//! exchange and the release of the reader's are needed; comments there explain why.
#![expect(clippy::unwrap_used, clippy::panic, reason = "in helpers of tests as in tests")]

use loom::sync::Arc;
use loom::thread;

mod atomic {
    pub(super) use loom::sync::atomic::{AtomicU8, AtomicU32, Ordering};
}

#[path = "../src/coupling/snapshot.rs"]
#[expect(unreachable_pub, reason = "a file of the crate, as it is there")]
mod snapshot;

use atomic::{AtomicU8, AtomicU32};
use snapshot::Snapshot;

const WORDS: usize = 2;

/// The writer writes its count into every word; the reader reads as often as possible.
fn explore(writes: u32, reads: usize) {
    loom::model(move || {
        let buffers = std::array::from_fn(|_| std::array::from_fn(|_| AtomicU32::new(0)));
        // Loom's threads are not scoped: the snapshot must live as long as this order.
        let snapshot: &'static mut Snapshot<WORDS> =
            Box::leak(Box::new(Snapshot::of(buffers, AtomicU8::new(0))));
        let (mut writer, mut reader) = snapshot.split();
        let done = Arc::new(AtomicU32::new(0));
        let has_written = Arc::clone(&done);
        let other = thread::spawn(move || {
            for count in 1..=writes {
                writer.write([count; WORDS]);
            }
            has_written.store(1, atomic::Ordering::Release);
        });
        let mut last = 0;
        for _ in 0..reads {
            let is_over = done.load(atomic::Ordering::Acquire) == 1;
            let is_new = reader.update();
            let words: Vec<u32> = reader.words().collect();
            let [first, second] = words[..] else { panic!("{words:?}") };
            assert_eq!(first, second, "of two writes");
            assert!(if is_new { first > last } else { first == last }, "{first} behind {last}");
            assert!(!is_over || first == writes, "not the newest: {first}");
            last = first;
        }
        other.join().unwrap();
        reader.update();
        assert_eq!(reader.words().next(), Some(writes), "the last write arrives");
    });
}

#[test]
fn words_of_two_writes_never_mix_and_the_newest_is_read() {
    explore(3, 3);
}

#[test]
fn a_writer_that_overtakes_the_reader_never_writes_to_what_it_reads() {
    explore(4, 2);
}
