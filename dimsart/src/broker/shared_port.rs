//! A port that several programs of one user share.
//!
//! Whoever opens it first is its broker. Others find it by a socket in a folder that is this user's alone, and when it ends
//! one of them becomes the broker. A lock says whether there is one: it goes with the process that has it.

use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind, Read, Write};
use std::net::Shutdown;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use super::{Broker, CLIENT_WAIT, PORT_WAIT, SIMULATED};
use hil_sim::link::{PortError, Stream, open_waiting};
use hil_sim::pipe::{Pipe, PipeReader, PipeWriter};

/// Longest time that a program which has the lock takes until it listens.
const START: Duration = Duration::from_secs(1);
/// Between two looks for it.
const A_MOMENT: Duration = Duration::from_millis(10);
/// A client that takes nothing for so long is left.
const PATIENCE: Duration = Duration::from_secs(2);
/// Longest name of a socket's file: the system's paths of sockets are short.
const LONGEST_NAME: usize = 48;

/// Opens a port that others may use at the same time: a serial port by its name, `tcp:HOST:PORT` or `unix:PATH`, or a
/// simulated controller that a `dimsart serve` has, `sim:NAME`. `baud` counts for whoever opens it first.
///
/// # Errors
/// As [`open_port`](hil_sim::link::open_port), and [`PortError::NotServed`].
pub fn open(port: &str, baud: u32) -> Result<Box<dyn Stream>, PortError> {
    let end = End::open(port, baud)?;
    Ok(Box::new(SharedLine { port: port.to_owned(), baud, end }))
}

/// A port that this program has, and others may join, for as long as this lives.
#[derive(Debug)]
pub struct SharedPort {
    socket: PathBuf,
    is_over: Arc<AtomicBool>,
    listener: Option<JoinHandle<()>>,
    broker: Arc<Broker>,
    /// Given back last: until then nobody else opens the port.
    _lock: File,
}

impl SharedPort {
    /// Shares what is at the other end of a stream as `port`, a name that [`open`] is given. A read of the stream waits no
    /// longer than a millisecond or two.
    ///
    /// # Errors
    /// [`PortError::Served`] when another program shares it already; [`PortError::Shared`] when it cannot be shared.
    pub fn new(port: &str, stream: Box<dyn Stream>) -> Result<Self, PortError> {
        let failed = |source| PortError::Shared { port: port.to_owned(), source };
        let place = place_of(port).map_err(failed)?;
        let lock = lock(&place).map_err(failed)?;
        let lock = lock.ok_or_else(|| PortError::Served { port: port.to_owned() })?;
        Self::listen(port, Broker::new(stream), place, lock).map_err(failed)
    }

    /// A line of one's own; none when the port is gone.
    #[must_use]
    pub fn join(&self) -> Option<Pipe> {
        self.broker.join()
    }

    fn listen(port: &str, broker: Broker, place: PathBuf, mut lock: File) -> io::Result<Self> {
        // For who asks what there is: the names of files are not those of ports.
        lock.set_len(0)?;
        lock.write_all(port.as_bytes())?;
        let socket = place.with_extension("sock");
        match fs::remove_file(&socket) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let listener = UnixListener::bind(&socket)?;
        let (is_over, broker) = (Arc::new(AtomicBool::new(false)), Arc::new(broker));
        let (flag, joined) = (Arc::clone(&is_over), Arc::clone(&broker));
        let listener = thread::spawn(move || {
            for stream in listener.incoming().map_while(Result::ok) {
                let line = if flag.load(Ordering::Relaxed) { None } else { joined.join() };
                let Some(Pipe { writer, reader }) = line else { return };
                // A client that cannot be served sees the end of its line.
                let Ok(out) = stream.try_clone() else { continue };
                thread::spawn(move || from_client(stream, writer));
                thread::spawn(move || to_client(out, reader));
            }
        });
        Ok(Self { socket, is_over, listener: Some(listener), broker, _lock: lock })
    }
}

impl Drop for SharedPort {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        // Wakes the listener. Where it cannot be reached, it has ended.
        if UnixStream::connect(&self.socket).is_ok() {
            let _ = self.listener.take().map(JoinHandle::join);
        }
        // A file that stays is taken away by the next broker.
        let _ = fs::remove_file(&self.socket);
    }
}

/// A line over a port that is shared, whoever has it.
#[derive(Debug)]
struct SharedLine {
    port: String,
    baud: u32,
    end: End,
}

#[derive(Debug)]
enum End {
    /// This program has the port.
    Here { line: Pipe, _port: SharedPort },
    /// Another one has it.
    There(UnixStream),
}

