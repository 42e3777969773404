//! Options of the line to a controller.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::{Args, value_parser};
use dimsart_core::ModuleKinds;
use dimsart_link::protocol::DEFAULT_BAUD;

use crate::broker;
use crate::connect::{self, ConnectError, KeyReport, Timeouts};
use hil_sim::key_file::{self, KeyFileError};
use hil_sim::link::Stream;

/// A controller at a port.
pub(super) type Device = connect::Device<Box<dyn Stream>>;

/// Options of the line to a controller.
#[derive(Debug, Args)]
pub(super) struct LineOptions {
    /// Baud rate of a serial port.
    #[arg(long, default_value_t = DEFAULT_BAUD, global = true)]
    baud: u32,
    /// Maximum time to wait for an answer, s.
    #[arg(long, value_name = "SECONDS", default_value = "0.5", value_parser = seconds, global = true)]
    timeout_s: Duration,
    /// Maximum number of times to send a request.
    ///
    /// A command that cannot be repeated safely is sent once.
    #[arg(long, value_name = "COUNT", default_value_t = 3, value_parser = value_parser!(u32).range(1..))]
    #[arg(global = true)]
    tries: u32,
    /// File with the key of a locked board (docs/keys.md).
    #[arg(long, value_name = "FILE", global = true)]
    key_file: Option<PathBuf>,
}

impl LineOptions {
    /// Opens a port and reads the device's identity.
    pub(super) fn open(&self, port: &str, kinds: ModuleKinds) -> Result<Device, Box<dyn Error>> {
        let stream = broker::open(port, self.baud).map_err(ConnectError::from)?;
        let patience = Timeouts { timeout: self.timeout_s, tries: self.tries };
        let mut device =
            Device::identify(stream, patience, kinds).map_err(|error| format!("{port}: {error}"))?;
        if let Some(note) = device.version_note() {
            eprintln!("dimsart: note: {note}");
        }
        if let Some(file) = &self.key_file {
            let state = device.use_key(&read_key(file)?)?;
            if state != KeyReport::Locked {
                eprintln!("dimsart: note: {port}: {state}");
            }
        }
        Ok(device)
    }
}

/// Whether a name is a port rather than a regular file.
pub(super) fn is_port(name: &str) -> bool {
    let is_windows = name.strip_prefix("COM").is_some_and(|number| number.parse::<u16>().is_ok());
    [broker::SIMULATED, "tcp:", "unix:", "/dev/tty", "/dev/cu.", "/dev/serial/"]
        .iter()
        .any(|start| name.starts_with(start))
        || is_windows
        || is_device_file(Path::new(name))
}

#[cfg(unix)]
fn is_device_file(path: &Path) -> bool {
    use std::os::unix::fs::FileTypeExt;
    path.metadata().is_ok_and(|found| found.file_type().is_char_device())
}

#[cfg(not(unix))]
fn is_device_file(_path: &Path) -> bool {
    false
}

/// Reads a key, and warns if other users can read its file.
pub(super) fn read_key(file: &Path) -> Result<[u8; 16], KeyFileError> {
    if let Some(warning) = key_file::permission_warning(file) {
        eprintln!("dimsart: warning: {warning}");
    }
    key_file::read(file)
}

/// Parses a time, s.
pub(super) fn seconds(text: &str) -> Result<Duration, String> {
    let number = text.parse().map_err(|_| "not a number: give a time in seconds, such as 0.5".to_owned())?;
    Duration::try_from_secs_f64(number).map_err(|error| error.to_string())
}
