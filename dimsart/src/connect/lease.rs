//! The right to move the device, and how it says that it lives.

use dimsart_core::Tick;
use std::fmt;
use std::io::{Read, Write};
use std::time::Duration;

use dimsart_link::protocol::{Blocked, LeaseAction, LeaseStatus, NO_CLIENT, Refusal, Request, Response};
use serde::Serialize;

use super::{ConnectError, Device, LineError, Patience, Presence};

/// A device that says nothing for so long is told to be silent: three heartbeats.
const SILENCE: Duration = Duration::from_millis(300);
/// All tries together end before the lease does.
const RENEWAL: Patience = Patience { timeout: Duration::from_millis(45), tries: 3 };

/// How a device is doing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LiveReport {
    /// Ticks since the start.
    pub ticks: u64,
    /// Whether the scheme commands the device.
    pub is_commanded: bool,
    /// The same in words, with the first reason if it does not.
    pub state: String,
    /// The client that may move the device, if there is one.
    pub holder: Option<u8>,
    /// What the device dropped for want of room since its start, as far as it has said.
    pub dropped: u32,
    /// What came to it damaged or cut, as far as it has said.
    pub damaged: u32,
    /// Since when its heart does not beat, s; none when it does.
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
            write!(f, "; {dropped} dropped, {damaged} came damaged")?;
        }
        match silence_s {
            Some(silence_s) => {
                write!(f, "; NO HEARTBEAT for {silence_s:.1} s, it speaks only when it is asked")
            }
            None => Ok(()),
        }
    }
}

impl<S: Read + Write> Device<S> {
    /// This host's number on the line.
    #[must_use]
    pub fn client(&self) -> u8 {
        self.line().client()
    }

    /// Takes the lease that motion needs: 200 ms, unless it is [renewed](Self::renew_lease).
    ///
    /// # Errors
    /// [`ConnectError::Refused`] with the holder, when another client has it.
    pub fn take_lease(&mut self) -> Result<LeaseStatus, ConnectError> {
        if !self.has_taken_lease {
            let holder = self.lease_status()?.map(|status| status.holder);
            // Drawn twice on this line: both would be the holder.
            if holder == Some(self.client()) {
                self.line_mut().change_client();
            }
        }
        let taken = self.lease(LeaseAction::Take)?.ok_or(ConnectError::NoLease)?;
        self.has_taken_lease = true;
        // What it said before is not true any more.
        self.line_mut().unsolicited_mut().forget_heartbeat();
        Ok(taken)
    }

    /// Takes the lease and renews it in time from now on, while the device is asked for something, is
    /// [listened](Self::listen) to or [`renew_in_time`](Self::renew_in_time) is called, until it is
    /// [given back](Self::give_lease_back). Up to three renewals in a row may get lost.
    ///
    /// # Errors
    /// As [`take_lease`](Self::take_lease). All that asks the device later can fail as
    /// [`renew_lease`](Self::renew_lease).
    pub fn hold_lease(&mut self) -> Result<LeaseStatus, ConnectError> {
        let taken = self.take_lease()?;
        self.line_mut().hold_lease(None);
        Ok(taken)
    }

    /// The same for somebody, and only as long as he is there: the lease ends 200 ms after the last renewal.
    ///
    /// # Errors
    /// As [`hold_lease`](Self::hold_lease), and [`ConnectError::NobodyThere`] later.
    pub fn hold_lease_for(&mut self, presence: &Presence) -> Result<LeaseStatus, ConnectError> {
        let taken = self.take_lease()?;
        self.line_mut().hold_lease(Some(presence.clone()));
        Ok(taken)
    }

    /// Whether a lease is [held](Self::hold_lease): not any more after something has said that it is over.
    #[must_use]
    pub fn holds_lease(&self) -> bool {
        self.line().holds_lease()
    }

    /// Renews the lease if it is held and time to.
    ///
    /// # Errors
    /// As [`renew_lease`](Self::renew_lease).
    pub fn renew_in_time(&mut self) -> Result<(), ConnectError> {
        self.line_mut().renew()
    }

    /// Prolongs the lease.
    ///
    /// # Errors
    /// [`ConnectError::Refused`] when it was over: the device has got its safe input since.
    /// [`ConnectError::LeaseOver`] when the device does not answer in time.
    pub fn renew_lease(&mut self) -> Result<LeaseStatus, ConnectError> {
        let patience = self.line_mut().set_patience(RENEWAL);
        let renewed = self.lease(LeaseAction::Renew);
        self.line_mut().set_patience(patience);
        match renewed {
            Err(ConnectError::Line(LineError::NoAnswer { .. })) => Err(ConnectError::LeaseOver),
            renewed => renewed?.ok_or(ConnectError::NoLease),
        }
    }

    /// Gives the lease back: the device gets its safe input.
    ///
    /// # Errors
    /// As [`take_lease`](Self::take_lease).
    pub fn give_lease_back(&mut self) -> Result<(), ConnectError> {
        self.forget_lease();
        self.lease(LeaseAction::GiveBack).map(drop)
    }

    /// Ends the renewals.
    pub(super) fn forget_lease(&mut self) {
        self.line_mut().let_lease_go();
        self.has_taken_lease = false;
    }

    /// How the lease stands; none on a device that moves without one.
    pub(super) fn lease_status(&mut self) -> Result<Option<LeaseStatus>, ConnectError> {
        match self.lease(LeaseAction::Look) {
            Err(ConnectError::Refused(Refusal::NotUnderstood)) => Ok(None),
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

    /// Takes in what the device says by itself, for some time.
    ///
    /// # Errors
    /// [`ConnectError::Line`] when the line is gone.
    pub fn listen(&mut self, time: Duration) -> Result<(), LineError> {
        self.line_mut().listen(time)
    }

    /// Ticks since the start, as the last heartbeat said; none before the first one.
    #[must_use]
    pub fn heartbeat_ticks(&self) -> Option<u64> {
        self.line().unsolicited().heartbeat().map(|heard| heard.ticks)
    }

    /// How the device is doing, as its last heartbeat said; without one it is asked.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer what it is asked.
    pub fn live(&mut self) -> Result<LiveReport, ConnectError> {
        let unsolicited = self.line().unsolicited();
        let silence = unsolicited.silence();
        let heard = unsolicited.heartbeat().filter(|_| silence < SILENCE);
        // Why a scheme does not run, a heartbeat does not say.
        let (ticks, blocked) = match heard {
            Some(heard) if heard.blocked != Some(Blocked::Tick(Tick::Idle)) => (heard.ticks, heard.blocked),
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
