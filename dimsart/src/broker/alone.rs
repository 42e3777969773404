//! Exclusive ports, for systems without Unix sockets.

use std::io::{self, ErrorKind};
use std::path::PathBuf;

use hil_sim::link::{PortError, Stream};
use hil_sim::pipe::Pipe;

use super::Broker;

/// Opens a serial port by name or `tcp:HOST:PORT`, not shared with other programs.
///
/// # Errors
/// As [`open_port`](hil_sim::link::open_port).
pub fn open(port: &str, baud: u32) -> Result<Box<dyn Stream>, PortError> {
    hil_sim::link::open_port(port, baud)
}

/// A port opened by this program.
#[derive(Debug)]
pub struct SharedPort(Broker);

impl SharedPort {
    /// Shares a stream within this program.
    ///
    /// # Errors
    /// None.
    pub fn new(_: &str, stream: Box<dyn Stream>) -> Result<Self, PortError> {
        Ok(Self(Broker::new(stream)))
    }

    /// Returns a separate line; none if the port is closed.
    #[must_use]
    pub fn join(&self) -> Option<Pipe> {
        self.0.join()
    }
}

/// Returns the ports shared by programs of this user: always empty here.
///
/// # Errors
/// None.
pub fn shared_ports() -> io::Result<Vec<String>> {
    Ok(Vec::new())
}

/// Returns a private folder of this user: not supported here.
///
/// # Errors
/// [`Unsupported`](ErrorKind::Unsupported), always.
pub fn private_folder() -> io::Result<PathBuf> {
    Err(ErrorKind::Unsupported.into())
}
