//! Requests and answers over a lossy line.

mod error;
mod request;
mod texts;

use std::collections::VecDeque;
use std::io::{Read, Write};
use std::time::{Duration, Instant};

use dimsart_link::protocol::{
    Counters, KeyRefusal, LeaseAction, MAX_FRAME_BYTES, Receiver, Refusal, Request, RequestSealer, Response,
    decode_response, encode_request, request_client, request_id,
};

use super::renewal::Renewal;
use super::unsolicited::Unsolicited;
use super::{ConnectError, Presence};
pub use error::{LineError, Timeouts};
use error::{failed, is_nothing_yet, too_long};
use hil_sim::clock;
use request::{answers, any_id, is_renewal, may_repeat};
use texts::make_visible;

/// Number of recent requests whose late answers are recognized.
const REMEMBERED: usize = 32;

/// A line to a device: sends requests and receives answers.
#[derive(Debug)]
pub struct RequestLine<S> {
    stream: S,
    patience: Timeouts,
    receiver: Receiver,
    bytes: u64,
    id: u16,
    content: Vec<u8>,
    unsolicited: Unsolicited,
    /// Authenticates requests to a locked device.
    sealer: Option<RequestSealer>,
    /// Renewals of the lease, while it is held.
    renewal: Option<Renewal>,
    /// Ids of recent requests.
    asked: VecDeque<u16>,
    /// Whether another client uses the number of this one.
    is_number_taken: bool,
}

impl<S: Read + Write> RequestLine<S> {
    /// Uses an open, unbuffered stream whose reads time out quickly; see [`Stream`](hil_sim::link::Stream).
    pub fn new(stream: S, patience: Timeouts) -> Self {
        Self {
            stream,
            patience,
            receiver: Receiver::new(),
            bytes: 0,
            id: any_id(),
            content: Vec::new(),
            unsolicited: Unsolicited::new(),
            sealer: None,
            renewal: None,
            asked: VecDeque::new(),
            is_number_taken: false,
        }
    }

    /// Returns the client number of this host on the line, from 1.
    pub(super) fn client(&self) -> u8 {
        request_client(self.id)
    }

    /// Authenticates the requests that need a key from now on; `None` disables authentication.
    pub(super) fn seal_with(&mut self, sealer: Option<RequestSealer>) {
        self.sealer = sealer;
    }

    /// Changes the client number.
    pub(super) fn change_client(&mut self) {
        let before = self.client();
        while self.client() == before {
            self.id = any_id();
        }
        (self.is_number_taken, self.renewal) = (false, None);
    }

    /// Renews the lease from now on; with a `presence` only while that user is present.
    pub(super) fn hold_lease(&mut self, presence: Option<Presence>) {
        self.renewal = Some(Renewal::new(self.client(), presence));
    }

    /// Ends the renewals.
    pub(super) fn end_renewals(&mut self) {
        self.renewal = None;
    }

    /// Returns whether a lease is renewed.
    pub(super) fn holds_lease(&self) -> bool {
        self.renewal.is_some()
    }

    /// Renews the lease if it is held and due. Reports an expired lease once and ends its renewals: late answers must not
    /// restore it.
    pub(super) fn renew(&mut self) -> Result<(), ConnectError> {
        self.send_renewal()?;
        let held = self.renewal.as_ref().map_or(Ok(()), Renewal::check);
        if held.is_err() {
            self.renewal = None;
        }
        held
    }

    fn send_renewal(&mut self) -> Result<(), LineError> {
        let Some(id) = self.renewal.as_mut().and_then(Renewal::due) else { return Ok(()) };
        self.send(&Request::Lease(LeaseAction::Renew), id)
    }

