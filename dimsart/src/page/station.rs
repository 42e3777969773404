//! A controller on the page: four independent lines, each with its own thread.
//!
//! ```text
//! asking    actions of browsers, and the lease
//! looking   scheme, faults and events
//! tapping   signals of every tick
//! stopping  STOP only
//! ```
//! A recording has a thread without a line: it receives the published rows.

mod asking;
mod looking;
mod recording;
mod stopping;
mod tapping;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::io;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Sender, SyncSender, TrySendError, channel, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use dimsart_core::ModuleKinds;
use serde_json::Value;
use tokio::sync::oneshot;

use super::action::Action;
use super::news::Board;
use super::page_device::{OpenLine, PageDevice, ReferenceOverrideFn};
use crate::connect::{ConnectError, Device, Presence, Timeouts};
use asking::{Ask, Asked, Asking};
use hil_sim::rig_file::Geometry;
use looking::look;
use recording::Recorder;
use stopping::stop;
use tapping::{Choice, Tapping};

/// Opens a line and identifies the device.
type Greet = Arc<dyn Fn() -> Result<PageDevice, ConnectError> + Send + Sync>;

/// Access to a controller.
pub struct Access {
    /// Port name, as given by the user.
    pub port: String,
    /// Opens a line to the controller.
    pub open: OpenLine,
    /// Module kinds of this program.
    pub kinds: ModuleKinds,
    /// Baud rate, which limits the rate of signal rows; `None` for a line without a limit.
    pub baud: Option<u32>,
    /// Moves references of a simulated device.
    pub hand: Option<ReferenceOverrideFn>,
    /// Geometry of a simulated device.
    pub geometry: Option<Geometry>,
    /// Folder for recordings; `None` disables them.
    pub recordings: Option<PathBuf>,
}

const PATIENCE: Timeouts = Timeouts { timeout: Duration::from_millis(300), tries: 4 };
/// Maximum number of unanswered requests per client, and of all clients.
const MAX_WAITING: usize = 32;
const MAX_WAITING_OF_ALL: usize = 256;
/// Maximum number of unsent STOPs.
const MAX_STOPS: usize = 256;
/// Delay before a closed line is opened again.
const PAUSE: Duration = Duration::from_millis(500);

/// A controller on the page.
#[derive(Debug)]
pub struct Station {
    name: String,
    asking: Sender<Ask>,
    stopping: SyncSender<oneshot::Sender<Answer>>,
    choosing: Sender<Choice>,
    recorder: Arc<Recorder>,
    board: Arc<Board>,
    clients: Mutex<BTreeMap<u64, Client>>,
    /// Counts pending requests.
    waiting: Arc<()>,
    /// Number of STOPs from this program.
    stops: Arc<AtomicU64>,
}

/// An active client.
#[derive(Debug, Clone, Default)]
struct Client {
    presence: Presence,
    /// Counts its pending requests.
    waiting: Arc<()>,
}

impl Client {
    fn waiting(&self) -> usize {
        Arc::strong_count(&self.waiting) - 1
    }
}

/// Counts a pending request until it is dropped.
#[derive(Debug)]
struct Waiting {
    _of_client: Arc<()>,
    _of_all: Arc<()>,
}

/// Result of an action, or the reason of its refusal.
pub(crate) type Answer = Result<Value, String>;

