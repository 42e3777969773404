//! Renews a lease in time, also while the line waits for an answer.

use std::time::{Duration, Instant};

use dimsart_link::protocol::{Refusal, Response, decode_response, request_id};

use super::{ConnectError, Presence};
use hil_sim::clock;

/// A quarter of the lease duration.
const PERIOD: Duration = Duration::from_millis(50);
/// Unanswered renewals after which the lease may have expired.
const MAX_UNANSWERED: u32 = 4;

/// Schedule and result of the renewals.
#[derive(Debug)]
pub(super) struct Renewal {
    client: u8,
    /// Odd; other requests have even numbers.
    number: u8,
    due: Instant,
    unanswered: u32,
    refusal: Option<Refusal>,
    /// The remote user of the lease; `None` if this program is the user.
    presence: Option<Presence>,
}

impl Renewal {
    /// Starts the renewals of a lease that this client has just taken.
    pub(super) fn new(client: u8, presence: Option<Presence>) -> Self {
        Self { client, number: 1, due: clock::now() + PERIOD, unanswered: 0, refusal: None, presence }
    }

    /// Returns the id of a renewal that is due now; always `None` for an expired lease.
    pub(super) fn due(&mut self) -> Option<u16> {
        let now = clock::now();
        if now < self.due || self.check().is_err() {
            return None;
        }
        self.due = now + PERIOD;
        self.number = self.number.wrapping_add(2);
        self.unanswered += 1;
        Some(request_id(self.client, self.number))
    }

    /// Repeats the last renewal immediately, after the session with the device was lost or established.
    pub(super) fn hurry(&mut self) {
        self.due = clock::now();
        self.unanswered = self.unanswered.saturating_sub(1);
    }

    /// Handles an answer to a renewal.
    pub(super) fn take(&mut self, content: &[u8]) {
        match decode_response(content) {
            Ok((_, Response::Lease(_))) => self.unanswered = 0,
            Ok((_, Response::Refused(refusal))) => self.refusal = Some(refusal),
            _ => {}
        }
    }

    /// Checks whether the lease is still held, as far as this end can know.
    pub(super) fn check(&self) -> Result<(), ConnectError> {
        match self.refusal {
            Some(refusal) => Err(ConnectError::Refused(refusal)),
            None if self.presence.as_ref().is_some_and(|presence| !presence.is_present()) => {
                Err(ConnectError::ClientSilent)
            }
            None if self.unanswered > MAX_UNANSWERED => Err(ConnectError::LeaseExpired),
            None => Ok(()),
        }
    }
}
