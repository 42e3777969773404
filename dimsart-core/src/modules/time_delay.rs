//! Time delay: gives a signal back a set number of ticks later.
//!
//! The line of `TD_PARAM × DoF` words is taken from the Data Base when the module is plugged in and
//! reads zero until the first sample comes through. `TD_PARAM 0` hands the signal through.

use crate::{Data, Input, Memory, Module, Output, Parameters, Ports, Unit, types};

/// See the [module docs](self).
#[derive(Debug, Default)]
pub struct TimeDelay {
    delay_ticks: u32,
    input: Input,
    output: Output,
    line: Memory,
    position: usize,
}

impl Module for TimeDelay {
    const NAME: &'static str = "TIMEDELAY_MOD";
    const SUMMARY: &'static str = "Delays a signal by a number of ticks.";

    fn parameters(&mut self, visit: &mut Parameters<'_>) {
        let summary = "Delay; its samples are kept in the Data Base.";
        visit.structural_count(&mut self.delay_ticks, "TD_PARAM", Unit::Tick, 0..=60_000, 0, summary);
    }

    fn activate(&mut self, ports: &mut Ports<'_>) {
        ports.input(&mut self.input, "SIGNAL_IN", types::CH1_WAVES);
        ports.output(&mut self.output, "SIGNAL_OUT", types::CH1_TD_WAVES);
        let ticks = usize::try_from(self.delay_ticks).unwrap_or(usize::MAX);
        let words = ticks.saturating_mul(ports.device().dof());
        ports.memory(&mut self.line, "LINE", words);
    }

    fn compute(&mut self, data: &Data<'_>) {
        let (inputs, outputs) = (data.words(self.input), data.words_out(self.output));
        let line = data.memory(self.line);
        if line.is_empty() {
            for (input, output) in inputs.iter().zip(outputs) {
                output.set(input.get());
            }
            return;
        }
        let oldest = line.get(self.position..).unwrap_or_default();
        for ((input, output), cell) in inputs.iter().zip(outputs).zip(oldest) {
            output.set(cell.replace(input.get()));
        }
        self.position += inputs.len();
        if self.position >= line.len() {
            self.position = 0;
        }
    }

    fn reset(&mut self) {
        self.position = 0;
    }
}
