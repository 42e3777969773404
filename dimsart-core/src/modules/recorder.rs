//! Recorder tap: keeps the last rows of a signal of any format and shape, one of every few ticks.
//!
//! A row is the signal's words. Row `n` begins at word `(n mod LENGTH) × words of the signal` of the module's memory,
//! read from outside with [`Engine::memory`](crate::Engine::memory); `RECORDED_ROWS` says how many rows there have
//! been.

use crate::{
    Context, Declare, Input, Memory, Module, Output, Parameters, Single, Unit, Untyped, types, words,
};

words! {
    /// Of all axes.
    pub struct Settings { length: u32, every_ticks: u32, is_recording: bool }
    /// Of all axes.
    pub struct State {
        /// Where the next row goes.
        position: u16,
        rows: u32,
        wait_ticks: u32,
    }
    /// Signals and memory.
    pub struct Ports { input: Input<Untyped>, rows: Output<Single<u32>>, memory: Memory }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Recorder;

impl Module for Recorder {
    const NAME: &'static str = "RECORDER_MOD";
    const SUMMARY: &'static str = "Keeps the last rows of a signal to be read out later.";
    const OUTLASTS_ARMING: bool = true;
    type Settings = Settings;
    type Gains = ();
    type State = State;
    type Axis = ();
    type Ports = Ports;

    fn parameters(settings: &mut Settings, _: &mut (), visit: &mut Parameters<'_>) {
        let Settings { length, every_ticks, is_recording } = settings;
        visit.structural_count(length, "LENGTH", Unit::One, 1..=60_000, 100, "Rows kept.");
        visit.count(every_ticks, "EVERY", Unit::Tick, 1..=1_000_000, 1, "Ticks from one row to the next.");
        visit.flag(is_recording, "RECORD", true, "Whether rows are taken.");
    }

    fn ports(settings: &Settings, declare: &mut Declare<'_>) -> Ports {
        let rows = usize::try_from(settings.length).unwrap_or(usize::MAX);
        let input = declare.any_type().input("SIGNAL_IN", types::SIGNAL);
        let words = rows.saturating_mul(declare.words_of("SIGNAL_IN"));
        Ports {
            input,
            rows: declare.output("ROWS", types::RECORDED_ROWS),
            memory: declare.memory("ROWS_KEPT", words),
        }
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { input, rows, memory } = context.ports();
        let mut state = context.state();
        if context.settings().is_recording && state.wait_ticks == 0 {
            let sample = context.words(input);
            if let Some((row, next)) = context.words_at(memory, state.position, sample.len()) {
                row.iter().zip(sample).for_each(|(cell, word)| cell.set(word.get()));
                state.position = next;
            }
            state.rows = state.rows.wrapping_add(1);
            state.wait_ticks = context.settings().every_ticks;
        }
        state.wait_ticks = state.wait_ticks.saturating_sub(1);
        context.set(rows, state.rows);
        context.set_state(state);
    }
}
