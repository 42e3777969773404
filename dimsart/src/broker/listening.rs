//! Accepts clients of other programs, up to a limit, and connects them to the broker.
//!
//! A new client is always accepted, since it may send STOP. At the limit of clients or open files, the client that has been
//! silent longest is disconnected; it reconnects when needed.

use std::fs::File;
use std::io::{self, ErrorKind, Read, Write};
use std::net::Shutdown;
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Weak};
use std::thread;
use std::time::Duration;

use super::accepting::{self, AcceptFailures};
use super::turns::is_stop;
use super::{Frames, is_nothing_yet};
use hil_sim::pipe::{Pipe, PipeReader, PipeWriter};

/// Maximum clients per port, well below the limit of open files.
const MAX_CLIENTS: usize = 64;
/// Write timeout of a client.
pub(super) const PATIENCE: Duration = Duration::from_secs(2);
/// Retry interval of a STOP.
const A_MOMENT: Duration = Duration::from_millis(1);

/// The listener of a port.
#[derive(Debug)]
pub(super) struct Listening {
    /// Name of the port, for reports.
    pub(super) port: String,
    pub(super) is_over: Arc<AtomicBool>,
}

impl Listening {
    /// Accepts clients until it is ended or `join` returns none. Continues after system errors.
    pub(super) fn run(
        &self,
        mut accept: impl FnMut() -> io::Result<UnixStream>,
        join: impl Fn() -> Option<Pipe>,
    ) {
        let (mut clients, mut failures) = (Clients::default(), AcceptFailures::default());
        let mut spare = spare_file();
        while !self.is_over.load(Ordering::Relaxed) {
            let done = match accept() {
                Ok(stream) => {
                    let line = if self.is_over.load(Ordering::Relaxed) { None } else { join() };
                    let Some(line) = line else { return };
                    if spare.is_some() {
                        failures.end();
                    }
                    let done = clients.add(stream, line);
                    spare = spare.or_else(spare_file);
                    done
                }
                Err(error) => Err(error),
            };
            let Err(error) = done else { continue };
            if let Some(report) = failures.report(&self.port, &error) {
                eprintln!("dimsart: {report}");
            }
            // Frees its descriptor for the next client.
            if spare.take().is_none() {
                clients.close_most_silent();
                thread::sleep(accepting::PAUSE);
            }
        }
    }
}

/// A spare descriptor, closed to accept a client at the limit of open files.
fn spare_file() -> Option<File> {
    File::open("/dev/null").ok()
}

/// Connected clients.
#[derive(Debug, Default)]
struct Clients {
    connected: Vec<Weak<Connection>>,
    /// Counts reads of all clients.
    heard: Arc<AtomicU64>,
}

#[derive(Debug)]
struct Connection {
    stream: UnixStream,
    /// Count at this client's last read.
    heard: AtomicU64,
    all: Arc<AtomicU64>,
}

impl Connection {
    fn hear(&self) {
        self.heard.store(self.all.fetch_add(1, Ordering::Relaxed), Ordering::Relaxed);
    }
}

impl Clients {
    fn add(&mut self, stream: UnixStream, line: Pipe) -> io::Result<()> {
        stream.set_write_timeout(Some(PATIENCE))?;
        self.connected.retain(|client| client.strong_count() > 0);
        if self.connected.len() >= MAX_CLIENTS {
            self.close_most_silent();
        }
        let connection = Connection { stream, heard: AtomicU64::new(0), all: Arc::clone(&self.heard) };
        let (connection, Pipe { writer, reader }) = (Arc::new(connection), line);
        connection.hear();
        self.connected.push(Arc::downgrade(&connection));
        let other_way = Arc::clone(&connection);
        thread::Builder::new().spawn(move || from_client(&connection, writer))?;
        thread::Builder::new().spawn(move || to_client(&other_way, reader))?;
        Ok(())
    }

    fn close_most_silent(&mut self) {
        let connected = self.connected.iter().enumerate();
        let alive = connected.filter_map(|(place, client)| Some((place, client.upgrade()?)));
        if let Some((place, client)) = alive.min_by_key(|(_, client)| client.heard.load(Ordering::Relaxed)) {
            let _ = client.stream.shutdown(Shutdown::Both);
            self.connected.swap_remove(place);
        }
    }
}

/// Relays whole frames. Frames are dropped while the broker's queue is full, except STOP.
fn from_client(client: &Connection, mut line: PipeWriter) {
    let (mut frames, mut buffer, mut is_over) = (Frames::default(), [0; 1024], false);
    while let Ok(count @ 1..) = (&client.stream).read(&mut buffer) {
        client.hear();
        frames.take(buffer.get(..count).unwrap_or_default(), |frame, content| {
            while let Err(error) = line.write(&frame) {
                is_over |= error.kind() == ErrorKind::BrokenPipe;
                if is_over || !is_stop(content) {
                    break;
                }
                thread::sleep(A_MOMENT);
            }
        });
        if is_over {
            break;
        }
    }
}

