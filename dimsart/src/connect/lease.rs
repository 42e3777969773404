//! The lease that motion requires, and the heartbeat of the device.

use dimsart_core::TickResult;
use std::fmt;
use std::io::{Read, Write};
use std::time::Duration;

use dimsart_link::protocol::{
    LeaseAction, LeaseStatus, NO_CLIENT, NotCommandedReason, Refusal, Request, Response,
};
use serde::Serialize;

use super::{ConnectError, Device, LineError, Presence, Timeouts};

/// Timeout of the heartbeat: three periods.
const SILENCE: Duration = Duration::from_millis(300);
/// All tries together end before the lease expires.
const RENEWAL: Timeouts = Timeouts { timeout: Duration::from_millis(45), tries: 3 };

/// State of a device.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LiveReport {
    /// Ticks since the start.
    pub ticks: u64,
    /// Whether the scheme commands the device.
    pub is_commanded: bool,
    /// Text of `is_commanded`, with the first reason if it is false.
    pub state: String,
    /// The client that holds the lease.
    pub holder: Option<u8>,
    /// Frames that the device dropped for lack of buffer space since its start, by its last heartbeat.
    pub dropped: u32,
    /// Damaged or truncated frames that it received, by its last heartbeat.
    pub damaged: u32,
    /// Time without a heartbeat, s; `None` while heartbeats arrive.
    pub silence_s: Option<f64>,
}

impl fmt::Display for LiveReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { ticks, state, holder, dropped, damaged, silence_s, .. } = self;
        write!(f, "tick {ticks}: {state}")?;
        if let Some(holder) = holder {
            write!(f, "; client {holder} holds the lease")?;
        }
        if (*dropped, *damaged) != (0, 0) {
            write!(f, "; frames: {dropped} dropped, {damaged} damaged")?;
        }
        match silence_s {
            Some(silence_s) => {
                write!(f, "; NO HEARTBEAT for {silence_s:.1} s, the device only answers requests")
            }
            None => Ok(()),
        }
    }
}

impl<S: Read + Write> Device<S> {
    /// Returns the client number of this host on the line.
    #[must_use]
    pub fn client(&self) -> u8 {
        self.line().client()
    }

    /// Takes the lease that motion requires. It expires after 200 ms unless it is [renewed](Self::renew_lease).
    ///
    /// # Errors
    /// [`ConnectError::Refused`] with the holder, when another client has it.
    pub fn take_lease(&mut self) -> Result<LeaseStatus, ConnectError> {
        if !self.has_taken_lease {
            let holder = self.lease_status()?.map(|status| status.holder);
            // Another client has the same number: both would be the holder.
            if holder == Some(self.client()) {
                self.line_mut().change_client();
            }
        }
        let taken = self.lease(LeaseAction::Take)?.ok_or(ConnectError::NoLease)?;
        self.has_taken_lease = true;
        // The last heartbeat is outdated.
        self.line_mut().unsolicited_mut().forget_heartbeat();
        Ok(taken)
    }

    /// Takes the lease and renews it in time until it is [released](Self::release_lease). Requests,
    /// [`listen`](Self::listen) and [`renew_if_due`](Self::renew_if_due) send the renewals; three in a row may get lost.
    ///
    /// # Errors
    /// As [`take_lease`](Self::take_lease). Later requests can fail as [`renew_lease`](Self::renew_lease).
    pub fn hold_lease(&mut self) -> Result<LeaseStatus, ConnectError> {
        let taken = self.take_lease()?;
        self.line_mut().hold_lease(None);
        Ok(taken)
    }

    /// Holds the lease for a remote user, only while the user is present: it expires 200 ms after the last renewal.
    ///
    /// # Errors
    /// As [`hold_lease`](Self::hold_lease), and [`ConnectError::ClientSilent`] later.
    pub fn hold_lease_while_present(&mut self, presence: &Presence) -> Result<LeaseStatus, ConnectError> {
        let taken = self.take_lease()?;
        self.line_mut().hold_lease(Some(presence.clone()));
        Ok(taken)
    }

