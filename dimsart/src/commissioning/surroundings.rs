//! What is around a board that is checked: a clock that is not its own, and what starts it over.

use std::process::Command;
use std::time::Instant;

use chips::SharedBoard;

/// What a check needs beside the board's line.
pub trait Surroundings {
    /// Time that passes for the board, by a clock that is not its own, `s`.
    fn now_s(&self) -> f64;

    /// Whether that clock can be compared with the board's: not where the board's time is simulated.
    fn keeps_time(&self) -> bool;

    /// Whether the board can be started over.
    fn can_restart(&self) -> bool;

    /// Starts the board over, as its reset pin does.
    ///
    /// # Errors
    /// Why it was not.
    fn restart(&mut self) -> Result<(), String>;
}

/// This computer, with a board at one of its ports.
#[derive(Debug)]
pub struct Computer {
    begun: Instant,
    is_simulated: bool,
    restart: Option<String>,
}

impl Computer {
    /// With a board behind a port; `restart` is a program with its arguments that starts it over.
    #[must_use]
    pub fn new(port: &str, restart: Option<String>) -> Self {
        let is_simulated = port.starts_with(crate::broker::SIMULATED);
        Self { begun: Instant::now(), is_simulated, restart }
    }
}

impl Surroundings for Computer {
    fn now_s(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }

    fn keeps_time(&self) -> bool {
        !self.is_simulated
    }

    fn can_restart(&self) -> bool {
        self.restart.is_some()
    }

    fn restart(&mut self) -> Result<(), String> {
        let line = self.restart.as_deref().unwrap_or_default();
        let mut words = line.split_whitespace();
        let program = words.next().ok_or("nothing is given that starts the board over")?;
        let output = Command::new(program).args(words).output();
        let output = output.map_err(|error| format!("`{line}` could not be started: {error}"))?;
        match output.status.success() {
            true => Ok(()),
            false => Err(format!("`{line}`: {}", String::from_utf8_lossy(&output.stderr).trim())),
        }
    }
}

/// An emulated board; its time is the chip's.
impl Surroundings for SharedBoard {
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
