//! A port shared by several programs of one user.
//!
//! The first program that opens the port becomes its broker. Others connect to a socket in the user's private folder; when the
//! broker ends, one of them becomes the new broker. The broker holds a lock, which is released with its process.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use super::listening::{Listening, PATIENCE};
use super::place::Place;
use super::{Broker, CLIENT_WAIT, PORT_WAIT, SIMULATED};
use hil_sim::link::{PortError, Stream, open_with_timeout};
use hil_sim::pipe::Pipe;

pub use super::place::{private_folder, shared_ports};

/// Maximum time from the lock to listening.
const START: Duration = Duration::from_secs(1);
/// Retry interval.
const A_MOMENT: Duration = Duration::from_millis(10);

/// Opens a shared port: a serial port by name, `tcp:HOST:PORT`, `unix:PATH`, or a simulated controller of `dimsart serve`,
/// `sim:NAME`. `baud` applies to the first program that opens the port.
///
/// # Errors
/// As [`open_port`](hil_sim::link::open_port), and [`PortError::ServerNotFound`].
pub fn open(port: &str, baud: u32) -> Result<Box<dyn Stream>, PortError> {
    let end = End::open(port, baud)?;
    Ok(Box::new(SharedLine { port: port.to_owned(), baud, end }))
}

/// A port opened by this program and shared with others until it is dropped.
#[derive(Debug)]
pub struct SharedPort {
    socket: PathBuf,
    is_over: Arc<AtomicBool>,
    listener: Option<JoinHandle<()>>,
    broker: Arc<Broker>,
    /// Released last, so that no other program opens the port before.
    _lock: File,
}

impl SharedPort {
    /// Shares a stream under the name `port`, for [`open`]. The stream's read timeout is at most 2 ms.
    ///
    /// # Errors
    /// [`PortError::Served`] if another program already shares it; [`PortError::Shared`] if it cannot be shared.
    pub fn new(port: &str, stream: Box<dyn Stream>) -> Result<Self, PortError> {
        let failed = |source| PortError::Shared { port: port.to_owned(), source };
        let place = Place::of(port).map_err(failed)?;
        let lock = place.lock().map_err(failed)?;
        let lock = lock.ok_or_else(|| PortError::Served { port: port.to_owned() })?;
        Self::listen(port, Broker::new(stream), &place, lock).map_err(failed)
    }

    /// Returns a separate line; none if the port is closed.
    #[must_use]
    pub fn join(&self) -> Option<Pipe> {
        self.broker.join()
    }

    fn listen(port: &str, broker: Broker, place: &Place, lock: File) -> io::Result<Self> {
        place.write_name(&lock)?;
        let socket = place.socket();
        match fs::remove_file(&socket) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let listener = UnixListener::bind(&socket)?;
        let (is_over, broker) = (Arc::new(AtomicBool::new(false)), Arc::new(broker));
        let listening = Listening { port: port.to_owned(), is_over: Arc::clone(&is_over) };
        let joined = Arc::clone(&broker);
        let listener = thread::Builder::new().spawn(move || {
            listening.run(|| listener.accept().map(|(stream, _)| stream), || joined.join());
        })?;
        Ok(Self { socket, is_over, listener: Some(listener), broker, _lock: lock })
    }
}

impl Drop for SharedPort {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        // Wakes the listener; an unreachable listener has ended.
        if UnixStream::connect(&self.socket).is_ok() {
            let _ = self.listener.take().map(JoinHandle::join);
        }
        // The next broker removes a remaining file.
        let _ = fs::remove_file(&self.socket);
    }
}

/// A line over a shared port, of this or another program.
#[derive(Debug)]
struct SharedLine {
    port: String,
    baud: u32,
    end: End,
}

#[derive(Debug)]
enum End {
    /// This program is the broker.
    Here { line: Pipe, _port: SharedPort },
    /// Another program is the broker.
    There(UnixStream),
}

impl SharedLine {
    /// Returns the result of a read or write; if the broker ended, connects to a new one or becomes it.
    fn go_on(&mut self, result: io::Result<usize>, is_end: impl Fn(usize) -> bool) -> io::Result<usize> {
        let is_over = match &result {
            Ok(count) => is_end(*count),
            Err(error) => matches!(error.kind(), ErrorKind::BrokenPipe | ErrorKind::ConnectionReset),
        };
        if !is_over || matches!(self.end, End::Here { .. }) {
            return result;
        }
        match End::open(&self.port, self.baud) {
            Ok(end) => {
                self.end = end;
                Err(ErrorKind::WouldBlock.into())
            }
            Err(_) => result,
        }
    }
}

impl Read for SharedLine {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let result = match &mut self.end {
            End::Here { line, .. } => line.read(buffer),
            End::There(stream) => stream.read(buffer),
        };
        self.go_on(result, |count| count == 0)
    }
}

impl Write for SharedLine {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let result = match &mut self.end {
            End::Here { line, .. } => line.write(bytes),
            End::There(stream) => stream.write(bytes),
        };
        self.go_on(result, |_| false)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl End {
    fn open(port: &str, baud: u32) -> Result<Self, PortError> {
        let failed = |source| PortError::Shared { port: port.to_owned(), source };
        let place = Place::of(port).map_err(failed)?;
        let deadline = Instant::now() + START;
        loop {
            if let Some(lock) = place.lock().map_err(failed)? {
                if port.starts_with(SIMULATED) {
                    return Err(PortError::ServerNotFound { port: port.to_owned() });
                }
                let broker = Broker::new(open_with_timeout(port, baud, PORT_WAIT)?);
                let port = SharedPort::listen(port, broker, &place, lock).map_err(failed)?;
                let line = port.join().ok_or_else(|| failed(ErrorKind::BrokenPipe.into()))?;
                return Ok(Self::Here { line, _port: port });
            }
            match place.connect() {
                Ok(stream) => {
                    stream.set_read_timeout(Some(CLIENT_WAIT)).map_err(failed)?;
                    stream.set_write_timeout(Some(PATIENCE)).map_err(failed)?;
                    return Ok(Self::There(stream));
                }
                Err(error) if error.kind() == ErrorKind::InvalidData || Instant::now() > deadline => {
                    return Err(failed(error));
                }
                Err(_) => thread::sleep(A_MOMENT),
            }
        }
    }
}
