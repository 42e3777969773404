//! An emulated chip in a board's place: whoever reads its line lets its time pass.

use std::io::{self, ErrorKind, Read, Write};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use chips::Bench;
use cycles::machine::MachineError;

use super::Surroundings;

/// What a read of the command line waits, `s` of the board's time.
const READ_S: f64 = 1e-3;

/// A board on a bench, with what is around it.
pub trait OnBench {
    /// The board's bench.
    fn bench(&mut self) -> &mut Bench;

    /// Lets so much time pass.
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

/// A board whose chip is emulated.
#[derive(Debug)]
pub struct EmulatedBoard<W = Bench>(Arc<Mutex<W>>);

impl<W> Clone for EmulatedBoard<W> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<W> EmulatedBoard<W> {
    /// The board on a bench.
    #[must_use]
    pub fn new(bench: W) -> Self {
        Self(Arc::new(Mutex::new(bench)))
    }

    /// The bench, for as long as nobody reads the board's line.
    pub fn bench(&self) -> MutexGuard<'_, W> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The host's end of its command line.
    #[must_use]
    pub fn line(&self) -> EmulatedLine<W> {
        EmulatedLine { board: self.clone(), rest: Vec::new() }
    }
}

impl Surroundings for EmulatedBoard {
    fn now_s(&self) -> f64 {
        self.bench().time_s()
    }

    fn keeps_time(&self) -> bool {
        true
    }

    fn can_restart(&self) -> bool {
        true
    }

    fn restart(&mut self) -> Result<(), String> {
        self.bench().reset();
        Ok(())
    }
}

/// The host's end of an emulated board's command line.
#[derive(Debug)]
pub struct EmulatedLine<W = Bench> {
    board: EmulatedBoard<W>,
    rest: Vec<u8>,
}

impl<W: OnBench> Read for EmulatedLine<W> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.rest.is_empty() {
            let mut bench = self.board.bench();
            bench.run_for(READ_S).map_err(io::Error::other)?;
            self.rest = bench.bench().received();
        }
        if self.rest.is_empty() {
            return Err(ErrorKind::WouldBlock.into());
        }
        let count = self.rest.as_slice().read(buffer)?;
        self.rest.drain(..count);
        Ok(count)
    }
}

impl<W: OnBench> Write for EmulatedLine<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.board.bench().bench().send(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
