//! The lease that a line holds: renewed in time, whatever else is waited for.

use std::time::{Duration, Instant};

use dimsart_link::protocol::{Refusal, Response, decode_response, request_id};

use super::{ConnectError, Presence};
use hil_sim::clock;

/// A quarter of what the lease lasts.
const PERIOD: Duration = Duration::from_millis(50);
/// Renewals without an answer after which the lease may be over.
const MAX_UNANSWERED: u32 = 4;

/// When the lease is to be renewed, and what came of it.
#[derive(Debug)]
pub(super) struct Renewal {
    client: u8,
    /// Odd: other requests have even ones.
    number: u8,
    due: Instant,
    unanswered: u32,
    refusal: Option<Refusal>,
    /// For whom it is held; none: for this program.
    presence: Option<Presence>,
}

impl Renewal {
    /// Of a lease that this client has just taken, for somebody or for itself.
    pub(super) fn new(client: u8, presence: Option<Presence>) -> Self {
        Self { client, number: 1, due: clock::now() + PERIOD, unanswered: 0, refusal: None, presence }
    }

    /// The id of a renewal that is to be sent now, if so: none any more for a lease that is over.
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

    /// Has the last one be sent again at once: the device did not know who asked, or does from now on.
    pub(super) fn hurry(&mut self) {
        self.due = clock::now();
        self.unanswered = self.unanswered.saturating_sub(1);
    }

    /// Takes note of an answer to a renewal.
    pub(super) fn take(&mut self, content: &[u8]) {
        match decode_response(content) {
            Ok((_, Response::Lease(_))) => self.unanswered = 0,
            Ok((_, Response::Refused(refusal))) => self.refusal = Some(refusal),
            _ => {}
        }
    }

    /// Whether the lease is still held, as far as can be told.
    pub(super) fn check(&self) -> Result<(), ConnectError> {
        match self.refusal {
            Some(refusal) => Err(ConnectError::Refused(refusal)),
            None if self.presence.as_ref().is_some_and(|presence| !presence.is_there()) => {
                Err(ConnectError::NobodyThere)
            }
            None if self.unanswered > MAX_UNANSWERED => Err(ConnectError::LeaseOver),
            None => Ok(()),
        }
    }
}
