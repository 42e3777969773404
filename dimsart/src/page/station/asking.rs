//! What browsers want to be done, one after another, and the lease of the one that moves the device.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::thread;
use std::time::{Duration, Instant};

use serde::Serialize;
use tokio::sync::oneshot;

use super::super::action::Action;
use super::super::news::Board;
use super::{Answer, Hand, OpenLine, PAUSE, PageDevice, greet};
use crate::connect::{ConnectError, LiveReport};

/// Longest wait for something to do before the device is looked at again.
const A_MOMENT: Duration = Duration::from_millis(15);
/// From one look at how the device is doing to the next.
const LOOK: Duration = Duration::from_millis(100);
/// A client that holds the lease and says nothing for so long is gone.
const SILENCE: Duration = Duration::from_millis(500);

/// What a browser has for the thread.
#[derive(Debug)]
pub(super) enum Ask {
    Do { client: u64, action: Action, answer: oneshot::Sender<Answer> },
    IsHere { client: u64 },
    IsGone { client: u64 },
}

/// How a device is doing.
#[derive(Serialize)]
struct Status {
    live: LiveReport,
    /// Whether this page moves it.
    is_held_here: bool,
}

/// Why motion has ended.
#[derive(Serialize)]
struct Lost<'a> {
    number: u32,
    reason: &'a str,
}

/// The thread.
pub(super) struct Asking {
    news: Arc<Board>,
    open: Arc<OpenLine>,
    /// Wakes who looks at the scheme.
    looked: Sender<()>,
    /// The client that holds the lease, and when it was heard last.
    holder: Option<(u64, Instant)>,
    hand: Option<Hand>,
    is_exclusive: bool,
    /// References that browsers hold by it.
    held: Vec<(u64, String, usize)>,
    /// How often motion has ended without being told to.
    losses: u32,
}

impl Asking {
    pub(super) fn new(
        news: Arc<Board>,
        open: Arc<OpenLine>,
        looked: Sender<()>,
        hand: Option<Hand>,
        is_exclusive: bool,
    ) -> Self {
        Self { news, open, looked, holder: None, hand, is_exclusive, held: Vec::new(), losses: 0 }
    }

    pub(super) fn run(mut self, asks: &Receiver<Ask>) {
        loop {
            let ended = match greet(&self.open) {
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
                    refuse(asks, &error);
                }
            }
            self.holder = None;
            thread::sleep(PAUSE);
        }
    }

    /// Until the line ends, or the page does.
    fn serve(&mut self, device: &mut PageDevice, asks: &Receiver<Ask>) -> Result<(), ConnectError> {
        let mut looked: Option<Instant> = None;
        loop {
            if looked.is_none_or(|looked| looked.elapsed() > LOOK) {
                let live = device.live()?;
                self.news.tell("status", &Status { live, is_held_here: self.holder.is_some() });
                looked = Some(Instant::now());
            }
            match asks.recv_timeout(A_MOMENT) {
                Ok(ask) => {
                    if self.take(device, ask) {
                        looked = None;
                        // It ends with the page alone.
                        let _ = self.looked.send(());
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
                self.hear(client);
                false
            }
            Ask::IsGone { client } => {
                let (gone, held) = self.held.drain(..).partition(|(holder, ..)| *holder == client);
                self.held = held;
                for ((_, signal, axis), hand) in Vec::into_iter(gone).zip(self.hand.iter().cycle()) {
                    hand(signal, axis, None);
                }
                if self.holder.is_some_and(|(holder, _)| holder == client) {
                    self.let_go(device);
                }
                true
            }
            Ask::Do { client, action, answer } => {
                if let Action::Hold { signal, axis, value } = &action {
                    self.held.retain(|(_, held, at)| (held, at) != (signal, axis));
                    self.held.extend(value.iter().map(|_| (client, signal.clone(), *axis)));
                }
                let is_other = self.holder.is_some_and(|(holder, _)| holder != client);
                let is_lease = matches!(action, Action::Arm | Action::Disarm | Action::Renew);
                let done = match &action {
                    _ if is_other && (is_lease || self.is_exclusive && action.changes()) => {
                        Err("another client holds the lease: stop the device, or have it give it back"
                            .to_owned())
                    }
                    Action::Renew if self.holder.is_none() => {
                        Err("the lease is over: `arm` takes it anew".to_owned())
                    }
                    _ => {
                        let moves = matches!(action, Action::Arm).then(|| (client, Instant::now()));
                        let is_other_then = matches!(action, Action::Arm | Action::Disarm);
                        let done = action.run(device, self.hand.as_ref()).map_err(|error| error.to_string());
                        if is_other_then {
                            self.holder = moves.filter(|_| done.is_ok());
                        }
                        // What has taken long kept it from being heard.
                        self.hear(client);
                        done
                    }
                };
                // The browser may be gone.
                let _ = answer.send(done);
                true
            }
        }
    }

    fn hear(&mut self, client: u64) {
        if let Some((holder, heard)) = &mut self.holder
            && *holder == client
        {
            *heard = Instant::now();
        }
    }

    /// Ends motion when the client that moves the device is gone, or somebody has taken the lease away.
    fn watch_holder(&mut self, device: &mut PageDevice) -> Result<(), ConnectError> {
        let Some((_, heard)) = self.holder else { return Ok(()) };
        if heard.elapsed() > SILENCE {
            self.let_go(device);
            self.tell_lost(
                "the client that moved the device said nothing for half a second: the device is at rest",
            );
        } else if let Err(error) = device.renew_in_time() {
            match error {
                ConnectError::Line(_) => return Err(error),
                // A fault, another client, or this computer was too busy to renew it: it is not ours any more.
                _ => {
                    self.holder = None;
                    self.tell_lost(&format!("the lease is lost: {error}"));
                }
            }
        }
        Ok(())
    }

    /// Says why motion has ended, each time anew.
    fn tell_lost(&mut self, reason: &str) {
        self.losses += 1;
        self.news.tell("lost", &Lost { number: self.losses, reason });
    }

    fn let_go(&mut self, device: &mut PageDevice) {
        self.holder = None;
        // If it cannot be given back, it ends by itself.
        let _ = device.give_lease_back();
    }
}

/// Refuses what waits: when the line is there again, nobody may want it any more.
fn refuse(asks: &Receiver<Ask>, error: &ConnectError) {
    for ask in asks.try_iter() {
        if let Ask::Do { answer, .. } = ask {
            let _ = answer.send(Err(error.to_string()));
        }
    }
}