fn to_client(client: &Connection, mut line: PipeReader) {
    let mut buffer = [0; 4096];
    loop {
        let count = match line.read(&mut buffer) {
            Ok(0) => break,
            Ok(count) => count,
            Err(error) if is_nothing_yet(error.kind()) => continue,
            Err(_) => break,
        };
        if (&client.stream).write_all(buffer.get(..count).unwrap_or_default()).is_err() {
            break;
        }
    }
    // Ends the other direction, too.
    let _ = client.stream.shutdown(Shutdown::Both);
}

#[cfg(test)]
mod tests {
    use super::*;
    use dimsart_core::Command;
    use dimsart_link::protocol::{MAX_FRAME_BYTES, Receiver, Request, encode_request};
    use hil_sim::pipe::pair;

    fn listening() -> Listening {
        Listening { port: "sim:test".to_owned(), is_over: Arc::default() }
    }

    fn frame(id: u16, request: Request) -> Vec<u8> {
        encode_request(&request, id, &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec()
    }

    #[test]
    fn errors_of_the_system_end_no_listener_and_let_the_next_client_in() {
        let listening = listening();
        let (mut attempts, mut peers, joined) = (0, Vec::new(), std::cell::RefCell::new(Vec::new()));
        let accept = || {
            attempts += 1;
            match attempts {
                // EMFILE, twice: the spare file, then the most silent client.
                1 | 3 | 4 => Err(io::Error::from_raw_os_error(24)),
                2 | 5 => {
                    let (near, far) = UnixStream::pair()?;
                    peers.push(near);
                    Ok(far)
                }
                _ => {
                    listening.is_over.store(true, Ordering::Relaxed);
                    Err(ErrorKind::Interrupted.into())
                }
            }
        };
        listening.run(accept, || {
            let [client, here] = pair([Duration::from_millis(1); 2]);
            joined.borrow_mut().push(here);
            Some(client)
        });
        assert_eq!(joined.borrow().len(), 2);
    }

    #[test]
    fn an_episode_of_too_many_open_files_is_reported_once() {
        let (mut failures, error) = (AcceptFailures::default(), io::Error::from_raw_os_error(24));
        assert!(failures.report("page", &error).unwrap().contains("Too many open files"));
        assert_eq!(failures.report("page", &error), None);
        failures.end();
        assert!(failures.report("page", &error).is_some());
        assert_eq!(AcceptFailures::default().report("page", &ErrorKind::ConnectionAborted.into()), None);
    }

    #[test]
    fn beyond_the_limit_the_most_silent_client_is_closed_and_the_newcomer_is_heard() {
        let (mut clients, mut lines, mut peers) = (Clients::default(), Vec::new(), Vec::new());
        for _ in 0..MAX_CLIENTS + 1 {
            let ((near, far), [line, here]) =
                (UnixStream::pair().unwrap(), pair([Duration::from_secs(9); 2]));
            clients.add(far, line).unwrap();
            lines.push(here);
            peers.push(near);
        }
        assert_eq!(clients.connected.len(), MAX_CLIENTS);
        assert_eq!(peers[0].read(&mut [0]).unwrap(), 0, "the first one is closed");
        let stop = frame(7, Request::Command(Command::Stop));
        peers[MAX_CLIENTS].write_all(&stop).unwrap();
        let mut buffer = [0; 1024];
        let count = lines[MAX_CLIENTS].read(&mut buffer).unwrap();
        assert!(count >= stop.len());
    }

    #[test]
    fn a_stop_behind_a_flood_of_the_same_client_is_passed_on_and_the_flood_is_not_kept() {
        let (near, far) = UnixStream::pair().unwrap();
        let [line, mut here] = hil_sim::pipe::pair_with_capacities([Duration::from_secs(9); 2], [1, 4]);
        let client = Connection { stream: far, heard: AtomicU64::new(0), all: Arc::default() };
        thread::scope(|scope| {
            scope.spawn(move || {
                let flood = frame(1, Request::Status).repeat(20_000);
                (&near).write_all(&flood).unwrap();
                (&near).write_all(&frame(2, Request::Command(Command::Stop))).unwrap();
                near.shutdown(Shutdown::Write).unwrap();
            });
            scope.spawn(|| from_client(&client, line.writer));
            let (mut receiver, mut buffer, mut stops) = (Receiver::new(), [0; 1024], 0);
            while let Ok(count @ 1..) = here.read(&mut buffer) {
                receiver.push_all(&buffer[..count], |content| stops += usize::from(is_stop(content)));
            }
            assert_eq!(stops, 1);
        });
    }
}
