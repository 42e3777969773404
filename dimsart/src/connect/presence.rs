//! Whether the one is there for whom a lease is held.

use hil_sim::clock;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Who says nothing for so long is gone.
const SILENCE: Duration = Duration::from_millis(500);

/// Somebody who moves a device from afar, as by a page: a lease that is held for him is renewed as long as he is there. He
/// says so to this, from any thread, whatever the line to the device waits for meanwhile.
#[derive(Debug, Clone)]
pub struct Presence(Arc<Mutex<Option<Instant>>>);

impl Default for Presence {
    /// Of somebody who is there now.
    fn default() -> Self {
        Self(Arc::new(Mutex::new(Some(clock::now()))))
    }
}

impl Presence {
    /// He is there.
    pub fn beat(&self) {
        self.set(Some(clock::now()));
    }

    /// He has gone.
    pub fn leave(&self) {
        self.set(None);
    }

    /// Whether he was there within the last half second.
    #[must_use]
    pub fn is_there(&self) -> bool {
        self.heard().is_some_and(|heard| clock::since(heard) <= SILENCE)
    }

    /// Whether he has gone.
    pub(crate) fn has_left(&self) -> bool {
        self.heard().is_none()
    }

    fn heard(&self) -> Option<Instant> {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn set(&self, heard: Option<Instant>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = heard;
    }
}
