//! A controller as the page has it: four lines to it, each with a thread, so that none waits for another one.
//!
//! ```text
//! asking    what browsers want to be done, and the lease
//! looking   the whole scheme, faults and events
//! tapping   the signals of every tick
//! stopping  STOP alone
//! ```

mod asking;
mod looking;
mod stopping;
mod tapping;

use std::io;
use std::sync::Arc;
use std::sync::mpsc::{Sender, channel};
use std::thread;
use std::time::Duration;

use serde_json::Value;
use tokio::sync::oneshot;

use super::action::Action;
use super::news::Board;
use crate::connect::{ConnectError, Device, Patience};
use asking::{Ask, Asking};
use hil_sim::link::Stream;
use looking::look;
use stopping::stop;
use tapping::tap;

/// A controller at the other end of a line, of whatever kind.
pub(super) type PageDevice = Device<Box<dyn Stream>>;
/// Makes a line to the controller.
pub type OpenLine = Box<dyn Fn() -> Result<Box<dyn Stream>, ConnectError> + Send + Sync>;

/// Holds a reference of a simulated device: its name, the axis, and where; or lets it go.
pub type Hand = Box<dyn Fn(String, usize, Option<f32>) + Send>;

/// How a controller is reached.
pub struct Access {
    /// Opens a line to it.
    pub open: OpenLine,
    /// Ticks from one row of signals to the next, as its line can carry them.
    pub every_ticks: u32,
    /// What a simulated one has.
    pub hand: Option<Hand>,
    /// Whether, while a client moves it, others look and stop alone.
    pub is_exclusive: bool,
}

const PATIENCE: Patience = Patience { timeout: Duration::from_millis(300), tries: 4 };
/// Before a line that has ended is opened again.
const PAUSE: Duration = Duration::from_millis(500);

/// A controller on the page.
#[derive(Debug)]
pub struct Station {
    name: String,
    asking: Sender<Ask>,
    stopping: Sender<oneshot::Sender<Answer>>,
    board: Arc<Board>,
}

/// What an action came to: its result, or why it was refused.
pub(crate) type Answer = Result<Value, String>;

impl Station {
    /// The `number`th controller of a page, by a name. Lines to it are opened again when they end.
    ///
    /// # Errors
    /// Whatever the system says when there is no thread left.
    pub fn new(number: u8, name: &str, access: Access) -> io::Result<Self> {
        let Access { open, every_ticks, hand, is_exclusive } = access;
        let (asking, asks) = channel();
        let (stopping, stops) = channel();
        let (board, open) = (Arc::new(Board::new(number)), Arc::new(open));
        let start = |what: &str, run: Box<dyn FnOnce() + Send>| {
            thread::Builder::new().name(format!("{name} {what}")).spawn(run).map(drop)
        };
        let (looked, wakes) = channel();
        let (news, line) = (Arc::clone(&board), Arc::clone(&open));
        start("asking", Box::new(move || Asking::new(news, line, looked, hand, is_exclusive).run(&asks)))?;
        let (news, line) = (Arc::clone(&board), Arc::clone(&open));
        start("looking", Box::new(move || look(&news, &line, &wakes)))?;
        let (news, line) = (Arc::clone(&board), Arc::clone(&open));
        start("tapping", Box::new(move || tap(&news, &line, every_ticks)))?;
        start("stopping", Box::new(move || stop(&open, &stops)))?;
        Ok(Self { name: name.to_owned(), asking, stopping, board })
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    pub(crate) fn board(&self) -> &Board {
        &self.board
    }

    /// Does something for a browser; what came of it.
    pub(crate) fn ask(&self, client: u64, action: Action) -> oneshot::Receiver<Answer> {
        let (answer, answered) = oneshot::channel();
        // Where the thread is gone, the answer never comes.
        let _ = self.asking.send(Ask::Do { client, action, answer });
        answered
    }

    /// Stops the device, whoever says so.
    pub(crate) fn stop(&self) -> oneshot::Receiver<Answer> {
        let (answer, answered) = oneshot::channel();
        let _ = self.stopping.send(answer);
        answered
    }

    /// A browser is there, or has gone.
    pub(crate) fn hear(&self, client: u64, is_here: bool) {
        let _ = self.asking.send(if is_here { Ask::IsHere { client } } else { Ask::IsGone { client } });
    }
}

/// Opens a line and finds out who is there.
fn greet(open: &OpenLine) -> Result<PageDevice, ConnectError> {
    Device::greet(open()?, PATIENCE)
}
