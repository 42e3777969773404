//! Hears when packets come in at a link of another process.

use std::fmt;
use std::time::{Duration, Instant};

/// Hears when something comes in at a link, and leaves it where it is.
pub struct Ear(Box<dyn Fn() -> bool>);

/// Time between two looks for a packet: short against a tick.
const LOOK: Duration = Duration::from_micros(50);

impl Ear {
    /// An ear that asks `has_come` whether something waits.
    pub fn new(has_come: impl Fn() -> bool + 'static) -> Self {
        Self(Box::new(has_come))
    }

    /// The moment at which something is first found waiting; none when there is nothing by `deadline`.
    #[must_use]
    pub fn hear_until(&self, deadline: Instant) -> Option<Instant> {
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

impl fmt::Debug for Ear {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Ear")
    }
}
