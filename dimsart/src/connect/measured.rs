//! Cycle counts that the device has measured.

use std::io::{Read, Write};

use dimsart_link::protocol::{CyclesReport, Refusal, Request, Response};

use super::device::take;
use super::{ConnectError, Device};

/// Cycle counts of a device since its scheme was changed.
#[derive(Debug, Clone, PartialEq)]
pub struct CycleCounts {
    /// A whole tick.
    pub tick: CycleStatistics,
    /// Module calls of a tick, in order.
    pub calls: Vec<CycleStatistics>,
    /// Whether the unit is instructions: an emulated board has no cycles.
    pub is_instructions: bool,
}

/// Processor cycles, or instructions, of one measured section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CycleStatistics {
    /// Measured runs.
    pub runs: u32,
    /// Minimum of a run.
    pub min: f64,
    /// Mean of a run.
    pub mean: f64,
    /// Maximum of a run.
    pub max: f64,
}

impl CycleStatistics {
    fn new(report: CyclesReport) -> Self {
        let CyclesReport { runs, min, mean, max, per_1024_instructions } = report;
        let scale = match per_1024_instructions {
            0 => 1.0,
            counts => 1024.0 / f64::from(counts),
        };
        let scaled = |counts| scale * f64::from(counts);
        Self { runs, min: scaled(min), mean: scaled(mean), max: scaled(max) }
    }

    /// Adds a section that runs after this one.
    #[must_use]
    pub fn followed_by(self, other: Self) -> Self {
        Self {
            runs: self.runs.min(other.runs),
            min: self.min + other.min,
            mean: self.mean + other.mean,
            max: self.max + other.max,
        }
    }
}

impl<S: Read + Write> Device<S> {
    /// Reads the cycle counts; `None` when the image does not measure.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer.
    pub fn cycle_counts(&mut self) -> Result<Option<CycleCounts>, ConnectError> {
        let tick = match self.ask_cycles(0, false) {
            // An older image.
            Err(ConnectError::Refused(Refusal::Unsupported)) => return Ok(None),
            tick => tick?,
        };
        let Some(tick) = tick else { return Ok(None) };
        let mut calls = Vec::new();
        for place in 1..=u8::MAX {
            let Some(call) = self.ask_cycles(place, false)? else { break };
            calls.push(CycleStatistics::new(call));
        }
        let is_instructions = tick.per_1024_instructions > 0;
        Ok(Some(CycleCounts { tick: CycleStatistics::new(tick), calls, is_instructions }))
    }

    /// Resets the cycle counts of the device.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer.
    pub fn reset_cycle_counts(&mut self) -> Result<(), ConnectError> {
        self.ask_cycles(0, true).map(drop)
    }

    fn ask_cycles(&mut self, place: u8, clears: bool) -> Result<Option<CyclesReport>, ConnectError> {
        self.ask(&Request::Cycles { place, clears }, take!(Cycles))
    }
}
