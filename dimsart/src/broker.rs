//! One program has a port, and passes on what any number of clients say over it.
//!
//! ```text
//! client ──▶ Turns ──▶ port      requests of all clients, one after another; STOP goes first
//! client ◀──────────── port      everybody hears everything, as on a line that they share
//! ```
//! The clients tell their answers by the ids of their requests; see [`protocol`](dimsart_link::protocol#clients). So a
//! lease is still one client's, and stopping everybody's.

pub(crate) mod accepting;
#[cfg(unix)]
mod listening;
#[cfg(unix)]
mod place;
#[cfg_attr(not(unix), path = "broker/alone.rs")]
mod shared_port;
#[cfg(test)]
mod tests;
mod turns;

use std::io::{ErrorKind, Read, Write};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use dimsart_link::protocol::{MAX_FRAME_BYTES, decode_response};

pub use shared_port::{SharedPort, open, private_folder, shared_ports};

use hil_sim::link::Stream;
use hil_sim::pipe::{Pipe, ROOM, pair_with_rooms};
use turns::{Next, Turns};

/// What names of ports begin with that a `dimsart serve` has simulated.
pub const SIMULATED: &str = "sim:";
/// Longest time that the port is waited for before clients are heard again.
pub(crate) const PORT_WAIT: Duration = Duration::from_millis(1);
/// Longest time that a client waits for bytes in one read.
const CLIENT_WAIT: Duration = Duration::from_millis(10);
/// Writes of a client that wait to be heard.
const CLIENT_ROOM: usize = 64;
/// Bytes of a client that are heard in a round; more wait for the next one.
const ROUND_BYTES: usize = 4096;

/// A port that is shared, as long as this lives.
#[derive(Debug)]
pub struct Broker {
    newcomers: Option<Sender<Pipe>>,
    passing: Option<JoinHandle<()>>,
}

impl Broker {
    /// Passes on what goes over an open port, whose reads wait no longer than a millisecond or two.
    #[must_use]
    pub fn new(port: Box<dyn Stream>) -> Self {
        let (newcomers, arrivals) = channel();
        let passing = thread::spawn(move || Passing::new(port).run(&arrivals));
        Self { newcomers: Some(newcomers), passing: Some(passing) }
    }

    /// A line of one's own to the device, which ends when the port does; none when it has.
    #[must_use]
    pub fn join(&self) -> Option<Pipe> {
        let [client, here] = pair_with_rooms([CLIENT_WAIT, Duration::ZERO], [ROOM, CLIENT_ROOM]);
        self.newcomers.as_ref()?.send(here).is_ok().then_some(client)
    }
}

impl Drop for Broker {
    /// Closes the port before it is over: then the next one can open it.
    fn drop(&mut self) {
        drop(self.newcomers.take());
        // A thread that has panicked has closed it, too.
        let _ = self.passing.take().map(JoinHandle::join);
    }
}

/// A client as the broker sees it.
#[derive(Debug)]
struct Client {
    number: u64,
    line: Pipe,
    frames: Frames,
}

/// Passes on, in a thread of its own.
#[derive(Debug)]
struct Passing {
    port: Box<dyn Stream>,
    clients: Vec<Client>,
    turns: Turns,
    /// The frame that the port is taking.
    outgoing: Option<Outgoing>,
    answers: dimsart_link::protocol::Receiver,
    next: u64,
}

/// A frame on its way, and how many of its bytes the port has taken.
#[derive(Debug)]
struct Outgoing {
    frame: Next,
    taken: usize,
}

impl Passing {
    fn new(port: Box<dyn Stream>) -> Self {
        let answers = dimsart_link::protocol::Receiver::new();
        Self { port, clients: Vec::new(), turns: Turns::default(), outgoing: None, answers, next: 0 }
    }

    /// Until the port or the broker is gone.
    fn run(mut self, arrivals: &Receiver<Pipe>) {
        loop {
            loop {
                match arrivals.try_recv() {
                    Ok(line) => self.welcome(line),
                    Err(TryRecvError::Empty) => break,
                    Err(TryRecvError::Disconnected) => return,
                }
            }
            if !self.round(Instant::now()) {
                return;
            }
        }
    }