    /// Sends a request; it may get lost. Without an authenticated session, only the handshake of a protected request is
    /// sent.
    fn send(&mut self, request: &Request, id: u16) -> Result<(), LineError> {
        if self.asked.len() == REMEMBERED {
            self.asked.pop_front();
        }
        self.asked.push_back(id);
        let mut buffer = [0; MAX_FRAME_BYTES];
        let frame = if self.is_sealed(request) {
            self.send_handshake()?;
            let Some(sealer) = &mut self.sealer else { return Ok(()) };
            sealer.encode(request, id, &mut buffer)
        } else {
            encode_request(request, id, &mut buffer).map(Some)
        };
        self.write(frame.map_err(|_| too_long())?)
    }

    fn is_sealed(&self, request: &Request) -> bool {
        self.sealer.is_some() && request.needs_key()
    }

    /// Sends the pending handshake frame.
    fn send_handshake(&mut self) -> Result<(), LineError> {
        let Some(sealer) = &mut self.sealer else { return Ok(()) };
        let mut buffer = [0; MAX_FRAME_BYTES];
        let frame = sealer.handshake(&mut buffer).map_err(|_| too_long())?;
        self.write(frame)
    }

    /// Establishes an authenticated session; returns false if the device has another key.
    fn find_together(&mut self) -> Result<bool, LineError> {
        let Timeouts { timeout, tries } = self.patience;
        let mut hellos = 0;
        while let Some(sealer) = self.sealer.as_ref().filter(|sealer| !sealer.has_session()) {
            if hellos == tries {
                if sealer.is_rejected() {
                    return Ok(false);
                }
                let Counters { frames, .. } = self.receiver.counters();
                return Err(LineError::NoAnswer { tries, timeout, bytes: self.bytes, frames });
            }
            hellos += 1;
            self.send_handshake()?;
            let deadline = clock::now() + timeout;
            self.read_until(deadline, Awaited::Challenge)?;
            if self.sealer.as_ref().is_some_and(RequestSealer::is_rejected) {
                // The refusal may be forged: wait briefly for a valid challenge.
                let moment = clock::now() + timeout / 10;
                self.read_until(moment.min(deadline), Awaited::ValidChallenge)?;
            }
        }
        Ok(true)
    }

    /// Returns the content of the last answer.
    pub(super) fn content(&self) -> &[u8] {
        &self.content
    }

    /// Returns the id of the last request.
    pub(super) fn last_id(&self) -> u16 {
        self.id
    }

    /// Returns the unsolicited frames of the device.
    pub(super) fn unsolicited(&self) -> &Unsolicited {
        &self.unsolicited
    }

    pub(super) fn unsolicited_mut(&mut self) -> &mut Unsolicited {
        &mut self.unsolicited
    }

    /// Sets the timeouts and returns the previous ones.
    pub(super) fn set_patience(&mut self, patience: Timeouts) -> Timeouts {
        std::mem::replace(&mut self.patience, patience)
    }

    /// Receives unsolicited frames for some time.
    pub(super) fn listen(&mut self, time: Duration) -> Result<(), LineError> {
        self.read_until(clock::now() + time, Awaited::Nothing).map(drop)
    }