impl SharedLine {
    /// What a read or write came to; where the broker ended, another one is found or made before the next.
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
        let place = place_of(port).map_err(failed)?;
        let deadline = Instant::now() + START;
        loop {
            if let Some(lock) = lock(&place).map_err(failed)? {
                if port.starts_with(SIMULATED) {
                    return Err(PortError::NotServed { port: port.to_owned() });
                }
                let broker = Broker::new(open_waiting(port, baud, PORT_WAIT)?);
                let port = SharedPort::listen(port, broker, place, lock).map_err(failed)?;
                let line = port.join().ok_or_else(|| failed(ErrorKind::BrokenPipe.into()))?;
                return Ok(Self::Here { line, _port: port });
            }
            match UnixStream::connect(place.with_extension("sock")) {
                Ok(stream) => {
                    stream.set_read_timeout(Some(CLIENT_WAIT)).map_err(failed)?;
                    stream.set_write_timeout(Some(PATIENCE)).map_err(failed)?;
                    return Ok(Self::There(stream));
                }
                Err(error) if Instant::now() > deadline => return Err(failed(error)),
                Err(_) => thread::sleep(A_MOMENT),
            }
        }
    }
}

/// The lock of a port's broker; none when somebody has it.
fn lock(place: &std::path::Path) -> io::Result<Option<File>> {
    let file = File::options().create(true).truncate(false).write(true).open(place.with_extension("lock"))?;
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(TryLockError::WouldBlock) => Ok(None),
        Err(TryLockError::Error(error)) => Err(error),
    }
}

fn from_client(mut stream: UnixStream, mut line: PipeWriter) {
    let mut buffer = [0; 1024];
    while let Ok(count @ 1..) = stream.read(&mut buffer) {
        match line.write(buffer.get(..count).unwrap_or_default()) {
            Err(error) if error.kind() == ErrorKind::BrokenPipe => return,
            _ => {}
        }
    }
}

fn to_client(mut stream: UnixStream, mut line: PipeReader) {
    if stream.set_write_timeout(Some(PATIENCE)).is_err() {
        return;
    }
    let mut buffer = [0; 4096];
    loop {
        let count = match line.read(&mut buffer) {
            Ok(0) => break,
            Ok(count) => count,
            Err(_) => continue,
        };
        if stream.write_all(buffer.get(..count).unwrap_or_default()).is_err() {
            break;
        }
    }
    // The other direction ends with it.
    let _ = stream.shutdown(Shutdown::Both);
}

/// Where lock and socket of a port are, without their extensions; the same for every name of a port.
fn place_of(port: &str) -> io::Result<PathBuf> {
    let name = match port.split_once(':') {
        Some(_) => port.to_owned(),
        // A link such as those in /dev/serial/by-id; of a port that is not there, opening it says more.
        None => fs::canonicalize(port).unwrap_or_else(|_| port.into()).display().to_string(),
    };
    let folder = private_folder()?;
    let plain = name.chars().map(|letter| if letter.is_ascii_alphanumeric() { letter } else { '_' });
    let plain: Vec<char> = plain.collect();
    let last = plain.len().saturating_sub(LONGEST_NAME);
    Ok(folder.join(plain.get(last..).unwrap_or_default().iter().collect::<String>()))
}

/// The ports that programs of this user share now, in the order of their names, which [`open`] takes.
///
/// # Errors
/// Whatever the system says of the folder that they are in.
pub fn shared_ports() -> io::Result<Vec<String>> {
    let files = fs::read_dir(private_folder()?)?.filter_map(|entry| Some(entry.ok()?.path()));
    let locks = files.filter(|file| file.extension().is_some_and(|extension| extension == "lock"));
    // To try the lock would be in the way of who wants it.
    let shared = locks.filter(|lock| UnixStream::connect(lock.with_extension("sock")).is_ok());
    let mut ports: Vec<String> = shared.filter_map(|lock| fs::read_to_string(lock).ok()).collect();
    ports.sort();
    Ok(ports)
}

/// A folder of this user's own, for as long as the computer runs.
///
/// # Errors
/// Whatever the system says; [`PermissionDenied`](ErrorKind::PermissionDenied) when others can get in.
pub fn private_folder() -> io::Result<PathBuf> {
    let folder = match std::env::var_os("XDG_RUNTIME_DIR").filter(|folder| !folder.is_empty()) {
        Some(folder) => PathBuf::from(folder).join("dimsart"),
        None => std::env::temp_dir().join(format!("dimsart-{}", rustix::process::getuid().as_raw())),
    };
    fs::DirBuilder::new().recursive(true).mode(0o700).create(&folder)?;
    // In a folder that others can write, anybody could say to be the broker.
    let found = fs::metadata(&folder)?;
    if found.uid() != rustix::process::getuid().as_raw() || found.mode() & 0o077 != 0 {
        let message = format!("{} is not this user's alone", folder.display());
        return Err(io::Error::new(ErrorKind::PermissionDenied, message));
    }
    Ok(folder)
}
