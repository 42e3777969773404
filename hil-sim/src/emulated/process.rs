//! The emulator's process: started with a firmware image, ended whatever happens.

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

/// In instruction-count time, with 2^10 ns for each as [`NS_PER_INSTRUCTION`](super::NS_PER_INSTRUCTION) says, a run is the same instruction by instruction, and faster than against a clock.
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
/// How long a process whose line is closed may take to end by itself.
const LAST_MOMENTS: Duration = Duration::from_secs(1);
const A_MOMENT: Duration = Duration::from_millis(5);

/// Those that run, for who cannot wait for their owner to end them.
static RUNNING: Mutex<Vec<Pid>> = Mutex::new(Vec::new());

/// Ends every emulator of this process; their owners find out. False when there was none.
pub fn end_all() -> bool {
    let running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
    for pid in running.iter() {
        // Fails only where it has ended.
        let _ = kill_process(*pid, Signal::KILL);
    }
    !running.is_empty()
}

/// A process that ends with this value.
#[derive(Debug)]
pub(super) struct Process {
    child: Child,
    log: Log,
}

impl Process {
    /// Starts an image in a working folder. The firmware reads its line from the standard input and writes it to
    /// the pipe that it inherits under the same number. What it logs goes to `log`.
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
        // Ctrl-C is for this process, which then ends the emulator.
        command.process_group(0);
        let mut running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
        // Within the lock: no other emulator is to inherit it.
        fcntl_setfd(&writes, FdFlags::empty()).map_err(|error| EmulatedError::Files(error.into()))?;
        let mut child = command.spawn().map_err(EmulatedError::NoEmulator)?;
        drop(writes);
        running.push(Pid::from_child(&child));
        drop(running);
        let log = Log::follow(child.stdout.take(), child.stderr.take(), image.bytes().to_vec(), log);
        Ok(Self { child, log })
    }

    pub(super) fn has_ended(&mut self) -> bool {
        self.child.try_wait().is_ok_and(|status| status.is_some())
    }

    /// How it ended, after its line was closed.
    pub(super) fn ended(&mut self) -> EmulatedError {
        let status = self.await_end();
        EmulatedError::Ended { status, log: self.log.last_lines() }
    }

    /// What its firmware stopped by, after it said so, and what its actuators are left with.
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

    /// Ends it because nothing comes any more.
    pub(super) fn hung(&mut self) -> EmulatedError {
        self.end();
        EmulatedError::Hung { log: self.log.last_lines() }
    }

    fn end(&mut self) {
        let mut running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
        // Either fails only where there is nothing left to be ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
        running.retain(|pid| *pid != Pid::from_child(&self.child));
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.end();
        // So that its file is whole.
        self.log.last_lines();
    }
}
