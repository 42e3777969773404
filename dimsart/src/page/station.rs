//! A controller as the page has it: three lines to it, each with a thread.
//!
//! ```text
//! asking    commands, and how it is doing: one question at a time
//! tapping   the signals of every tick
//! stopping  STOP alone, which waits for no other question
//! ```

use std::io;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

use serde::Serialize;
use serde_json::Value;
use tokio::sync::oneshot;

use super::action::Action;
use super::news::Board;
use crate::connect::{ConnectError, Device, LiveReport, Patience, Tap};
use hil_sim::link::Stream;

/// A controller at the other end of a line, of whatever kind.
pub(super) type PageDevice = Device<Box<dyn Stream>>;
/// Makes a line to the controller.
pub type OpenLine = Box<dyn Fn() -> Result<Box<dyn Stream>, ConnectError> + Send + Sync>;

const PATIENCE: Patience = Patience { timeout: Duration::from_millis(300), tries: 4 };
/// Longest wait for a command before the device is looked at again.
const A_MOMENT: Duration = Duration::from_millis(15);
/// How often the rows of ticks go out: a screen's picture.
const PICTURE: Duration = Duration::from_millis(20);
/// From one look at how the device is doing to the next.
const LOOK: Duration = Duration::from_millis(100);
/// From one look at its whole scheme to the next: another client may have changed it.
const WHOLE_LOOK: Duration = Duration::from_secs(2);
/// Before a line that has ended is opened again.
const PAUSE: Duration = Duration::from_millis(500);
/// A browser that holds the lease and says nothing for so long is gone.
pub(super) const SILENCE: Duration = Duration::from_millis(500);

/// A controller on the page.
#[derive(Debug)]
pub struct Station {
    name: String,
    asking: Sender<Ask>,
    stopping: Sender<oneshot::Sender<Answer>>,
    board: Arc<Board>,
}

/// What an action came to: its result, or why it was refused.
pub(super) type Answer = Result<Value, String>;

/// What a browser has for the thread that asks.
#[derive(Debug)]
enum Ask {
    Do { client: u64, action: Action, answer: oneshot::Sender<Answer> },
    IsHere { client: u64 },
    IsGone { client: u64 },
}

impl Station {
    /// The `number`th controller of a page, by a name. Lines to it are opened, and opened again when they end.
    ///
    /// # Errors
    /// Whatever the system says when there is no thread left.
    pub fn new(number: u8, name: &str, open: OpenLine) -> io::Result<Self> {
        let (asking, asks) = channel();
        let (stopping, stops) = channel();
        let (board, open) = (Arc::new(Board::new(number)), Arc::new(open));
        let start = |what: &str, run: Box<dyn FnOnce() + Send>| {
            thread::Builder::new().name(format!("{name} {what}")).spawn(run).map(drop)
        };
        let (news, line) = (Arc::clone(&board), Arc::clone(&open));
        start("asking", Box::new(move || Asking { news, open: line, holder: None }.run(&asks)))?;
        let (news, line) = (Arc::clone(&board), Arc::clone(&open));
        start("tapping", Box::new(move || tap(&news, &line)))?;
        start("stopping", Box::new(move || stop(&open, &stops)))?;
        Ok(Self { name: name.to_owned(), asking, stopping, board })
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn board(&self) -> &Board {
        &self.board
    }

    /// Does something for a browser; what came of it.
    pub(super) fn ask(&self, client: u64, action: Action) -> oneshot::Receiver<Answer> {
        let (answer, answered) = oneshot::channel();
        // Where the thread is gone, the answer never comes.
        let _ = self.asking.send(Ask::Do { client, action, answer });
        answered
    }

    /// Stops the device, whoever says so.
    pub(super) fn stop(&self) -> oneshot::Receiver<Answer> {
        let (answer, answered) = oneshot::channel();
        let _ = self.stopping.send(answer);
        answered
    }

    /// A browser is there, or has gone.
    pub(super) fn hear(&self, client: u64, is_here: bool) {
        let _ = self.asking.send(if is_here { Ask::IsHere { client } } else { Ask::IsGone { client } });
    }
}

/// How a device is doing.
#[derive(Serialize)]
struct Status {
    live: LiveReport,
    /// Whether this page moves it.
    is_held_here: bool,
}

/// The thread that asks.
struct Asking {
    news: Arc<Board>,
    open: Arc<OpenLine>,
    /// The browser that holds the lease, and when it was heard last.
    holder: Option<(u64, Instant)>,
}

impl Asking {
    fn run(mut self, asks: &Receiver<Ask>) {
        loop {
            let greeted = (self.open)().and_then(|line| Device::greet(line, PATIENCE));
            let ended = match greeted {
                Ok(mut device) => {
                    self.news.tell("gone", &None::<String>);
                    self.serve(&mut device, asks)
                }
                Err(error) => Err(error),
            };
            match ended {
                Ok(()) => return,
                Err(error) => self.news.tell("gone", &Some(error.to_string())),
            }
            self.holder = None;
            thread::sleep(PAUSE);
        }
    }

