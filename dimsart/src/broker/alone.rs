//! A port that is this program's alone, where the system has no sockets with paths.

use std::io::{self, ErrorKind};
use std::path::PathBuf;

use hil_sim::link::{PortError, Stream};
use hil_sim::pipe::Pipe;

use super::Broker;

/// Opens a port: a serial port by its name or `tcp:HOST:PORT`. It is not shared with other programs.
///
/// # Errors
/// As [`open_port`](hil_sim::link::open_port).
pub fn open(port: &str, baud: u32) -> Result<Box<dyn Stream>, PortError> {
    hil_sim::link::open_port(port, baud)
}

/// A port that this program has.
#[derive(Debug)]
pub struct SharedPort(Broker);

impl SharedPort {
    /// Shares what is at the other end of a stream within this program.
    ///
    /// # Errors
    /// None.
    pub fn new(_: &str, stream: Box<dyn Stream>) -> Result<Self, PortError> {
        Ok(Self(Broker::new(stream)))
    }

    /// A line of one's own; none when the port is gone.
    #[must_use]
    pub fn join(&self) -> Option<Pipe> {
        self.0.join()
    }
}

/// The ports that programs of this user share now: there is none here.
///
/// # Errors
/// None.
pub fn shared_ports() -> io::Result<Vec<String>> {
    Ok(Vec::new())
}

/// A folder of this user's own: there is none here.
///
/// # Errors
/// [`Unsupported`](ErrorKind::Unsupported), always.
pub fn private_folder() -> io::Result<PathBuf> {
    Err(ErrorKind::Unsupported.into())
}
