//! Carries out actions of clients one after another, and holds the lease for one client.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::thread;
use std::time::{Duration, Instant};

use serde::Serialize;
use tokio::sync::oneshot;

use super::super::action::Action;
use super::super::news::Board;
use super::recording::Recorder;
use super::{Answer, Greet, PAUSE, Waiting};
use crate::connect::{ConnectError, LiveReport, Presence};
use crate::page::page_device::{PageDevice, ReferenceOverrideFn};
use hil_sim::response::Held;

/// Maximum wait for a request before the line is read again.
const A_MOMENT: Duration = Duration::from_millis(15);
/// Polling interval of the device state.
const LOOK: Duration = Duration::from_millis(100);
/// Maximum age of a request that starts motion: its sender may believe that it was lost.
const TOO_LATE: Duration = Duration::from_secs(1);

/// Request to the thread.
#[derive(Debug)]
pub(super) enum Ask {
    Do(Asked),
    IsGone {
        client: u64,
    },
    /// Starts a recording.
    Record {
        presence: Presence,
        answer: oneshot::Sender<Answer>,
        place: Waiting,
    },
}

/// A requested action of a client.
#[derive(Debug)]
pub(super) struct Asked {
    pub(super) client: u64,
    pub(super) presence: Presence,
    pub(super) action: Action,
    pub(super) asked: Instant,
    /// Number of STOPs at that time.
    pub(super) stops: u64,
    pub(super) answer: oneshot::Sender<Answer>,
    pub(super) place: Waiting,
}

/// State of a device.
#[derive(Serialize)]
struct Status {
    live: LiveReport,
    /// The client of this program that holds the lease.
    holder: Option<u64>,
}

/// The thread.
pub(super) struct Asking {
    news: Arc<Board>,
    greet: Greet,
    /// Wakes the thread that reads the scheme.
    looked: Sender<()>,
    /// The client that holds the lease.
    holder: Option<u64>,
    /// Whether another program holds the device's lease.
    is_foreign: bool,
    hand: Option<ReferenceOverrideFn>,
    /// References that clients hold.
    held: Vec<(u64, String, usize)>,
    /// Number of STOPs.
    stops: Arc<AtomicU64>,
    /// Number of STOPs that were handled here.
    seen_stops: u64,
    recorder: Arc<Recorder>,
    /// Whether a line was closed within a transaction.
    has_left_open: bool,
}

impl Asking {
    pub(super) fn new(
        news: Arc<Board>,
        greet: Greet,
        looked: Sender<()>,
        hand: Option<ReferenceOverrideFn>,
        stops: Arc<AtomicU64>,
        recorder: Arc<Recorder>,
    ) -> Self {
        let (holder, held, has_left_open) = (None, Vec::new(), false);
        Self {
            news,
            greet,
            looked,
            holder,
            is_foreign: false,
            hand,
            held,
            stops,
            seen_stops: 0,
            recorder,
            has_left_open,
        }
    }

    pub(super) fn run(mut self, asks: &Receiver<Ask>) {
        loop {
            let ended = match (self.greet)() {
                Ok(mut device) => {
                    self.news.tell("gone", &None::<String>);
                    self.serve(&mut device, asks)
                }
                Err(error) => Err(error),
            };
            match ended {
                Ok(()) => return,
                Err(error) => {
                    self.news.tell("gone", &Some(error.to_string()));
                    for client in refuse(asks, &error) {
                        self.release_references(client);
                    }
                }
            }
            self.holder = None;
            thread::sleep(PAUSE);
        }
    }

