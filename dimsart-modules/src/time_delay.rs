//! Time delay: gives a signal of any format and shape back a set number of ticks later.
//!
//! The line of `TD_PARAM` times the signal's words is taken from the Data Base when the module is plugged in and
//! gives zero until the first sample comes through, after a reset too. `TD_PARAM 0` hands the signal through.
//! What comes out has the unit, the format and the shape of what goes in.

use dimsart_core::{
    Context, Data, Declare, Input, Memory, Module, Output, Unit, UnitRelation, Untyped, types, words,
};

words! {
    /// Of all axes.
    pub parameters Settings {
        /// Delay; its samples are kept in the Data Base.
        delay_ticks: u32 = structural_count("TD_PARAM", Unit::Tick, 0..=60_000, 0),
    }
    /// Of all axes.
    ///
    /// | Line | `position` | `filled` |
    /// |---|---|---|
    /// | fills up | `FILLING` | where the next sample goes |
    /// | full, one word per axis | where the oldest sample is, and the next one goes | 0 |
    /// | full, any other number of words | `FULL` | where the oldest sample is, and the next one goes |
    pub struct State { position: u16, filled: u16 }
    /// Signals and memory.
    pub ports Ports { input: Input<Untyped>, output: Output<Untyped>, line: Memory }
}

/// Positions outside every line.
const FILLING: u16 = u16::MAX;
const FULL: u16 = u16::MAX - 1;

/// See the [module docs](self).
#[derive(Debug)]
pub struct TimeDelay;

impl Module for TimeDelay {
    const NAME: &'static str = "TIMEDELAY_MOD";
    const SUMMARY: &'static str = "Delays a signal by a number of ticks.";
    type Settings = Settings;
    type Gains = ();
    type State = State;
    type Axis = ();
    type Ports = Ports;

    fn ports(settings: &Settings, declare: &mut Declare<'_>) -> Ports {
        let input = declare.any_type().input("SIGNAL_IN", types::CH1_WAVES);
        let output = declare.any_type().output("SIGNAL_OUT", types::CH1_TD_WAVES);
        declare.tie("SIGNAL_OUT", UnitRelation::Alike, "SIGNAL_IN");
        let ticks = usize::try_from(settings.delay_ticks).unwrap_or(usize::MAX);
        let words = ticks.saturating_mul(declare.words_of("SIGNAL_IN"));
        Ports { input, output, line: declare.memory("LINE", words) }
    }

    /// A reset need not empty the line: nothing of before comes out.
    fn begin(context: &Context<'_, Self>) {
        context.set_state(State { position: FILLING, filled: 0 });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { input, output, line } = context.ports();
        let mut state = context.state();
        let Some(oldest) = context.row(line, state.position) else {
            context.set_state(pass_words(context.data(), context.ports(), state));
            return;
        };
        context.data().map_axes([input.as_vector()], [output.as_vector()], |axis, [sample]| {
            [oldest.get(axis).map_or(0.0, |cell| f32::from_bits(cell.replace(sample.to_bits())))]
        });
        state.position = context.row_after(line, state.position);
        context.set_state(state);
    }
}

/// A tick that has no sample to give back yet, or no line, or whose signal is no vector.
#[cold]
#[inline(never)]
fn pass_words(data: &Data<'_>, Ports { input, output, line }: Ports, mut state: State) -> State {
    let (from, to) = (data.words(input), data.words_out(output));
    let Some((cells, next)) = data.words_at(line, state.filled, from.len()) else {
        from.iter().zip(to).for_each(|(from, to)| to.set(from.get()));
        return state;
    };
    for ((cell, from), to) in cells.iter().zip(from).zip(to) {
        let oldest = cell.replace(from.get());
        to.set(if state.position == FULL { oldest } else { 0 });
    }
    state.filled = next;
    if next == 0 {
        state.position = if from.len() == data.dof() { 0 } else { FULL };
    }
    state
}
