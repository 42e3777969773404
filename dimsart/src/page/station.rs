//! A controller as the page has it: four lines to it, each with a thread, so that none waits for another one.
//!
//! ```text
//! asking    what browsers want to be done, and the lease
//! looking   the whole scheme, faults and events
//! tapping   the signals of every tick
//! stopping  STOP alone
//! ```
//! A recording has one more, without a line: it hears what is told.

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

use dimsart_core::Kinds;
use serde_json::Value;
use tokio::sync::oneshot;

use super::action::Action;
use super::news::Board;
use super::page_device::{Hand, OpenLine, PageDevice};
use crate::connect::{ConnectError, Device, Patience, Presence};
use asking::{Ask, Asked, Asking};
use looking::look;
use recording::Recorder;
use stopping::stop;
use tapping::{Choice, Tapping};

/// Opens a line and finds out who is there.
type Greet = Arc<dyn Fn() -> Result<PageDevice, ConnectError> + Send + Sync>;

/// How a controller is reached.
pub struct Access {
    /// Where it is, as a user names it.
    pub port: String,
    /// Opens a line to it.
    pub open: OpenLine,
    /// The module kinds that this program knows.
    pub kinds: Kinds,
    /// Bits per second of its line, by which rows of signals come; none where it carries all of them.
    pub baud: Option<u32>,
    /// What a simulated one has.
    pub hand: Option<Hand>,
    /// Folder for what is recorded of it; none where nothing is.
    pub recordings: Option<PathBuf>,
}

const PATIENCE: Patience = Patience { timeout: Duration::from_millis(300), tries: 4 };
/// Requests of one client that are not answered yet, and of all of them; more are refused.
const MAX_WAITING: usize = 32;
const MAX_WAITING_OF_ALL: usize = 256;
/// STOPs that are not sent yet: with one more, the device is stopped by those.
const MAX_STOPS: usize = 256;
/// Before a line that has ended is opened again.
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
    /// Counts the requests that wait.
    waiting: Arc<()>,
    /// How often it was stopped from here.
    stops: Arc<AtomicU64>,
}

/// A client that has said something.
#[derive(Debug, Clone, Default)]
struct Client {
    presence: Presence,
    /// Counts its requests that wait.
    waiting: Arc<()>,
}

impl Client {
    fn waiting(&self) -> usize {
        Arc::strong_count(&self.waiting) - 1
    }
}

/// A request's place among those that wait, given back when this goes.
#[derive(Debug)]
struct Waiting {
    _of_client: Arc<()>,
    _of_all: Arc<()>,
}

/// What an action came to: its result, or why it was refused.
pub(crate) type Answer = Result<Value, String>;

impl Station {
    /// The `number`th controller of a page, by a name. Lines to it are opened again when they end.
    ///
    /// # Errors
    /// Whatever the system says when there is no thread left.
    pub fn new(number: u8, name: &str, access: Access) -> io::Result<Self> {
        let Access { port, open, kinds, baud, hand, recordings } = access;
        let (asking, asks) = channel();
        let (choosing, choices) = channel();
        let (stopping, to_stop) = sync_channel(MAX_STOPS);
        let stops = Arc::new(AtomicU64::new(0));
        let board = Arc::new(Board::new(number));
        let greet: Greet = Arc::new(move || Device::greet(open()?, PATIENCE, kinds));
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

    /// Does something for a browser; what came of it.
    pub(crate) fn ask(&self, client: u64, action: Action) -> oneshot::Receiver<Answer> {
        let (answer, answered) = oneshot::channel();
        let Client { presence, waiting } = self.client(client);
        // One copy is kept, and one of the client's is this request's.
        if Arc::strong_count(&waiting) > MAX_WAITING + 1
            || Arc::strong_count(&self.waiting) > MAX_WAITING_OF_ALL
        {
            let reason = format!("{MAX_WAITING} requests wait for the device: wait for their answers");
            let _ = answer.send(Err(reason));
            return answered;
        }
        let place = Waiting { _of_client: waiting, _of_all: Arc::clone(&self.waiting) };
        // Where a thread is gone, the answer never comes.
        match action {
            Action::Record { on: true } => drop(self.asking.send(Ask::Record { presence, answer, place })),
            Action::Record { on: false } => self.recorder.end("", answer),
            Action::Stream { .. } if self.recorder.is_running() => {
                let reason = "it is being recorded: end the recording first, which is of the signals that are sent now";
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

    /// Ends what is recorded, before the program ends; what it came to, where there was something.
    pub(super) fn end_recording(&self) -> Option<String> {
        let (answer, answered) = oneshot::channel();
        self.recorder.is_running().then(|| self.recorder.end("`dimsart serve` was ended", answer))?;
        Some(match answered.blocking_recv().ok()? {
            Ok(done) => done.as_str().unwrap_or_default().to_owned(),
            Err(reason) => reason,
        })
    }

    /// Stops the device and ends its lease, for every client. What was asked before and would move it is refused from now on.
    pub(crate) fn stop(&self) -> oneshot::Receiver<Answer> {
        self.stops.fetch_add(1, Ordering::Relaxed);
        let (answer, answered) = oneshot::channel();
        if let Err(TrySendError::Full(answer)) = self.stopping.try_send(answer) {
            let _ = answer.send(Err(format!("{MAX_STOPS} STOPs wait to be sent to the device")));
        }
        answered
    }

    /// A client is there, or has gone. It counts at once, whatever the line waits for.
    pub(crate) fn hear(&self, client: u64, is_here: bool) {
        let presence = self.client(client).presence;
        if !is_here {
            presence.leave();
            self.clients.lock().unwrap_or_else(PoisonError::into_inner).remove(&client);
            let _ = self.asking.send(Ask::IsGone { client });
        }
    }

    /// A client that is there.
    fn client(&self, client: u64) -> Client {
        let mut clients = self.clients.lock().unwrap_or_else(PoisonError::into_inner);
        if clients.len() > MAX_WAITING_OF_ALL {
            clients.retain(|_, client| client.waiting() > 0 || client.presence.is_there());
        }
        let client = clients.entry(client).or_default();
        client.presence.beat();
        client.clone()
    }
}
