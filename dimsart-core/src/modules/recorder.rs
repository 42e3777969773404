//! Recorder tap: keeps the last rows of a signal, one of every few ticks.
//!
//! Row `n` is at word `(n mod LENGTH) × DoF` of the module's memory, read from outside with
//! [`Engine::memory`](crate::Engine::memory); `RECORDED_ROWS` says how many rows there have been.

use crate::{Data, Input, Memory, Module, Output, Parameters, Ports, Single, Unit, types};

/// See the [module docs](self).
#[derive(Debug, Default)]
pub struct Recorder {
    length: u32,
    every_ticks: u32,
    is_recording: bool,
    input: Input,
    rows_out: Output<Single<u32>>,
    memory: Memory,
    position: u16,
    rows: u32,
    wait_ticks: u32,
}

impl Module for Recorder {
    const NAME: &'static str = "RECORDER_MOD";
    const SUMMARY: &'static str = "Keeps the last rows of a signal to be read out later.";

    fn parameters(&mut self, visit: &mut Parameters<'_>) {
        let Self { length, every_ticks, is_recording, .. } = self;
        visit.structural_count(length, "LENGTH", Unit::One, 1..=60_000, 100, "Rows kept.");
        visit.count(every_ticks, "EVERY", Unit::Tick, 1..=1_000_000, 1, "Ticks from one row to the next.");
        visit.flag(is_recording, "RECORD", true, "Whether rows are taken.");
    }

    fn activate(&mut self, ports: &mut Ports<'_>) {
        ports.input(&mut self.input, "SIGNAL_IN", types::SIGNAL);
        ports.output(&mut self.rows_out, "ROWS", types::RECORDED_ROWS);
        let rows = usize::try_from(self.length).unwrap_or(usize::MAX);
        let words = rows.saturating_mul(ports.device().dof());
        ports.memory(&mut self.memory, "ROWS_KEPT", words);
    }

    fn compute(&mut self, data: &Data<'_>) {
        if self.is_recording && self.wait_ticks == 0 {
            let row = data.row(self.memory, self.position).unwrap_or_default();
            data.map_axes(row, [self.input], [], |cell, [sample]| {
                cell.set(sample.to_bits());
                []
            });
            self.position = data.row_after(self.memory, self.position);
            self.rows = self.rows.wrapping_add(1);
            self.wait_ticks = self.every_ticks;
        }
        self.wait_ticks = self.wait_ticks.saturating_sub(1);
        data.set(self.rows_out, self.rows);
    }

    fn reset(&mut self) {
        self.position = 0;
        self.rows = 0;
        self.wait_ticks = 0;
    }
}
