//! One processor for a host and its emulators.

/// Keeps this thread, and every emulator that it starts from now on, on the processor that it runs on.
///
/// In lockstep only one of them has anything to do at a time. On one processor they hand over without waking another
/// one up, which makes a run twice as fast. Does nothing where the system cannot do that.
pub fn share_one_processor() {
    #[cfg(all(target_os = "linux", feature = "emulated"))]
    {
        use rustix::thread::{CpuSet, sched_getcpu, sched_setaffinity};
        let here = sched_getcpu();
        if here < CpuSet::MAX_CPU {
            let mut processors = CpuSet::new();
            processors.set(here);
            // Refused, the run is only slower.
            let _ = sched_setaffinity(None, &processors);
        }
    }
}
