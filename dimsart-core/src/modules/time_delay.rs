//! Time delay: gives a signal back a set number of ticks later.
//!
//! The line of `TD_PARAM × DoF` words is taken from the Data Base when the module is plugged in and
//! reads zero until the first sample comes through. `TD_PARAM 0` hands the signal through.

use crate::{Data, Input, Memory, Module, Output, Parameters, Ports, Unit, limits::MAX_DOF, types};

/// See the [module docs](self).
#[derive(Debug, Default)]
pub struct TimeDelay {
    delay_ticks: u32,
    input: Input,
    output: Output,
    line: Memory,
    position: u16,
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
        let Some(oldest) = data.row(self.line, self.position) else {
            // No delay, no line.
            data.map_axes([(); MAX_DOF], [self.input], [self.output], |(), [sample]| [sample]);
            return;
        };
        data.map_axes(oldest, [self.input], [self.output], |cell, [sample]| {
            [f32::from_bits(cell.replace(sample.to_bits()))]
        });
        self.position = data.row_after(self.line, self.position);
    }

    fn reset(&mut self) {
        self.position = 0;
    }
}
