//! Recorder: keeps the last rows of a signal of any format and shape, one row every few ticks.
//!
//! A row is the signal's words. Row `n` starts at word `(n mod LENGTH) × words of the signal` of the module's memory,
//! which [`Engine::memory`](dimsart_core::Engine::memory) reads; `RECORDED_ROWS` is the number of rows recorded.
//!
//! With a `TRIGGER`, the recorder compares word `WORD` of the signal with `LEVEL` in every tick. It fires on a
//! crossing; a signal already past the level at the start fires only with `AT_ONCE`. It then records `AFTER` rows after
//! the triggering row, so the other `LENGTH` less `AFTER` rows precede the event, and keeps them until reset. A second
//! memory holds the number of the triggering row, from 1; 0 before. A fast event is thus captured in its tick and read
//! later over a slow link. Words of other formats are compared by their bits as `f32`: a switch fires above 0.
//! `TRIGGER CONDITION` compares axis `WORD` of the port `CONDITION` instead.

use dimsart_core::{
    Context, Declarations, Input, Memory, Module, Output, ScalarSignal, Unit, Untyped, choice, types, words,
};

choice! {
    /// Trigger of the recording.
    pub enum Trigger { Off = "OFF", Rising = "RISING", Falling = "FALLING", Condition = "CONDITION" }
}

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Number of rows stored.
        length: u32 = structural_count("LENGTH", Unit::One, 1..=60_000, 100),
        /// Ticks per row.
        every_ticks: u32 = count("EVERY", Unit::Tick, 1..=1_000_000, 1),
        /// Record rows.
        is_recording: bool = flag("RECORD", true),
        /// Trigger; OFF records continuously.
        trigger: Trigger = structural_choice("TRIGGER"),
        /// Signal level of the trigger.
        level: f32 = real("LEVEL", Unit::Any, f32::MIN..=f32::MAX, 0.0),
        /// Index of the signal's word, or axis of CONDITION, that triggers.
        word: u32 = count("WORD", Unit::One, 0..=4095, 0),
        /// Rows recorded after the trigger.
        rows_after: u32 = count("AFTER", Unit::One, 0..=60_000, 50),
        /// Trigger immediately if the signal is past LEVEL at the start.
        is_level: bool = flag("AT_ONCE", false),
    }
    /// State common to all axes.
    pub struct State {
        /// Index of the next row in the memory.
        position: u16,
        rows: u32,
        wait_ticks: u32,
        /// Whether the trigger is armed: the word was on the other side of the level.
        is_ready: bool,
        /// Number of the triggering row, from 1.
        caught: u32,
    }
    /// Ports and memory.
    pub ports Ports {
        input: Input<Untyped>,
        rows: Output<ScalarSignal<u32>>,
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
    const SUMMARY: &'static str = "Records the last rows of a signal, optionally with a trigger.";
    const KEEPS_STATE_ON_ARMING: bool = true;
    type Settings = Settings;
    type Gains = ();
    type State = State;
    type AxisState = ();
    type Ports = Ports;

    fn ports(settings: &Settings, declare: &mut Declarations<'_>) -> Ports {
        let rows = usize::try_from(settings.length).unwrap_or(usize::MAX);
        let input = declare.any_type().input("SIGNAL_IN", types::SIGNAL);
        let words = rows.saturating_mul(declare.signal_words("SIGNAL_IN"));
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
        // Rows recorded from the triggering row on.
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

/// Publishes the number of the triggering row in the second memory.
fn note(context: &Context<'_, Recorder>, caught: u32) {
    if let Some(([word], _)) = context.words_at(context.ports().caught, 0, 1) {
        word.set(caught);
    }
}
