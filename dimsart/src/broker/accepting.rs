//! Connections that cannot be accepted: nothing ends by it, and each episode is reported once.

use std::io::{self, ErrorKind};
use std::time::Duration;

/// Before the next attempt.
pub(crate) const PAUSE: Duration = Duration::from_millis(100);

/// Failures of one listener to accept.
#[derive(Debug, Default)]
pub(crate) struct AcceptFailures {
    is_reported: bool,
}

impl AcceptFailures {
    /// The report of a failure, where it is the first one of an episode and not the peer's doing.
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

    /// The episode is over.
    pub(crate) fn end(&mut self) {
        self.is_reported = false;
    }
}
