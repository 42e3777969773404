//! Presence of the remote user for whom a lease is held.

use hil_sim::clock;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Timeout of a silent user.
const SILENCE: Duration = Duration::from_millis(500);

/// Liveness of a remote user who moves a device, for example by the page. A lease held for that user is renewed only while
/// [`report_present`](Self::report_present) is called, from any thread.
#[derive(Debug, Clone)]
pub struct Presence(Arc<Mutex<Option<Instant>>>);

impl Default for Presence {
    /// Starts with a present user.
    fn default() -> Self {
        Self(Arc::new(Mutex::new(Some(clock::now()))))
    }
}

impl Presence {
    /// Reports that the user is present.
    pub fn report_present(&self) {
        self.set(Some(clock::now()));
    }

    /// Reports that the user has left.
    pub fn report_left(&self) {
        self.set(None);
    }

    /// Returns whether the user was present within the last 0.5 s.
    #[must_use]
    pub fn is_present(&self) -> bool {
        self.heard().is_some_and(|heard| clock::elapsed_since(heard) <= SILENCE)
    }

    /// Returns whether the user has left.
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