    /// Serves requests until the line is closed or the page ends.
    fn serve(&mut self, device: &mut PageDevice, asks: &Receiver<Ask>) -> Result<(), ConnectError> {
        if std::mem::take(&mut self.has_left_open) {
            // The transaction may already be closed.
            let _ = device.abort();
        }
        let mut looked: Option<Instant> = None;
        loop {
            if looked.is_none_or(|looked| looked.elapsed() > LOOK) {
                let live = device.live()?;
                self.is_foreign = live.holder.is_some() && !device.holds_lease();
                self.news.tell("status", &Status { live, holder: self.holder });
                looked = Some(Instant::now());
            }
            match asks.recv_timeout(A_MOMENT) {
                Ok(ask) => {
                    match ask {
                        Ask::Do(asked) => self.take(device, asked),
                        Ask::IsGone { client } => self.forget(device, client),
                        Ask::Record { presence, .. } if presence.has_left() => {}
                        Ask::Record { answer, place, .. } => {
                            drop(answer.send(self.recorder.begin(device)));
                            drop(place);
                        }
                    }
                    looked = None;
                    // The receiver ends only with the page.
                    let _ = self.looked.send(());
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            }
            device.listen(Duration::from_millis(1))?;
            self.obey_stop(device);
            self.watch_holder(device)?;
        }
    }

    fn take(&mut self, device: &mut PageDevice, asked: Asked) {
        let Asked { client, presence, action, asked, stops, answer, place } = asked;
        if presence.has_left() {
            return;
        }
        self.obey_stop(device);
        let is_other = self.holder.is_some_and(|holder| holder != client);
        let arms = matches!(action, Action::Arm);
        let is_void = action.moves()
            && (hil_sim::clock::elapsed_since(asked) > TOO_LATE
                || stops != self.stops.load(Ordering::Relaxed));
        let done = if is_other && action.changes() {
            Err("another client holds the lease: disarm that client, or stop the device".to_owned())
        } else if is_void {
            Err("request expired: the device was stopped or did not answer meanwhile; repeat the request"
                .to_owned())
        } else if matches!(action, Action::Renew) && self.holder.is_none() {
            Err("lease expired: `arm` again".to_owned())
        } else {
            self.carry_out(device, client, &presence, action)
        };
        let done = match self.obey_stop(device) && arms {
            true => Err("the device was stopped meanwhile: lease released".to_owned()),
            false => done,
        };
        drop(place);
        // The client may have disconnected.
        let _ = answer.send(done);
    }

    /// Releases the lease after a STOP of this program, even if the lease was taken while the STOP was in transit. Returns
    /// whether it held the lease.
    fn obey_stop(&mut self, device: &mut PageDevice) -> bool {
        let stops = self.stops.load(Ordering::Relaxed);
        let is_stopped = std::mem::replace(&mut self.seen_stops, stops) != stops && self.holder.is_some();
        if is_stopped {
            self.let_go(device);
        }
        is_stopped
    }

    fn carry_out(
        &mut self,
        device: &mut PageDevice,
        client: u64,
        presence: &Presence,
        action: Action,
    ) -> Answer {
        if self.is_foreign && action.held().is_some_and(|(.., is_held)| is_held) {
            return Err("another program holds the lease: only this program can move the device".to_owned());
        }
        if let Some((signal, axis, is_held)) = action.held() {
            self.held.retain(|(_, held, at)| (held.as_str(), *at) != (signal, axis));
            self.held.extend(is_held.then(|| (client, signal.to_owned(), axis)));
        }
        let (arms, disarms) = (matches!(action, Action::Arm), matches!(action, Action::Disarm));
        let opens = matches!(action, Action::Transaction { .. } | Action::Scheme { .. });
        let done = action.run(device, self.hand.as_ref(), presence);
        if arms || disarms {
            self.holder = (arms && done.is_ok()).then_some(client);
        }
        self.has_left_open |= opens && matches!(done, Err(ConnectError::Line(_)));
        done.map_err(|error| error.to_string())
    }

    /// Releases the references and the lease of a disconnected client.
    fn forget(&mut self, device: &mut PageDevice, client: u64) {
        self.release_references(client);
        if self.holder == Some(client) {
            self.let_go(device);
        }
    }

    fn release_references(&mut self, client: u64) {
        let (gone, held) = self.held.drain(..).partition(|(holder, ..)| *holder == client);
        self.held = held;
        for ((_, signal, axis), hand) in Vec::into_iter(gone).zip(self.hand.iter().cycle()) {
            // The reference may be released already.
            let _ = hand(signal, axis, Held::Released);
        }
    }

    /// Detects that the holder has disconnected or the lease has expired. Its renewals have ended by then, even while the
    /// line waited for an answer.
    fn watch_holder(&mut self, device: &mut PageDevice) -> Result<(), ConnectError> {
        if self.holder.is_none() {
            return Ok(());
        }
        match device.renew_if_due() {
            Ok(()) if device.holds_lease() => {}
            Err(ConnectError::Line(error)) => return Err(error.into()),
            Err(ConnectError::ClientSilent) => {
                self.let_go(device);
                self.tell_lost("client silent for 0.5 s: lease released, outputs at their safe value");
            }
            // A fault, another client, or this computer was too busy to renew it.
            Err(error) => {
                self.holder = None;
                self.tell_lost(&format!("lease lost: {error}"));
            }
            Ok(()) => {
                self.holder = None;
                self.tell_lost("lease lost: `arm` again");
            }
        }
        Ok(())
    }

    /// Publishes why motion has ended.
    fn tell_lost(&self, reason: &str) {
        #[derive(Serialize)]
        struct Lost<'a> {
            reason: &'a str,
        }
        self.news.tell_once("lost", &Lost { reason });
    }

    fn let_go(&mut self, device: &mut PageDevice) {
        self.holder = None;
        // If the release fails, the lease expires.
        let _ = device.release_lease();
    }
}

/// Refuses pending requests, which may be outdated when the line is open again. Returns the clients that have disconnected.
fn refuse(asks: &Receiver<Ask>, error: &ConnectError) -> Vec<u64> {
    let mut gone = Vec::new();
    for ask in asks.try_iter() {
        match ask {
            Ask::Do(Asked { answer, .. }) | Ask::Record { answer, .. } => {
                let _ = answer.send(Err(error.to_string()));
            }
            Ask::IsGone { client } => gone.push(client),
        }
    }
    gone
}