    /// Sends a request and returns its answer; ignores other frames and noise.
    ///
    /// An idempotent request is repeated after a timeout.
    ///
    /// # Errors
    /// [`LineError`]; after [`LineError::OutcomeUnknown`] the command may have been carried out.
    pub fn request(&mut self, request: &Request) -> Result<Response<'_>, LineError> {
        if self.is_number_taken && self.renewal.is_none() {
            self.change_client();
        }
        let [number, client] = self.id.to_le_bytes();
        self.id = request_id(client, number.wrapping_add(2));
        let is_sealed = self.is_sealed(request);
        let may_repeat = may_repeat(request);
        let mut tries = if may_repeat { self.patience.tries.max(1) } else { 1 };
        let (mut tried, mut is_known_anew) = (0, false);
        while tried < tries {
            tried += 1;
            if is_sealed && !self.find_together()? {
                return Ok(Response::Refused(Refusal::Key(KeyRefusal::NotAccepted)));
            }
            self.send(request, self.id)?;
            if !self.read_until(clock::now() + self.patience.timeout, Awaited::Answer(self.id))? {
                continue;
            }
            if is_sealed && !is_known_anew && is_not_accepted(&self.content) {
                // The session is lost: the device restarted, or another client took it. The request was not carried out.
                is_known_anew = true;
                tries += 1;
                self.sealer.iter_mut().for_each(RequestSealer::forget);
                continue;
            }
            return decode_response(&self.content)
                .map(|(_, response)| response)
                .map_err(|_| LineError::Unsupported);
        }
        let timeout = self.patience.timeout;
        let Counters { frames, .. } = self.receiver.counters();
        Err(match may_repeat {
            true => LineError::NoAnswer { tries, timeout, bytes: self.bytes, frames },
            false => LineError::OutcomeUnknown { timeout },
        })
    }

    fn write(&mut self, frame: Option<&[u8]>) -> Result<(), LineError> {
        match self.stream.write_all(frame.unwrap_or_default()) {
            // The transmit buffer is full: the frame counts as lost.
            Err(error) if is_nothing_yet(error.kind()) => Ok(()),
            result => result.map_err(failed),
        }
    }

    /// Reads until the awaited frame arrives, and returns false on timeout. An answer is stored in `content`.
    fn read_until(&mut self, deadline: Instant, awaited: Awaited) -> Result<bool, LineError> {
        let mut buffer = [0; 1024];
        while clock::now() < deadline {
            self.send_renewal()?;
            let Self {
                stream,
                receiver,
                bytes,
                content: answer,
                unsolicited,
                sealer,
                renewal,
                asked,
                is_number_taken,
                id,
                ..
            } = self;
            let count = match stream.read(&mut buffer) {
                Ok(0) => return Err(LineError::Closed),
                Ok(count) => count,
                Err(error) if is_nothing_yet(error.kind()) => continue,
                Err(error) => return Err(failed(error)),
            };
            let (mut is_there, client) = (false, request_client(*id));
            *bytes += u64::try_from(count).unwrap_or_default();
            receiver.push_all(buffer.get(..count).unwrap_or_default(), |content| {
                let is_known = sealer.as_ref().is_none_or(RequestSealer::has_session);
                match answers(content) {
                    None if sealer.as_mut().is_some_and(|sealer| sealer.receive(content)) => {
                        if !is_known {
                            is_there |= matches!(awaited, Awaited::Challenge | Awaited::ValidChallenge);
                            renewal.iter_mut().for_each(Renewal::hurry);
                        }
                    }
                    None => {
                        let is_rejected = sealer.as_ref().is_some_and(RequestSealer::is_rejected);
                        is_there |= awaited == Awaited::Challenge && is_rejected;
                        unsolicited.take(content, client);
                    }
                    Some(id) if awaited == Awaited::Answer(id) => {
                        is_there = true;
                        content.clone_into(answer);
                        make_visible(answer);
                    }
                    Some(other) if asked.contains(&other) => {
                        let Some(renewal) = renewal.as_mut().filter(|_| is_renewal(other)) else { return };
                        if is_not_accepted(content) {
                            sealer.iter_mut().for_each(RequestSealer::forget);
                            renewal.hurry();
                        } else {
                            renewal.take(content);
                        }
                    }
                    // An answer to another client, or to a forgotten request.
                    Some(other) => {
                        *is_number_taken |=
                            asked.back().is_some_and(|last| request_client(*last) == request_client(other))
                    }
                }
            });
            if is_there {
                return Ok(true);
            }
        }
        Ok(false)
    }
}

/// Frame to wait for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Awaited {
    Answer(u16),
    /// A challenge of the handshake, valid or not.
    Challenge,
    /// A valid challenge.
    ValidChallenge,
    /// No frame: wait for the deadline.
    Nothing,
}

/// Returns whether an answer reports a missing session.
fn is_not_accepted(content: &[u8]) -> bool {
    let refused = Response::Refused(Refusal::Key(KeyRefusal::NotAccepted));
    decode_response(content).is_ok_and(|(_, response)| response == refused)
}