    /// Until the line ends, or the page does.
    fn serve(&mut self, device: &mut PageDevice, asks: &Receiver<Ask>) -> Result<(), ConnectError> {
        let (mut looked, mut looked_whole) = (None::<Instant>, None::<Instant>);
        self.news.tell("kinds", &device.kinds()?);
        loop {
            let is_due = |last: Option<Instant>, period| last.is_none_or(|last| last.elapsed() > period);
            if is_due(looked_whole, WHOLE_LOOK) {
                self.news.tell("overview", &device.overview()?);
                self.news.tell("faults", &device.faults()?);
                self.news.tell("events", &device.events()?);
                looked_whole = Some(Instant::now());
            }
            if is_due(looked, LOOK) {
                let live = device.live()?;
                self.news.tell("status", &Status { live, is_held_here: self.holder.is_some() });
                looked = Some(Instant::now());
            }
            match asks.recv_timeout(A_MOMENT) {
                Ok(ask) => {
                    if self.take(device, ask) {
                        (looked, looked_whole) = (None, None);
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            }
            device.listen(Duration::from_millis(1))?;
            self.watch_holder(device)?;
        }
    }

    /// True when something was done that may have changed the device.
    fn take(&mut self, device: &mut PageDevice, ask: Ask) -> bool {
        match ask {
            Ask::IsHere { client } => {
                if let Some((holder, heard)) = &mut self.holder
                    && *holder == client
                {
                    *heard = Instant::now();
                }
                false
            }
            Ask::IsGone { client } => {
                if self.holder.is_some_and(|(holder, _)| holder == client) {
                    self.let_go(device);
                }
                true
            }
            Ask::Do { client, action, answer } => {
                let is_other = self.holder.is_some_and(|(holder, _)| holder != client);
                let done = match &action {
                    Action::Arm | Action::Disarm if is_other => {
                        Err("another page holds the lease: stop the device from here, or give it back there"
                            .to_owned())
                    }
                    _ => {
                        let moves = matches!(action, Action::Arm).then(|| (client, Instant::now()));
                        let is_lease = matches!(action, Action::Arm | Action::Disarm);
                        let done = action.run(device).map_err(|error| error.to_string());
                        if is_lease {
                            self.holder = moves.filter(|_| done.is_ok());
                        }
                        done
                    }
                };
                // The browser may be gone.
                let _ = answer.send(done);
                true
            }
        }
    }

    /// Ends motion when the browser that moves the device is gone, or somebody has taken the lease away.
    fn watch_holder(&mut self, device: &mut PageDevice) -> Result<(), ConnectError> {
        let Some((_, heard)) = self.holder else { return Ok(()) };
        if heard.elapsed() > SILENCE {
            self.let_go(device);
        } else if let Err(error) = device.renew_in_time() {
            match error {
                ConnectError::Line(_) => return Err(error),
                // A fault, or another client: it is not ours any more.
                _ => self.holder = None,
            }
        }
        Ok(())
    }

    fn let_go(&mut self, device: &mut PageDevice) {
        self.holder = None;
        // If it cannot be given back, it ends by itself.
        let _ = device.give_lease_back();
    }
}

/// The thread that takes every tick's signals.
fn tap(news: &Board, open: &OpenLine) {
    let mut number = 0;
    loop {
        let greeted = open().and_then(|line| Device::greet(line, PATIENCE));
        if let Ok(mut device) = greeted {
            let (mut tap, mut told) = (Tap::new(1), Vec::new());
            while let Ok(rows) = device.tap(&mut tap, PICTURE) {
                if told != tap.signals() {
                    number += 1;
                    tap.signals().clone_into(&mut told);
                    news.layout(number, &told);
                }
                news.rows(number, &rows);
            }
        }
        thread::sleep(PAUSE);
    }
}

/// The thread that stops the device.
fn stop(open: &OpenLine, stops: &Receiver<oneshot::Sender<Answer>>) {
    let mut device: Option<PageDevice> = None;
    for answer in stops {
        let mut done = Err("no line to the device".to_owned());
        // A line that has ended shows it only when it is used.
        for _ in 0..2 {
            if device.is_none() {
                match open().and_then(|line| Device::greet(line, PATIENCE)) {
                    Ok(greeted) => device = Some(greeted),
                    Err(error) => done = Err(error.to_string()),
                }
            }
            let Some(here) = &mut device else { break };
            match here.stop() {
                Ok(outcome) => {
                    done = Ok(Value::String(outcome.to_string()));
                    break;
                }
                Err(error) => {
                    done = Err(error.to_string());
                    device = None;
                }
            }
        }
        let _ = answer.send(done);
    }
}
