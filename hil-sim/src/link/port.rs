//! Ports: PORT on the command line, and errors of opening it.

use std::fmt;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::path::Path;
use std::time::Duration;

use serialport::SerialPort;

use crate::untrusted_text::escape_line;

/// Timeout of a read.
const READ_WAIT: Duration = Duration::from_millis(10);
/// Timeout of a write and of opening a socket.
const WRITE_WAIT: Duration = Duration::from_secs(2);

/// Bidirectional bytes without buffering. A read without data ends after a few milliseconds with `TimedOut` or
/// `WouldBlock`.
pub trait Stream: Read + Write + Send + fmt::Debug {}

impl<S: Read + Write + Send + fmt::Debug> Stream for S {}

/// Error of opening a port.
#[derive(Debug, thiserror::Error)]
pub enum PortError {
    /// Unknown port.
    #[error("port {port} not found; {}; for a controller of `dimsart serve`, use sim:NAME", list(existing))]
    NotFound {
        /// The name.
        port: String,
        /// Available serial ports.
        existing: Vec<String>,
    },
    /// No permission.
    #[error(
        "no permission for {port}: join its group with `sudo usermod -aG dialout $USER` and log in again, or \
        add the line `SUBSYSTEM==\"tty\", ATTRS{{idVendor}}==\"0483\", TAG+=\"uaccess\"` (0483 is the \
        USB vendor id of ST; `lsusb` lists the id of your board) to /etc/udev/rules.d/70-dimsart.rules, run \
        `sudo udevadm control --reload` and reconnect the board"
    )]
    NoPermission {
        /// The port.
        port: String,
    },
    /// In use.
    #[error("{port} is in use by another program: close it (a terminal, another user's `dimsart`) and retry")]
    InUse {
        /// The port.
        port: String,
    },
    /// Invalid `tcp:` address.
    #[error("invalid address {port}: write tcp:HOST:PORT, such as tcp:localhost:4000")]
    Address {
        /// Address.
        port: String,
    },
    /// No peer at the socket.
    #[error(
        "cannot open {port}: {source}; start the emulated board first and use the socket that the board prints"
    )]
    Socket {
        /// The port.
        port: String,
        /// Error of the operating system.
        source: io::Error,
    },
    /// Simulated port without a server.
    #[error("{port} is not served: start `dimsart serve` with a rig that has a controller of this name")]
    ServerNotFound {
        /// The port.
        port: String,
    },
    /// Simulated port served by another program.
    #[error(
        "{port} is already served by another `dimsart`: stop that program, or use `dimsart connect {port}`"
    )]
    Served {
        /// The port.
        port: String,
    },
    /// Cannot create the socket that clients connect to.
    #[error(
        "cannot share {port} with other programs: {source}; set XDG_RUNTIME_DIR to a folder that you own"
    )]
    Shared {
        /// The port.
        port: String,
        /// Error of the operating system.
        source: io::Error,
    },
    /// Other serial error.
    #[error("cannot open serial port {port}: {reason}; check name and baud rate")]
    Serial {
        /// The port.
        port: String,
        /// Error of the operating system.
        reason: String,
    },
}

fn list(existing: &[String]) -> String {
    let names = match existing {
        [] => "no serial port found, connect the board".to_owned(),
        names => format!("available serial ports: {}", names.join(", ")),
    };
    format!("{names}; address of an emulated board: tcp:HOST:PORT or unix:PATH")
}

/// Opens a serial port (`/dev/ttyACM0`) or a socket (`tcp:HOST:PORT`, `unix:PATH`). `baud` applies to serial ports
/// only.
///
/// # Errors
/// [`PortError`] if the port cannot be opened.
pub fn open_port(port: &str, baud: u32) -> Result<Box<dyn Stream>, PortError> {
    open(port, baud, [READ_WAIT, WRITE_WAIT])
}

/// Like [`open_port`], with a timeout of `wait` (> 0) for reads and writes.
///
/// # Errors
/// As [`open_port`].
pub fn open_with_timeout(port: &str, baud: u32, wait: Duration) -> Result<Box<dyn Stream>, PortError> {
    open(port, baud, [wait; 2])
}

/// Opens a port with these timeouts; a serial port uses the read timeout for both.
fn open(port: &str, baud: u32, waits @ [read, _]: [Duration; 2]) -> Result<Box<dyn Stream>, PortError> {
    if let Some(address) = port.strip_prefix("tcp:") {
        return open_tcp(port, address, waits);
    }
    match port.strip_prefix("unix:") {
        Some(path) => open_unix(port, path, waits),
        None => Ok(Box::new(open_serial(port, baud, read)?)),
    }
}

/// Opens a serial port with a timeout of `wait`.
///
/// # Errors
/// [`PortError`] if the port cannot be opened.
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
        Serial::Io(ErrorKind::NotFound) => PortError::NotFound { port, existing: existing() },
        Serial::NoDevice if Path::new(&port).exists() => PortError::InUse { port },
        Serial::NoDevice => PortError::NotFound { port, existing: existing() },
        _ => PortError::Serial { port, reason: error.to_string() },
    }
}

/// Lists the serial ports of this computer; empty if unknown.
fn existing() -> Vec<String> {
    let ports = serialport::available_ports().unwrap_or_default();
    ports.into_iter().map(|port| escape_line(&port.port_name)).collect()
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
        let message = PortError::NotFound { port: "/dev/ttyACM9".to_owned(), existing }.to_string();
        assert!(
            message
                .contains("port /dev/ttyACM9 not found; available serial ports: /dev/ttyS0, /dev/ttyACM0;"),
            "{message}"
        );
    }
}
