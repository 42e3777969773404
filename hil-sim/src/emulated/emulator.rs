//! The emulator as a process and the pipes to the firmware in it.

use std::fs::File;
use std::io::{self, ErrorKind, PipeReader, PipeWriter, Read, Write};
use std::os::fd::AsRawFd;
use std::os::unix::fs::symlink;
use std::time::Instant;

use dimsart_link::exchange::{ExchangeError, Frame, Tag};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use tempfile::TempDir;

use super::board::words;
use super::process::Process;
pub use super::process::end_all;
use super::{EmulatedError, Image, PATIENCE};

/// Between two looks at a process that says nothing.
const A_WHILE: Timespec = Timespec { tv_sec: 0, tv_nsec: 100_000_000 };
/// As the firmware names them.
const TO_BOARD: &str = "to-board";
const FROM_BOARD: &str = "from-board";

/// A running emulator and the line to its firmware.
///
/// Both end with this value; should this process be killed, its ends of the pipes close and the firmware leaves, as
/// soon as it looks: opening a pipe waits for nobody.
#[derive(Debug)]
pub(super) struct Emulator {
    process: Process,
    to_board: PipeWriter,
    from_board: PipeReader,
    /// Where the firmware finds its ends, until it has opened them: nothing can be left behind then.
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
    /// Starts an image. The firmware's log goes to `log`.
    pub(super) fn start(image: &Image, log: Option<File>) -> Result<Self, EmulatedError> {
        let folder = tempfile::Builder::new().prefix("dimsart-").tempdir().map_err(EmulatedError::Files)?;
        let (board_reads, to_board) = io::pipe().map_err(EmulatedError::Files)?;
        let (from_board, board_writes) = io::pipe().map_err(EmulatedError::Files)?;
        let its_number = board_writes.as_raw_fd();
        // The emulator's standard input, and what it inherits.
        for (name, number) in [(TO_BOARD, 0), (FROM_BOARD, its_number)] {
            let made = symlink(format!("/dev/fd/{number}"), folder.path().join(name));
            made.map_err(EmulatedError::Files)?;
        }
        let process = Process::start(image, folder.path(), (board_reads, board_writes), log)?;
        Ok(Self { process, to_board, from_board, folder: Some(folder) })
    }

    /// Sends a frame and takes in the answer. After an error the emulator has ended.
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
            // It may have ended without ever having opened its end.
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
