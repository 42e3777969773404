//! First difference between a recording and its replay.

use std::fmt;

use dimsart_core::Direction;
use serde::Serialize;

use super::layout::Other;
use hil_sim::rig::SimulatedDimsart;

/// A word whose replayed value differs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Divergence {
    /// Tick; 0 is the first recorded tick.
    pub tick: u64,
    /// Time, `s`.
    pub time_s: f64,
    /// Signal.
    pub signal: String,
    /// Word of the signal, from 0.
    pub word: usize,
    /// Module that writes it; `None` for a measurement, or a signal that no module writes in the replay.
    pub module: Option<String>,
    /// Recorded value.
    pub recorded: f64,
    /// Replayed value.
    pub replayed: f64,
}

impl fmt::Display for Divergence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { tick, time_s, signal, word, module, recorded, replayed } = self;
        write!(f, "tick {tick} ({time_s} s): {signal}[{word}]")?;
        match module {
            Some(module) => write!(f, " of {module}")?,
            None => write!(f, ", which no module writes,")?,
        }
        write!(f, " was recorded as {recorded:?}, replay computes {replayed:?}")
    }
}

impl Divergence {
    /// Selects the difference that is computed first in a tick: the others may result from it.
    pub(super) fn first(
        dimsart: &SimulatedDimsart,
        tick: u64,
        time_s: f64,
        others: Vec<Other>,
    ) -> Option<Self> {
        let engine = dimsart.engine();
        let steps: Vec<_> = engine.steps().collect();
        let writer = |other: &Other| {
            let signal = engine.device().signal(&other.signal)?;
            let writes = (signal, Direction::Write);
            steps.iter().position(|step| engine.step_signals(*step).any(|found| found == writes))
        };
        let found = others.into_iter().map(|other| (writer(&other), other));
        // Measurements precede all steps.
        let (place, Other { signal, word, recorded, replayed }) = found.min_by_key(|(place, _)| *place)?;
        let module = place
            .and_then(|place| steps.get(place))
            .map(|step| engine.kinds().module_name(step.module).to_string());
        Some(Self { tick, time_s, signal, word, module, recorded, replayed })
    }
}
