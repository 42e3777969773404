//! Detects the arrival of packets of another process.

use std::fmt;
use std::time::{Duration, Instant};

/// Detects arrivals at a link without reading them.
pub struct ArrivalPoll(Box<dyn Fn() -> bool>);

/// Poll interval, short compared with a tick.
const LOOK: Duration = Duration::from_micros(50);

impl ArrivalPoll {
    /// Creates a poll; `has_come` returns whether data are waiting.
    pub fn new(has_come: impl Fn() -> bool + 'static) -> Self {
        Self(Box::new(has_come))
    }

    /// Returns the time of the first arrival; `None` without an arrival by `deadline`.
    #[must_use]
    pub fn wait_for_arrival(&self, deadline: Instant) -> Option<Instant> {
        loop {
            let now = Instant::now();
            if (self.0)() {
                return Some(now);
            }
            if now >= deadline {
                return None;
            }
            std::thread::sleep(LOOK);
        }
    }
}

impl fmt::Debug for ArrivalPoll {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("ArrivalPoll")
    }
}
