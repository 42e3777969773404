//! Finds out when packets arrive at a link of another process.

use std::fmt;
use std::time::{Duration, Instant};

/// Finds out when something arrives at a link, and leaves it there.
pub struct ArrivalPoll(Box<dyn Fn() -> bool>);

/// Time between two looks for a packet: short against a tick.
const LOOK: Duration = Duration::from_micros(50);

impl ArrivalPoll {
    /// A poll that asks `has_come` whether something waits.
    pub fn new(has_come: impl Fn() -> bool + 'static) -> Self {
        Self(Box::new(has_come))
    }

    /// The moment at which something is first found waiting; none when there is nothing by `deadline`.
    #[must_use]
    pub fn arrival_before(&self, deadline: Instant) -> Option<Instant> {
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
