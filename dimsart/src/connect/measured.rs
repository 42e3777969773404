//! What the device itself has measured of its ticks.

use std::io::{Read, Write};

use dimsart_link::protocol::{CyclesReport, Refusal, Request, Response};

use super::device::take;
use super::{ConnectError, Device};

/// What the ticks of a device took since its scheme was changed.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// A whole tick.
    pub tick: MeasuredRow,
    /// Each call of a module in a tick, in order.
    pub calls: Vec<MeasuredRow>,
    /// Whether instructions are counted: of an emulated board, which has no cycles.
    pub is_instructions: bool,
}

/// What one thing took: cycles of the processor, or instructions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredRow {
    /// Runs that were measured.
    pub runs: u32,
    /// The shortest run.
    pub least: f64,
    /// A run on average.
    pub mean: f64,
    /// The longest run.
    pub greatest: f64,
}

impl MeasuredRow {
    fn new(report: CyclesReport) -> Self {
        let CyclesReport { runs, least, mean, greatest, per_1024_instructions } = report;
        let scale = match per_1024_instructions {
            0 => 1.0,
            counts => 1024.0 / f64::from(counts),
        };
        let scaled = |counts| scale * f64::from(counts);
        Self { runs, least: scaled(least), mean: scaled(mean), greatest: scaled(greatest) }
    }

    /// One after the other.
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
    /// What the device has measured; none when its image does not measure.
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

    /// Has the device forget what it has measured.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer.
    pub fn measure_anew(&mut self) -> Result<(), ConnectError> {
        self.ask_cycles(0, true).map(drop)
    }

    fn ask_cycles(&mut self, place: u8, begins_anew: bool) -> Result<Option<CyclesReport>, ConnectError> {
        self.ask(&Request::Cycles { place, begins_anew }, take!(Cycles))
    }
}
