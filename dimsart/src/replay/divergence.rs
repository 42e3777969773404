//! Where a recording and the core part.

use std::fmt;

use dimsart_core::Direction;
use serde::Serialize;

use super::layout::Other;
use hil_sim::rig::SimulatedDimsart;

/// A word that the core makes otherwise.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Divergence {
    /// The tick, from 0: the first one that was recorded.
    pub tick: u64,
    /// Its time, `s`.
    pub time_s: f64,
    /// The signal.
    pub signal: String,
    /// Which of its words, from 0.
    pub word: usize,
    /// The module that writes it; none for what the device measured, or what is not written here.
    pub module: Option<String>,
    /// The word as it was recorded.
    pub recorded: f64,
    /// As it is made here.
    pub replayed: f64,
}

impl fmt::Display for Divergence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { tick, time_s, signal, word, module, recorded, replayed } = self;
        write!(f, "tick {tick} ({time_s} s): {signal}[{word}]")?;
        match module {
            Some(module) => write!(f, " of {module}")?,
            None => write!(f, ", which no module writes here,")?,
        }
        write!(f, " was recorded as {recorded:?}, and is {replayed:?}")
    }
}

impl Divergence {
    /// Of several words in a tick, the one that is computed first: the others may follow from it.
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
        // What the device measured comes before every step.
        let (place, Other { signal, word, recorded, replayed }) = found.min_by_key(|(place, _)| *place)?;
        let module = place
            .and_then(|place| steps.get(place))
            .map(|step| engine.kinds().module_name(step.module).to_string());
        Some(Self { tick, time_s, signal, word, module, recorded, replayed })
    }
}
