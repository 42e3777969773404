//! Recorder tap: keeps the last rows of a signal of any format and shape, one of every few ticks.
//!
//! A row is the signal's words. Row `n` begins at word `(n mod LENGTH) × words of the signal` of the module's memory,
//! read from outside with [`Engine::memory`](dimsart_core::Engine::memory); `RECORDED_ROWS` says how many rows there have
//! been.
//!
//! With a `TRIGGER` it waits for word `WORD` of the signal, in every tick, to go beyond `LEVEL` after it was not, takes
//! `AFTER` rows behind the one that caught it, and keeps them until it is reset. Its second memory is the number of that row,
//! from 1; 0 before. So a fast event is caught in its tick and read over a slow line. What is no real number has its bits
//! compared as if it were one: a switch goes beyond 0. `TRIGGER CONDITION` waits in the same way for axis `WORD` of a condition
//! beside the signal, and with `AT_ONCE` what is beyond the level from the start is caught, too. So `LENGTH` less `AFTER` rows are
//! from before the event.

use dimsart_core::{
    Context, Declare, Input, Memory, Module, Output, Single, Unit, Untyped, choice, types, words,
};

choice! {
    /// What ends the recording.
    pub enum Trigger { Off = "OFF", Rising = "RISING", Falling = "FALLING", Condition = "CONDITION" }
}

words! {
    /// Of all axes.
    pub parameters Settings {
        /// Rows kept.
        length: u32 = structural_count("LENGTH", Unit::One, 1..=60_000, 100),
        /// Ticks from one row to the next.
        every_ticks: u32 = count("EVERY", Unit::Tick, 1..=1_000_000, 1),
        /// Whether rows are taken.
        is_recording: bool = flag("RECORD", true),
        /// What it keeps: the last rows, or those around an edge.
        trigger: Trigger = structural_choice("TRIGGER"),
        /// What the edge goes beyond.
        level: f32 = real("LEVEL", Unit::Any, f32::MIN..=f32::MAX, 0.0),
        /// Word of the signal that has the edge.
        word: u32 = count("WORD", Unit::One, 0..=4095, 0),
        /// Rows taken behind the edge.
        rows_after: u32 = count("AFTER", Unit::One, 0..=60_000, 50),
        /// Whether what is beyond the level from the start is caught.
        is_level: bool = flag("AT_ONCE", false),
    }
    /// Of all axes.
    pub struct State {
        /// Where the next row goes.
        position: u16,
        rows: u32,
        wait_ticks: u32,
        /// Whether the word was on the other side of the level.
        is_ready: bool,
        /// Number of the row that caught it, from 1.
        caught: u32,
    }
    /// Signals and memory.
    pub ports Ports {
        input: Input<Untyped>,
        rows: Output<Single<u32>>,
        memory: Memory,
        caught: Memory,
        condition: Input,
    }
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

    fn ports(settings: &Settings, declare: &mut Declare<'_>) -> Ports {
        let rows = usize::try_from(settings.length).unwrap_or(usize::MAX);
        let input = declare.any_type().input("SIGNAL_IN", types::SIGNAL);
        let words = rows.saturating_mul(declare.words_of("SIGNAL_IN"));
        Ports {
            input,
            rows: declare.output("ROWS", types::RECORDED_ROWS),
            memory: declare.memory("ROWS_KEPT", words),
            caught: declare.memory("CAUGHT", 1),
            condition: match settings.trigger {
                Trigger::Condition => declare.input("CONDITION", types::CONDITION),
                _ => Input::default(),
            },
        }
    }

    fn begin(context: &Context<'_, Self>) {
        context.set_state(State { is_ready: context.settings().is_level, ..State::default() });
        note(context, 0);
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { input, rows, memory, condition, .. } = context.ports();
        let settings = context.settings();
        let mut state = context.state();
        let sample = context.words(input);
        if settings.trigger != Trigger::Off && state.caught == 0 {
            let watched = match settings.trigger {
                Trigger::Condition => context.words(condition),
                _ => sample,
            };
            let word = usize::try_from(settings.word).ok().and_then(|word| watched.get(word));
            let value = word.map_or(f32::NAN, |word| f32::from_bits(word.get()));
            let is_beyond = match settings.trigger {
                Trigger::Falling => value < settings.level,
                _ => value > settings.level,
            };
            if is_beyond && state.is_ready {
                state.caught = state.rows.wrapping_add(1);
                note(context, state.caught);
            }
            state.is_ready = !is_beyond;
        }
        // The row that caught it is still to be taken, and those behind it.
        let taken = state.rows.wrapping_sub(state.caught).wrapping_add(1);
        let is_full = state.caught > 0 && taken > settings.rows_after;
        if settings.is_recording && state.wait_ticks == 0 && !is_full {
            if let Some((row, next)) = context.words_at(memory, state.position, sample.len()) {
                row.iter().zip(sample).for_each(|(cell, word)| cell.set(word.get()));
                state.position = next;
            }
            state.rows = state.rows.wrapping_add(1);
            state.wait_ticks = settings.every_ticks;
        }
        state.wait_ticks = state.wait_ticks.saturating_sub(1);
        context.set(rows, state.rows);
        context.set_state(state);
    }
}

/// Tells who reads it from outside.
fn note(context: &Context<'_, Recorder>, caught: u32) {
    if let Some(([word], _)) = context.words_at(context.ports().caught, 0, 1) {
        word.set(caught);
    }
}