    /// Returns whether a lease is [held](Self::hold_lease), by the last answers.
    #[must_use]
    pub fn holds_lease(&self) -> bool {
        self.line().holds_lease()
    }

    /// Renews the lease if it is held and due.
    ///
    /// # Errors
    /// As [`renew_lease`](Self::renew_lease).
    pub fn renew_if_due(&mut self) -> Result<(), ConnectError> {
        self.line_mut().renew()
    }

    /// Renews the lease.
    ///
    /// # Errors
    /// [`ConnectError::Refused`] when it had expired: outputs are at their safe value.
    /// [`ConnectError::LeaseExpired`] when the device does not answer in time.
    pub fn renew_lease(&mut self) -> Result<LeaseStatus, ConnectError> {
        let patience = self.line_mut().set_patience(RENEWAL);
        let renewed = self.lease(LeaseAction::Renew);
        self.line_mut().set_patience(patience);
        match renewed {
            Err(ConnectError::Line(LineError::NoAnswer { .. })) => Err(ConnectError::LeaseExpired),
            renewed => renewed?.ok_or(ConnectError::NoLease),
        }
    }

    /// Releases the lease: outputs go to their safe value.
    ///
    /// # Errors
    /// As [`take_lease`](Self::take_lease).
    pub fn release_lease(&mut self) -> Result<(), ConnectError> {
        self.forget_lease();
        self.lease(LeaseAction::Release).map(drop)
    }

    /// Ends the renewals.
    pub(super) fn forget_lease(&mut self) {
        self.line_mut().end_renewals();
        self.has_taken_lease = false;
    }

    /// Reads the state of the lease; `None` on a device without a lease.
    pub(super) fn lease_status(&mut self) -> Result<Option<LeaseStatus>, ConnectError> {
        match self.lease(LeaseAction::Read) {
            Err(ConnectError::Refused(Refusal::Unsupported)) => Ok(None),
            answer => answer,
        }
    }

    fn lease(&mut self, action: LeaseAction) -> Result<Option<LeaseStatus>, ConnectError> {
        let take = |response: Response<'_>| match response {
            Response::Lease(status) => Some(status),
            _ => None,
        };
        self.ask(&Request::Lease(action), take)
    }

    /// Receives unsolicited frames for some time.
    ///
    /// # Errors
    /// [`LineError`] when the line is closed.
    pub fn listen(&mut self, time: Duration) -> Result<(), LineError> {
        self.line_mut().listen(time)
    }

    /// Returns the ticks since the start, by the last heartbeat; `None` before the first one.
    #[must_use]
    pub fn heartbeat_ticks(&self) -> Option<u64> {
        self.line().unsolicited().heartbeat().map(|heard| heard.ticks)
    }

    /// Returns the state of the device by its last heartbeat; without a heartbeat, by a request.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer.
    pub fn live(&mut self) -> Result<LiveReport, ConnectError> {
        let unsolicited = self.line().unsolicited();
        let silence = unsolicited.silence();
        let heard = unsolicited.heartbeat().filter(|_| silence < SILENCE);
        // A heartbeat does not contain why a scheme does not run.
        let (ticks, blocked) = match heard {
            Some(heard) if heard.blocked != Some(NotCommandedReason::Tick(TickResult::Idle)) => {
                (heard.ticks, heard.blocked)
            }
            _ => self.status().map(|status| (status.ticks, status.blocked))?,
        };
        let lease = match heard {
            Some(heard) => heard.lease,
            None => self.lease_status()?.unwrap_or_default(),
        };
        let counters = self.line().unsolicited().heartbeat().map(|heard| (heard.dropped, heard.damaged));
        let (dropped, damaged) = counters.unwrap_or_default();
        Ok(LiveReport {
            ticks,
            is_commanded: blocked.is_none(),
            state: self.state_text(blocked)?,
            holder: Some(lease.holder).filter(|holder| *holder != NO_CLIENT),
            dropped,
            damaged,
            silence_s: (silence >= SILENCE).then_some(silence.as_secs_f64()),
        })
    }
}
