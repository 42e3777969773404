//! Runs a host and its emulators on one processor.

/// Pins this thread, and every emulator that it starts, to its present processor.
///
/// In lockstep only one of them runs at a time. On one processor they switch without waking another one, which
/// doubles the speed. No effect if unsupported.
pub fn pin_to_current_cpu() {
    #[cfg(all(target_os = "linux", feature = "emulated"))]
    {
        use rustix::thread::{CpuSet, sched_getcpu, sched_setaffinity};
        let here = sched_getcpu();
        if here < CpuSet::MAX_CPU {
            let mut processors = CpuSet::new();
            processors.set(here);
            // Without pinning the run is only slower.
            let _ = sched_setaffinity(None, &processors);
        }
    }
}
