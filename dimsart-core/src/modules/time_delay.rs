//! Time delay: gives a signal back a set number of ticks later.
//!
//! The line of `TD_PARAM × DoF` words is taken from the Data Base when the module is plugged in and
//! gives zero until the first sample comes through, after a reset too. `TD_PARAM 0` hands the signal through.

use crate::{
    Data, Input, Memory, Module, Output, Parameters, Ports, Unit, UnitRelation, limits::MAX_DOF, types,
};

/// See the [module docs](self).
#[derive(Debug, Default)]
pub struct TimeDelay {
    delay_ticks: u32,
    input: Input,
    output: Output,
    line: Memory,
    /// Where the oldest sample is; [`FILLING`] until there is one.
    position: u16,
    /// Where the next sample goes while the line fills.
    filled: u16,
}

/// A position outside every line.
const FILLING: u16 = u16::MAX;

impl Module for TimeDelay {
    const NAME: &'static str = "TIMEDELAY_MOD";
    const SUMMARY: &'static str = "Delays a signal by a number of ticks.";

    fn parameters(&mut self, visit: &mut Parameters<'_>) {
        let summary = "Delay; its samples are kept in the Data Base.";
        visit.structural_count(&mut self.delay_ticks, "TD_PARAM", Unit::Tick, 0..=60_000, 0, summary);
    }

    fn activate(&mut self, ports: &mut Ports<'_>) {
        ports.any_input(&mut self.input, "SIGNAL_IN", types::CH1_WAVES);
        ports.any_output(&mut self.output, "SIGNAL_OUT", types::CH1_TD_WAVES);
        ports.tie("SIGNAL_OUT", UnitRelation::Same, "SIGNAL_IN");
        let ticks = usize::try_from(self.delay_ticks).unwrap_or(usize::MAX);
        let words = ticks.saturating_mul(ports.device().dof());
        ports.memory(&mut self.line, "LINE", words);
    }

    fn compute(&mut self, data: &Data<'_>) {
        let Some(oldest) = data.row(self.line, self.position) else {
            self.fill(data);
            return;
        };
        data.map_axes(oldest, [self.input], [self.output], |cell, [sample]| {
            [f32::from_bits(cell.replace(sample.to_bits()))]
        });
        self.position = data.row_after(self.line, self.position);
    }

    fn reset(&mut self) {
        self.position = FILLING;
        self.filled = 0;
    }
}

impl TimeDelay {
    /// A tick that has no sample to give back yet, or no line. So that a reset need not empty the line.
    #[cold]
    fn fill(&mut self, data: &Data<'_>) {
        let Some(cells) = data.row(self.line, self.filled) else {
            data.map_axes([(); MAX_DOF], [self.input], [self.output], |(), [sample]| [sample]);
            return;
        };
        data.map_axes(cells, [self.input], [self.output], |cell, [sample]| {
            cell.set(sample.to_bits());
            [0.0]
        });
        self.filled = data.row_after(self.line, self.filled);
        if self.filled == 0 {
            self.position = 0;
        }
    }
}
