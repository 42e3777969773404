//! The emulator process and the pipes to its firmware.

use std::fs::File;
use std::io::{self, ErrorKind, PipeReader, PipeWriter, Read, Write};
use std::os::fd::AsRawFd;
use std::os::unix::fs::symlink;
use std::time::Instant;

use dimsart_link::exchange::{ExchangeError, Frame, Tag};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use tempfile::TempDir;

use super::process::Process;
pub use super::process::terminate_emulators;
use super::words;
use super::{EmulatedError, Image, PATIENCE};

/// Poll interval of a silent process.
const A_WHILE: Timespec = Timespec { tv_sec: 0, tv_nsec: 100_000_000 };
/// Names used by the firmware.
const TO_BOARD: &str = "to-board";
const FROM_BOARD: &str = "from-board";

/// A running emulator and the pipes to its firmware.
///
/// Both end with this value. If this process is killed, its ends of the pipes close and the firmware exits; opening a
/// pipe does not block.
#[derive(Debug)]
pub(super) struct Emulator {
    process: Process,
    to_board: PipeWriter,
    from_board: PipeReader,
    /// Folder of the pipes until the firmware has opened them, to leave no files behind.
    folder: Option<TempDir>,
}

/// Reason for a closed pipe.
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
    /// Starts an image. The firmware's log is written to `log`.
    pub(super) fn start(image: &Image, log: Option<File>) -> Result<Self, EmulatedError> {
        let folder = tempfile::Builder::new().prefix("dimsart-").tempdir().map_err(EmulatedError::Files)?;
        let (board_reads, to_board) = io::pipe().map_err(EmulatedError::Files)?;
        let (from_board, board_writes) = io::pipe().map_err(EmulatedError::Files)?;
        let its_number = board_writes.as_raw_fd();
        // Standard input of the emulator, and the inherited pipe.
        for (name, number) in [(TO_BOARD, 0), (FROM_BOARD, its_number)] {
            let made = symlink(format!("/dev/fd/{number}"), folder.path().join(name));
            made.map_err(EmulatedError::Files)?;
        }
        let process = Process::start(image, folder.path(), (board_reads, board_writes), log)?;
        Ok(Self { process, to_board, from_board, folder: Some(folder) })
    }

    /// Sends a frame and receives the answer. After an error the emulator has exited.
    pub(super) fn exchange(&mut self, request: &Frame, answer: &mut Frame) -> Result<(), EmulatedError> {
        let Self { process, to_board, from_board, folder } = self;
        let sent = to_board.write_all(request.as_bytes()).map_err(|_| Broken::Closed);
        let received = sent.and_then(|()| answer.receive(|bytes| read(from_board, process, bytes)));
        match received {
            Ok(true) => {
                *folder = None;
                match answer
                    .sections()
                    .find_map(|section| section.ok().filter(|(tag, _)| *tag == Tag::Stopped))
                {
                    Some((_, left)) => Err(process.stopped(words(left).map(f32::from_bits).collect())),
                    None => Ok(()),
                }
            }
            Ok(false) | Err(Broken::Closed) => Err(process.ended()),
            Err(Broken::Silent) => Err(process.hung()),
            Err(Broken::Frame(error)) => Err(error.into()),
        }
    }
}

fn read(from_board: &mut PipeReader, process: &mut Process, bytes: &mut [u8]) -> Result<usize, Broken> {
    let deadline = Instant::now() + PATIENCE;
    loop {
        match poll(&mut [PollFd::new(from_board, PollFlags::IN)], Some(&A_WHILE)) {
            // It may have exited before opening its end.
            Ok(0) if process.has_ended() => return Err(Broken::Closed),
            Ok(0) if Instant::now() > deadline => return Err(Broken::Silent),
            Ok(0) | Err(Errno::INTR) => continue,
            Ok(_) => {}
            Err(_) => return Err(Broken::Closed),
        }
        match from_board.read(bytes) {
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            result => return result.map_err(|_| Broken::Closed),
        }
    }
}
