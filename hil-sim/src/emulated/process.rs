//! The emulator process: starts with an image, and is always terminated.

use std::fs::File;
use std::io::{PipeReader, PipeWriter};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Mutex, PoisonError};
use std::thread::sleep;
use std::time::{Duration, Instant};

use rustix::io::{FdFlags, fcntl_setfd};
use rustix::process::{Pid, Signal, kill_process};

use super::log::Log;
use super::{EmulatedError, Image, PROGRAM};

/// With instruction-count time, 2^10 ns per instruction ([`NS_PER_INSTRUCTION`](super::NS_PER_INSTRUCTION)), runs are
/// reproducible and faster than with a clock.
const ARGUMENTS: &[&str] = &[
    "-M",
    "mps2-an386",
    "-nographic",
    "-monitor",
    "none",
    "-serial",
    "none",
    "-semihosting-config",
    "enable=on,target=native",
    "-icount",
    "shift=10,align=off,sleep=off",
    "-kernel",
];
/// Timeout for the exit of a process after its line is closed.
const LAST_MOMENTS: Duration = Duration::from_secs(1);
const A_MOMENT: Duration = Duration::from_millis(5);

/// Running emulators, for termination without waiting for their owners.
static RUNNING: Mutex<Vec<Pid>> = Mutex::new(Vec::new());

/// Terminates all emulators of this process; their owners detect it. Returns false if there was none.
pub fn terminate_emulators() -> bool {
    let running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
    for pid in running.iter() {
        // Fails only if it has exited.
        let _ = kill_process(*pid, Signal::KILL);
    }
    !running.is_empty()
}

/// A process that is terminated with this value.
#[derive(Debug)]
pub(super) struct Process {
    child: Child,
    log: Log,
}

impl Process {
    /// Starts an image in a working folder. The firmware reads standard input and writes to the pipe inherited under
    /// the same number. Its log is written to `log`.
    pub(super) fn start(
        image: &Image,
        folder: &Path,
        (reads, writes): (PipeReader, PipeWriter),
        log: Option<File>,
    ) -> Result<Self, EmulatedError> {
        let path = std::path::absolute(image.path()).map_err(EmulatedError::Files)?;
        let mut command = Command::new(PROGRAM);
        command.args(ARGUMENTS).arg(path).current_dir(folder).stdin(reads);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        // Ctrl-C is handled by this process, which then terminates the emulator.
        command.process_group(0);
        let mut running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
        // Inside the lock, so that no other emulator inherits the pipe.
        fcntl_setfd(&writes, FdFlags::empty()).map_err(|error| EmulatedError::Files(error.into()))?;
        let mut child = command.spawn().map_err(EmulatedError::EmulatorNotFound)?;
        drop(writes);
        running.push(Pid::from_child(&child));
        drop(running);
        let log = Log::follow(child.stdout.take(), child.stderr.take(), image.bytes().to_vec(), log);
        Ok(Self { child, log })
    }

    pub(super) fn has_ended(&mut self) -> bool {
        self.child.try_wait().is_ok_and(|status| status.is_some())
    }

    /// Returns its exit status after its line was closed.
    pub(super) fn ended(&mut self) -> EmulatedError {
        let status = self.await_end();
        EmulatedError::EmulatorExited { status, log: self.log.last_lines() }
    }

    /// Returns the reason of a firmware stop, and the last commands of its actuators.
    pub(super) fn stopped(&mut self, commanded: Vec<f32>) -> EmulatedError {
        self.await_end();
        EmulatedError::Stopped { commanded, log: self.log.last_lines() }
    }

    fn await_end(&mut self) -> Option<ExitStatus> {
        let deadline = Instant::now() + LAST_MOMENTS;
        while !self.has_ended() && Instant::now() < deadline {
            sleep(A_MOMENT);
        }
        let status = self.child.try_wait().ok().flatten();
        self.end();
        status
    }

    /// Terminates it after a timeout.
    pub(super) fn hung(&mut self) -> EmulatedError {
        self.end();
        EmulatedError::Unresponsive { log: self.log.last_lines() }
    }

    fn end(&mut self) {
        let mut running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
        // Both fail only if it has exited.
        let _ = self.child.kill();
        let _ = self.child.wait();
        running.retain(|pid| *pid != Pid::from_child(&self.child));
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.end();
        // Completes its log file.
        self.log.last_lines();
    }
}