impl Station {
    /// Adds a controller to a page by number and name. Closed lines to it are opened again.
    ///
    /// # Errors
    /// An error of the system when a thread cannot be started.
    pub fn new(number: u8, name: &str, access: Access) -> io::Result<Self> {
        let Access { port, open, kinds, baud, hand, geometry, recordings } = access;
        let (asking, asks) = channel();
        let (choosing, choices) = channel();
        let (stopping, to_stop) = sync_channel(MAX_STOPS);
        let stops = Arc::new(AtomicU64::new(0));
        let board = Arc::new(Board::new(number));
        board.tell("simulated", &hand.is_some());
        board.tell("geometry", &geometry);
        let greet: Greet = Arc::new(move || Device::identify(open()?, PATIENCE, kinds));
        let start = |what: &str, run: Box<dyn FnOnce() + Send>| {
            thread::Builder::new().name(format!("{name} {what}")).spawn(run).map(drop)
        };
        let (looked, wakes) = channel();
        let (news, line) = (Arc::clone(&board), Arc::clone(&greet));
        let stopped = Arc::clone(&stops);
        let recorder = Arc::new(Recorder::new(Arc::clone(&board), name, port, baud, recordings));
        let records = Arc::clone(&recorder);
        let doing = Asking::new(news, line, looked, hand, stopped, records);
        start("asking", Box::new(move || doing.run(&asks)))?;
        let (news, line) = (Arc::clone(&board), Arc::clone(&greet));
        start("looking", Box::new(move || look(&news, &line, &wakes)))?;
        let (news, line) = (Arc::clone(&board), Arc::clone(&greet));
        start("tapping", Box::new(move || Tapping::new(news, baud, choices).run(&line)))?;
        start("stopping", Box::new(move || stop(&greet, &to_stop)))?;
        let (clients, waiting) = (Mutex::default(), Arc::default());
        let name = name.to_owned();
        Ok(Self { name, asking, stopping, choosing, recorder, board, clients, waiting, stops })
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    pub(crate) fn board(&self) -> &Arc<Board> {
        &self.board
    }

    /// Requests an action for a client; returns the receiver of its result.
    pub(crate) fn ask(&self, client: u64, action: Action) -> oneshot::Receiver<Answer> {
        let (answer, answered) = oneshot::channel();
        let Client { presence, waiting } = self.client(client);
        // One reference is the stored one, and one belongs to this request.
        let is_full = Arc::strong_count(&waiting) > MAX_WAITING + 1
            || Arc::strong_count(&self.waiting) > MAX_WAITING_OF_ALL;
        // A release is never refused.
        if is_full && !action.releases() {
            let reason = format!("{MAX_WAITING} requests to the device are pending: wait for their answers");
            let _ = answer.send(Err(reason));
            return answered;
        }
        let place = Waiting { _of_client: waiting, _of_all: Arc::clone(&self.waiting) };
        // If the thread has ended, the answer never arrives.
        match action {
            Action::Record { on: true } => drop(self.asking.send(Ask::Record { presence, answer, place })),
            Action::Record { on: false } => self.recorder.end("", answer),
            Action::Stream { .. } if self.recorder.is_running() => {
                let reason =
                    "cannot change the signals while a recording is running: end the recording first";
                let _ = answer.send(Err(reason.to_owned()));
            }
            Action::Stream { names } => drop(self.choosing.send(Choice { names, answer, _place: place })),
            action => {
                let (asked, stops) = (hil_sim::clock::now(), self.stops.load(Ordering::Relaxed));
                let _ = self.asking.send(Ask::Do(Asked {
                    client,
                    presence,
                    action,
                    asked,
                    stops,
                    answer,
                    place,
                }));
            }
        }
        answered
    }

    /// Ends a running recording before the program ends; returns its summary.
    pub(super) fn end_recording(&self) -> Option<String> {
        let (answer, answered) = oneshot::channel();
        self.recorder
            .is_running()
            .then(|| self.recorder.end("recording ended with `dimsart serve`", answer))?;
        Some(match answered.blocking_recv().ok()? {
            Ok(done) => done.as_str().unwrap_or_default().to_owned(),
            Err(reason) => reason,
        })
    }

    /// Stops the device and ends its lease for every client. Earlier requests that would move it are refused.
    pub(crate) fn stop(&self) -> oneshot::Receiver<Answer> {
        self.stops.fetch_add(1, Ordering::Relaxed);
        let (answer, answered) = oneshot::channel();
        if let Err(TrySendError::Full(answer)) = self.stopping.try_send(answer) {
            let _ = answer.send(Err(format!("{MAX_STOPS} STOPs are already pending for the device")));
        }
        answered
    }

    /// Reports that a client is present or has left, with immediate effect.
    pub(crate) fn hear(&self, client: u64, is_here: bool) {
        let presence = self.client(client).presence;
        if !is_here {
            presence.report_left();
            self.clients.lock().unwrap_or_else(PoisonError::into_inner).remove(&client);
            let _ = self.asking.send(Ask::IsGone { client });
        }
    }

    /// Returns a present client.
    fn client(&self, client: u64) -> Client {
        let mut clients = self.clients.lock().unwrap_or_else(PoisonError::into_inner);
        if clients.len() > MAX_WAITING_OF_ALL {
            clients.retain(|_, client| client.waiting() > 0 || client.presence.is_present());
        }
        let client = clients.entry(client).or_default();
        client.presence.report_present();
        client.clone()
    }
}
