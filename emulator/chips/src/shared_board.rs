//! A board shared by its user and the reader of its command line. Each read advances the board's time.

use std::io::{self, ErrorKind, Read, Write};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use cycles::machine::MachineError;

use crate::Bench;

/// Time by which a read of the command line advances the board, `s`.
const READ_S: f64 = 1e-3;

/// An emulated board with its surroundings.
pub trait OnBench {
    /// The board's bench.
    fn bench(&mut self) -> &mut Bench;

    /// Runs for this time.
    ///
    /// # Errors
    /// As [`Bench::run_for`].
    fn run_for(&mut self, duration_s: f64) -> Result<(), MachineError>;
}

impl OnBench for Bench {
    fn bench(&mut self) -> &mut Bench {
        self
    }

    fn run_for(&mut self, duration_s: f64) -> Result<(), MachineError> {
        Self::run_for(self, duration_s)
    }
}

/// A shared handle of an emulated board.
#[derive(Debug)]
pub struct SharedBoard<W = Bench>(Arc<Mutex<W>>);

impl<W> Clone for SharedBoard<W> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<W> SharedBoard<W> {
    /// Shares a board.
    #[must_use]
    pub fn new(bench: W) -> Self {
        Self(Arc::new(Mutex::new(bench)))
    }

    /// Locks the bench; the command line waits meanwhile.
    pub fn bench(&self) -> MutexGuard<'_, W> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The host's end of the command line.
    #[must_use]
    pub fn line(&self) -> CommandLine<W> {
        CommandLine { board: self.clone(), rest: Vec::new() }
    }
}

/// The host's end of a board's command line.
#[derive(Debug)]
pub struct CommandLine<W = Bench> {
    board: SharedBoard<W>,
    rest: Vec<u8>,
}

impl<W: OnBench> Read for CommandLine<W> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.rest.is_empty() {
            let mut bench = self.board.bench();
            bench.run_for(READ_S).map_err(io::Error::other)?;
            self.rest = bench.bench().take_received();
        }
        if self.rest.is_empty() {
            return Err(ErrorKind::WouldBlock.into());
        }
        let count = self.rest.as_slice().read(buffer)?;
        self.rest.drain(..count);
        Ok(count)
    }
}

impl<W: OnBench> Write for CommandLine<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.board.bench().bench().send(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
