//! The surroundings of a board under test: a reference clock and a means to restart it.

use std::process::Command;
use std::time::Instant;

use chips::SharedBoard;

/// Reference clock and restart of a board.
pub trait BoardEnvironment {
    /// Returns the time by a clock independent of the board, `s`.
    fn now_s(&self) -> f64;

    /// Whether this clock can be compared with the board's: false if the board's time is simulated.
    fn keeps_time(&self) -> bool;

    /// Whether the board can be restarted.
    fn can_restart(&self) -> bool;

    /// Restarts the board, as its reset pin does.
    ///
    /// # Errors
    /// The restart failed.
    fn restart(&mut self) -> Result<(), String>;
}

/// This computer, with a board at one of its ports.
#[derive(Debug)]
pub struct HostComputer {
    begun: Instant,
    is_simulated: bool,
    restart: Option<String>,
}

impl HostComputer {
    /// For a board at a port; `restart` is a command line that restarts the board.
    #[must_use]
    pub fn new(port: &str, restart: Option<String>) -> Self {
        let is_simulated = port.starts_with(crate::broker::SIMULATED);
        Self { begun: Instant::now(), is_simulated, restart }
    }
}

impl BoardEnvironment for HostComputer {
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
        let program = words.next().ok_or("no restart command given (--restart)")?;
        let output = Command::new(program).args(words).output();
        let output = output.map_err(|error| format!("cannot run restart command `{line}`: {error}"))?;
        match output.status.success() {
            true => Ok(()),
            false => {
                let error = String::from_utf8_lossy(&output.stderr);
                Err(format!("restart command `{line}` failed: {}", error.trim()))
            }
        }
    }
}

/// An emulated board: simulated time.
impl BoardEnvironment for SharedBoard {
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
