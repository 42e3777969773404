//! Failures to accept connections: reported once per episode, then retried.

use std::io::{self, ErrorKind};
use std::time::Duration;

/// Pause before the next attempt.
pub(crate) const PAUSE: Duration = Duration::from_millis(100);

/// Failures of one listener.
#[derive(Debug, Default)]
pub(crate) struct AcceptFailures {
    is_reported: bool,
}

impl AcceptFailures {
    /// Returns a report of the first failure of an episode, unless the peer caused it.
    pub(crate) fn report(&mut self, listener: &str, error: &io::Error) -> Option<String> {
        let is_of_peer = matches!(
            error.kind(),
            ErrorKind::ConnectionAborted | ErrorKind::ConnectionReset | ErrorKind::Interrupted
        );
        if is_of_peer || std::mem::replace(&mut self.is_reported, true) {
            return None;
        }
        Some(format!(
            "{listener}: cannot accept connections, retrying: {error}; raise the limit of open files (`ulimit -n`) or close \
             other clients"
        ))
    }

    /// Ends an episode.
    pub(crate) fn end(&mut self) {
        self.is_reported = false;
    }
}
