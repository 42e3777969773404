//! Shares a port: one program opens it and relays the frames of any number of clients.
//!
//! ```text
//! client ──▶ Turns ──▶ port      requests of all clients, one after another; STOP goes first
//! client ◀──────────── port      all clients receive all bytes, as on a shared line
//! ```
//! Clients find their answers by the ids of their requests; see [`protocol`](dimsart_link::protocol#clients). One client holds
//! the lease; every client can stop.

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
use hil_sim::pipe::{MAX_QUEUED_WRITES, Pipe, pair_with_capacities};
use turns::{Next, Turns};

/// Prefix of simulated ports, which `dimsart serve` provides.
pub const SIMULATED: &str = "sim:";
/// Maximum time to wait for the port before clients are polled again.
pub(crate) const PORT_WAIT: Duration = Duration::from_millis(1);
/// Timeout of a client's read.
const CLIENT_WAIT: Duration = Duration::from_millis(10);
/// Capacity of a client's queue, writes.
const CLIENT_ROOM: usize = 64;
/// Maximum bytes read from a client per round.
const ROUND_BYTES: usize = 4096;

/// Shares a port until it is dropped.
#[derive(Debug)]
pub struct Broker {
    newcomers: Option<Sender<Pipe>>,
    passing: Option<JoinHandle<()>>,
}

impl Broker {
    /// Shares an open port, whose read timeout is at most 2 ms.
    #[must_use]
    pub fn new(port: Box<dyn Stream>) -> Self {
        let (newcomers, arrivals) = channel();
        let passing = thread::spawn(move || Passing::new(port).run(&arrivals));
        Self { newcomers: Some(newcomers), passing: Some(passing) }
    }

    /// Returns a separate line to the device, closed with the port; none if the port is closed.
    #[must_use]
    pub fn join(&self) -> Option<Pipe> {
        let [client, here] =
            pair_with_capacities([CLIENT_WAIT, Duration::ZERO], [MAX_QUEUED_WRITES, CLIENT_ROOM]);
        self.newcomers.as_ref()?.send(here).is_ok().then_some(client)
    }
}

impl Drop for Broker {
    /// Closes the port before it returns, so that the next broker can open it.
    fn drop(&mut self) {
        drop(self.newcomers.take());
        // A panicked thread has also closed the port.
        let _ = self.passing.take().map(JoinHandle::join);
    }
}

/// A client of the broker.
#[derive(Debug)]
struct Client {
    number: u64,
    line: Pipe,
    frames: Frames,
}

/// Relays frames in a separate thread.
#[derive(Debug)]
struct Passing {
    port: Box<dyn Stream>,
    clients: Vec<Client>,
    turns: Turns,
    /// The frame being written.
    outgoing: Option<Outgoing>,
    answers: dimsart_link::protocol::Receiver,
    next: u64,
}

/// A partly written frame, and the number of written bytes.
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

    /// Runs until the port is closed or the broker dropped.
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

    /// Reads from every client, writes all urgent frames and at most one other frame, and reads from the port, each in bounded
    /// time. Returns false when the port is closed.
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

    /// Returns false when the port is closed. A busy port is retried in the next round, so that clients are still read.
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
                    // Drop it, as a device without room does, so that urgent frames do not wait.
                    self.outgoing.take_if(|outgoing| outgoing.taken == 0 && !outgoing.frame.is_urgent);
                    return true;
                }
                Err(_) => return false,
            }
        }
    }

    /// Returns false when the port is closed.
    fn hear_port(&mut self) -> bool {
        let mut buffer = [0; 1024];
        let count = match self.port.read(&mut buffer) {
            Ok(0) => return false,
            Ok(count) => count,
            Err(error) => return is_nothing_yet(error.kind()),
        };
        let bytes = buffer.get(..count).unwrap_or_default();
        for client in &mut self.clients {
            // A client that does not read loses bytes.
            let _ = client.line.write(bytes);
        }
        let turns = &mut self.turns;
        self.answers.push_all(bytes, |content| {
            if let Ok((id, _)) = decode_response(content) {
                turns.answered(id);
            }
        });
        true
    }
}

/// Extracts whole frames from a client's bytes, so that frames of two clients are not interleaved.
#[derive(Debug, Default)]
struct Frames {
    receiver: dimsart_link::protocol::Receiver,
    bytes: Vec<u8>,
}

impl Frames {
    /// Calls `on_frame` with every valid frame, including its two zeros, and its content.
    fn take(&mut self, bytes: &[u8], mut on_frame: impl FnMut(Vec<u8>, &[u8])) {
        for byte in bytes {
            let content = self.receiver.push(*byte);
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