    fn welcome(&mut self, line: Pipe) {
        self.clients.push(Client { number: self.next, line, frames: Frames::default() });
        self.next += 1;
    }

    /// Hears every client, writes all urgent frames and at most one other frame, and hears the port: each in bounded time,
    /// whatever the others do. False when the port is gone.
    fn round(&mut self, now: Instant) -> bool {
        self.hear_clients();
        self.write_port(now) && self.hear_port()
    }

    fn hear_clients(&mut self) {
        let Self { clients, turns, .. } = self;
        let mut buffer = [0; 1024];
        clients.retain_mut(|Client { number, line, frames }| {
            let mut heard = 0;
            while heard < ROUND_BYTES {
                match line.read(&mut buffer) {
                    Ok(count @ 1..) => {
                        heard += count;
                        let bytes = buffer.get(..count).unwrap_or_default();
                        frames.take(bytes, |frame, content| turns.add(*number, frame, content));
                    }
                    Err(error) if is_nothing_yet(error.kind()) => return true,
                    _ => {
                        turns.forget(*number);
                        return false;
                    }
                }
            }
            true
        });
    }

    /// False when the port is gone. A port that takes no bytes is tried again in the next round: clients are heard meanwhile.
    fn write_port(&mut self, now: Instant) -> bool {
        loop {
            let outgoing = match &mut self.outgoing {
                Some(outgoing) => outgoing,
                None => match self.turns.next(now) {
                    Some(frame) => self.outgoing.insert(Outgoing { frame, taken: 0 }),
                    None => return true,
                },
            };
            let rest = outgoing.frame.bytes.get(outgoing.taken..).unwrap_or_default();
            match self.port.write(rest) {
                Ok(0) => return false,
                Ok(count) if count < rest.len() => outgoing.taken += count,
                Ok(_) => {
                    let was_urgent = outgoing.frame.is_urgent;
                    self.outgoing = None;
                    if !was_urgent {
                        return true;
                    }
                }
                Err(error) if is_nothing_yet(error.kind()) => {
                    // Lost, as by a device without room: an urgent frame is not kept waiting by it.
                    self.outgoing.take_if(|outgoing| outgoing.taken == 0 && !outgoing.frame.is_urgent);
                    return true;
                }
                Err(_) => return false,
            }
        }
    }

    /// False when the port is gone.
    fn hear_port(&mut self) -> bool {
        let mut buffer = [0; 1024];
        let count = match self.port.read(&mut buffer) {
            Ok(0) => return false,
            Ok(count) => count,
            Err(error) => return is_nothing_yet(error.kind()),
        };
        let bytes = buffer.get(..count).unwrap_or_default();
        for client in &mut self.clients {
            // Who does not read loses it, as on a line without room.
            let _ = client.line.write(bytes);
        }
        let turns = &mut self.turns;
        self.answers.take_all(bytes, |content| {
            if let Ok((id, _)) = decode_response(content) {
                turns.answered(id);
            }
        });
        true
    }
}

/// Takes the frames out of what a client writes, for two of them must not go over the port mixed up.
#[derive(Debug, Default)]
struct Frames {
    receiver: dimsart_link::protocol::Receiver,
    bytes: Vec<u8>,
}

impl Frames {
    /// `on_frame` gets every good frame, as it stands between two zeros, and its content.
    fn take(&mut self, bytes: &[u8], mut on_frame: impl FnMut(Vec<u8>, &[u8])) {
        for byte in bytes {
            let content = self.receiver.take(*byte);
            if *byte == 0 {
                let frame = [&[0], std::mem::take(&mut self.bytes).as_slice(), &[0]].concat();
                if let Some(content) = content {
                    on_frame(frame, content);
                }
            } else if self.bytes.len() < MAX_FRAME_BYTES {
                self.bytes.push(*byte);
            }
        }
    }
}

fn is_nothing_yet(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)
}
