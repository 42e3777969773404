//! The emulator as a process and the FIFOs to the firmware in it.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::time::{Duration, Instant};

use dimsart_core::exchange::{ExchangeError, Frame};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{CWD, Mode, OFlags, mkfifoat};
use rustix::io::Errno;
use tempfile::TempDir;

use super::process::Process;
pub(crate) use super::process::end_all;
use super::{EmulatedError, Image, PATIENCE};

const A_MOMENT: Duration = Duration::from_millis(1);
/// Between two looks at a process that says nothing.
const A_WHILE: Timespec = Timespec { tv_sec: 0, tv_nsec: 100_000_000 };
/// As the firmware names them.
const TO_BOARD: &str = "to-board";
const FROM_BOARD: &str = "from-board";

/// A running emulator and the line to its firmware.
///
/// Both end with this value; should this process be killed, its ends of the FIFOs close and the firmware leaves.
#[derive(Debug)]
pub(super) struct Emulator {
    process: Process,
    to_board: File,
    from_board: File,
    /// Where the FIFOs are, until both ends are open: nothing can be left behind then.
    folder: Option<TempDir>,
}

/// Why a line carries nothing more.
enum Broken {
    Closed,
    Silent,
    Frame(ExchangeError),
}

impl From<ExchangeError> for Broken {
    fn from(error: ExchangeError) -> Self {
        Self::Frame(error)
    }
}

impl Emulator {
    /// Starts an image and waits until it has opened the line. The firmware's log goes to `log`.
    pub(super) fn start(image: &Image, log: Option<File>) -> Result<Self, EmulatedError> {
        let folder = tempfile::Builder::new().prefix("dimsart-").tempdir().map_err(EmulatedError::Files)?;
        for name in [TO_BOARD, FROM_BOARD] {
            let made = mkfifoat(CWD, folder.path().join(name), Mode::RUSR | Mode::WUSR);
            made.map_err(|error| EmulatedError::Files(error.into()))?;
        }
        let from_board = open(&folder.path().join(FROM_BOARD), OpenOptions::new().read(true));
        let from_board = from_board.map_err(EmulatedError::Files)?;
        let mut process = Process::start(image, folder.path(), log)?;
        let deadline = Instant::now() + PATIENCE;
        loop {
            match open(&folder.path().join(TO_BOARD), OpenOptions::new().write(true)) {
                Ok(to_board) => return Ok(Self { process, to_board, from_board, folder: Some(folder) }),
                // Nobody reads yet.
                Err(error) if error.raw_os_error() == Some(Errno::NXIO.raw_os_error()) => {}
                Err(error) => return Err(EmulatedError::Files(error)),
            }
            if process.has_ended() {
                return Err(process.ended());
            }
            if Instant::now() > deadline {
                return Err(process.hung());
            }
            std::thread::sleep(A_MOMENT);
        }
    }

    /// Sends a frame and takes in the answer. After an error the emulator has ended.
    pub(super) fn exchange(&mut self, request: &Frame, answer: &mut Frame) -> Result<(), EmulatedError> {
        let Self { process, to_board, from_board, folder } = self;
        let sent = to_board.write_all(request.as_bytes()).map_err(|_| Broken::Closed);
        let received = sent.and_then(|()| answer.receive(|bytes| read(from_board, process, bytes)));
        match received {
            Ok(true) => {
                *folder = None;
                Ok(())
            }
            Ok(false) | Err(Broken::Closed) => Err(process.ended()),
            Err(Broken::Silent) => Err(process.hung()),
            Err(Broken::Frame(error)) => Err(error.into()),
        }
    }
}

/// Does not wait for the other end.
fn open(path: &Path, how: &mut OpenOptions) -> io::Result<File> {
    how.custom_flags(OFlags::NONBLOCK.bits().cast_signed()).open(path)
}

fn read(from_board: &mut File, process: &mut Process, bytes: &mut [u8]) -> Result<usize, Broken> {
    let deadline = Instant::now() + PATIENCE;
    loop {
        match poll(&mut [PollFd::new(from_board, PollFlags::IN)], Some(&A_WHILE)) {
            // It may have ended without ever having opened its end.
            Ok(0) if process.has_ended() => return Err(Broken::Closed),
            Ok(0) if Instant::now() > deadline => return Err(Broken::Silent),
            Ok(0) | Err(Errno::INTR) => continue,
            Ok(_) => {}
            Err(_) => return Err(Broken::Closed),
        }
        match from_board.read(bytes) {
            Err(error) if matches!(error.kind(), ErrorKind::Interrupted | ErrorKind::WouldBlock) => {}
            result => return result.map_err(|_| Broken::Closed),
        }
    }
}
