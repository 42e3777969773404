//! Ports: what PORT on the command line stands for, and why it does not open.

use std::fmt;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::path::Path;
use std::time::Duration;

use serialport::SerialPort;

use crate::foreign_text::visible;

/// Longest time that a read waits for a byte.
const READ_WAIT: Duration = Duration::from_millis(10);
/// Longest time that a write or the opening of a socket waits.
const WRITE_WAIT: Duration = Duration::from_secs(2);

/// Bytes both ways, without a buffer that needs flushing. A read that finds nothing ends after a few
/// milliseconds with `TimedOut` or `WouldBlock`.
pub trait Stream: Read + Write + Send + fmt::Debug {}

impl<S: Read + Write + Send + fmt::Debug> Stream for S {}

/// Why a port does not open.
#[derive(Debug, thiserror::Error)]
pub enum PortError {
    /// Nothing has this name.
    #[error("there is no port {port}; {}; a controller of `dimsart serve` is sim:NAME", list(existing))]
    NotThere {
        /// The name.
        port: String,
        /// Serial ports of this computer.
        existing: Vec<String>,
    },
    /// The system keeps this user out.
    #[error(
        "no permission to use {port}: join its group with `sudo usermod -aG dialout $USER` and log in again, or \
         put the line `SUBSYSTEM==\"tty\", ATTRS{{idVendor}}==\"0483\", TAG+=\"uaccess\"` (0483 is ST's; `lsusb` shows \
         yours) into /etc/udev/rules.d/70-dimsart.rules, run `sudo udevadm control --reload` and plug the board in again"
    )]
    NoPermission {
        /// The port.
        port: String,
    },
    /// Somebody has it.
    #[error(
        "{port} is in use by a program that does not share it: end that (a terminal, another user's `dimsart`) and try again"
    )]
    InUse {
        /// The port.
        port: String,
    },
    /// `tcp:` without a host and a port.
    #[error("{port} is no address: write it as tcp:HOST:PORT, such as tcp:localhost:4000")]
    Address {
        /// As it was written.
        port: String,
    },
    /// Nobody is at the socket.
    #[error("{port} does not open: {source}; start the emulated board first, and give the socket it names")]
    Socket {
        /// The port.
        port: String,
        /// What the system says.
        source: io::Error,
    },
    /// No program simulates it.
    #[error("nobody serves {port}: start `dimsart serve` with a rig that has a controller of this name")]
    NotServed {
        /// The port.
        port: String,
    },
    /// Another program shares it.
    #[error(
        "{port} is served already: end the `dimsart` that does, or join it with `dimsart connect {port}`"
    )]
    Served {
        /// The port.
        port: String,
    },
    /// Clients cannot find together.
    #[error(
        "{port} cannot be shared with other programs: {source}; look after XDG_RUNTIME_DIR, a folder of your own"
    )]
    Shared {
        /// The port.
        port: String,
        /// What the system says.
        source: io::Error,
    },
    /// Anything else.
    #[error("{port} does not open as a serial port: {reason}; check name and baud rate")]
    Serial {
        /// The port.
        port: String,
        /// What the system says.
        reason: String,
    },
}

fn list(existing: &[String]) -> String {
    let names = match existing {
        [] => "this computer has no serial port: plug the board in".to_owned(),
        names => format!("there is {}", names.join(", ")),
    };
    format!("{names}; an emulated board is tcp:HOST:PORT or unix:PATH")
}

/// Opens a serial port by its name (`/dev/ttyACM0`) or a socket (`tcp:HOST:PORT`, `unix:PATH`). `baud`
/// is for serial ports only.
///
/// # Errors
/// [`PortError`] says why not and what to do.
pub fn open_port(port: &str, baud: u32) -> Result<Box<dyn Stream>, PortError> {
    open(port, baud, [READ_WAIT, WRITE_WAIT])
}

/// The same, with reads that wait for a byte, and writes for room, no longer than `wait`, more than 0.
///
/// # Errors
/// As [`open_port`].
pub fn open_waiting(port: &str, baud: u32, wait: Duration) -> Result<Box<dyn Stream>, PortError> {
    open(port, baud, [wait; 2])
}

