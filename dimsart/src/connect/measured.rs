//! Cycle counts that the device has measured.

use std::io::{Read, Write};

use dimsart_link::protocol::{CyclesReport, Refusal, Request, Response};

use super::device::take;
use super::{ConnectError, Device};

/// Cycle counts of a device since its scheme was changed.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// A whole tick.
    pub tick: MeasuredRow,
    /// Module calls of a tick, in order.
    pub calls: Vec<MeasuredRow>,
    /// Whether the unit is instructions: an emulated board has no cycles.
    pub is_instructions: bool,
}

/// Processor cycles, or instructions, of one measured section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredRow {
    /// Measured runs.
    pub runs: u32,
    /// Minimum of a run.
    pub least: f64,
    /// Mean of a run.
    pub mean: f64,
    /// Maximum of a run.
    pub greatest: f64,
}

impl MeasuredRow {
    fn new(report: CyclesReport) -> Self {
        let CyclesReport { runs, min, mean, max, per_1024_instructions } = report;
        let scale = match per_1024_instructions {
            0 => 1.0,
            counts => 1024.0 / f64::from(counts),
        };
        let scaled = |counts| scale * f64::from(counts);
        Self { runs, least: scaled(min), mean: scaled(mean), greatest: scaled(max) }
    }

    /// Adds a section that runs after this one.
    #[must_use]
    pub fn then(self, other: Self) -> Self {
        Self {
            runs: self.runs.min(other.runs),
            least: self.least + other.least,
            mean: self.mean + other.mean,
            greatest: self.greatest + other.greatest,
        }
    }
}

impl<S: Read + Write> Device<S> {
    /// Reads the cycle counts; `None` when the image does not measure.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer.
    pub fn measured(&mut self) -> Result<Option<Measured>, ConnectError> {
        let tick = match self.ask_cycles(0, false) {
            // An older image.
            Err(ConnectError::Refused(Refusal::NotUnderstood)) => return Ok(None),
            tick => tick?,
        };
        let Some(tick) = tick else { return Ok(None) };
        let mut calls = Vec::new();
        for place in 1..=u8::MAX {
            let Some(call) = self.ask_cycles(place, false)? else { break };
            calls.push(MeasuredRow::new(call));
        }
        let is_instructions = tick.per_1024_instructions > 0;
        Ok(Some(Measured { tick: MeasuredRow::new(tick), calls, is_instructions }))
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