/// With reads and writes of a socket that wait no longer than this; those of a serial port both wait as its reads.
fn open(port: &str, baud: u32, waits @ [read, _]: [Duration; 2]) -> Result<Box<dyn Stream>, PortError> {
    if let Some(address) = port.strip_prefix("tcp:") {
        return open_tcp(port, address, waits);
    }
    match port.strip_prefix("unix:") {
        Some(path) => open_unix(port, path, waits),
        None => Ok(Box::new(open_serial(port, baud, read)?)),
    }
}

/// Opens a serial port. Reads and writes wait no longer than `wait`.
///
/// # Errors
/// [`PortError`] says why not and what to do.
pub fn open_serial(port: &str, baud: u32, wait: Duration) -> Result<Box<dyn SerialPort>, PortError> {
    serialport::new(port, baud).timeout(wait).open().map_err(|error| serial_error(port, &error))
}

fn open_tcp(port: &str, address: &str, [read, write]: [Duration; 2]) -> Result<Box<dyn Stream>, PortError> {
    let failed = |source| PortError::Socket { port: port.to_owned(), source };
    let malformed = || PortError::Address { port: port.to_owned() };
    let (host, number) = address.rsplit_once(':').ok_or_else(malformed)?;
    if host.is_empty() || number.parse::<u16>().is_err() {
        return Err(malformed());
    }
    let mut last = io::Error::from(ErrorKind::NotFound);
    for address in address.to_socket_addrs().map_err(failed)? {
        match TcpStream::connect_timeout(&address, WRITE_WAIT) {
            Ok(stream) => {
                stream.set_nodelay(true).map_err(failed)?;
                stream.set_read_timeout(Some(read)).map_err(failed)?;
                stream.set_write_timeout(Some(write)).map_err(failed)?;
                return Ok(Box::new(stream));
            }
            Err(error) => last = error,
        }
    }
    Err(failed(last))
}

#[cfg(unix)]
fn open_unix(port: &str, path: &str, [read, write]: [Duration; 2]) -> Result<Box<dyn Stream>, PortError> {
    let failed = |source| PortError::Socket { port: port.to_owned(), source };
    let stream = std::os::unix::net::UnixStream::connect(path).map_err(failed)?;
    stream.set_read_timeout(Some(read)).map_err(failed)?;
    stream.set_write_timeout(Some(write)).map_err(failed)?;
    Ok(Box::new(stream))
}

#[cfg(not(unix))]
fn open_unix(port: &str, _: &str, _: [Duration; 2]) -> Result<Box<dyn Stream>, PortError> {
    Err(PortError::Socket { port: port.to_owned(), source: ErrorKind::Unsupported.into() })
}

fn serial_error(port: &str, error: &serialport::Error) -> PortError {
    use serialport::ErrorKind as Serial;
    let port = port.to_owned();
    match error.kind() {
        Serial::Io(ErrorKind::PermissionDenied) => PortError::NoPermission { port },
        Serial::Io(ErrorKind::NotFound) => PortError::NotThere { port, existing: existing() },
        Serial::NoDevice if Path::new(&port).exists() => PortError::InUse { port },
        Serial::NoDevice => PortError::NotThere { port, existing: existing() },
        _ => PortError::Serial { port, reason: error.to_string() },
    }
}

/// Serial ports of this computer; none when it does not tell.
fn existing() -> Vec<String> {
    let ports = serialport::available_ports().unwrap_or_default();
    ports.into_iter().map(|port| visible(&port.port_name)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_user_who_is_kept_out_is_told_how_to_get_in() {
        let kind = serialport::ErrorKind::Io(ErrorKind::PermissionDenied);
        let message = serial_error("/dev/ttyACM0", &serialport::Error::new(kind, "denied")).to_string();
        for part in
            ["/dev/ttyACM0", "usermod -aG dialout", "SUBSYSTEM==\"tty\", ATTRS{idVendor}==\"0483\", TAG+="]
        {
            assert!(message.contains(part), "{message}");
        }
    }

    #[test]
    fn a_port_that_is_not_there_lists_those_that_are() {
        let existing = vec!["/dev/ttyS0".to_owned(), "/dev/ttyACM0".to_owned()];
        let message = PortError::NotThere { port: "/dev/ttyACM9".to_owned(), existing }.to_string();
        assert!(message.contains("no port /dev/ttyACM9; there is /dev/ttyS0, /dev/ttyACM0;"), "{message}");
    }
}
