//! Time delay: delays a signal of any format and shape by a number of ticks.
//!
//! The delay line of `TD_PARAM` times the signal's words is allocated in the Data Base at plug-in. After plug-in or
//! reset, the output is zero until the first sample has passed the line. `TD_PARAM 0` passes the signal through. The
//! output has the unit, format and shape of the input.

use dimsart_core::{
    Context, Data, Declarations, Input, Memory, Module, Output, Unit, UnitRelation, Untyped, types, words,
};

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Delay. The module stores one sample per tick of delay.
        delay_ticks: u32 = structural_count("TD_PARAM", Unit::Tick, 0..=60_000, 0),
    }
    /// State common to all axes.
    ///
    /// | Line | `position` | `filled` |
    /// |---|---|---|
    /// | filling | `FILLING` | index of the next sample |
    /// | full, one word per axis | index of the oldest and next sample | 0 |
    /// | full, any other number of words | `FULL` | index of the oldest and next sample |
    pub struct State { position: u16, filled: u16 }
    /// Ports and memory.
    pub ports Ports { input: Input<Untyped>, output: Output<Untyped>, line: Memory }
}

/// Values of `position` that are never indices.
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
    type AxisState = ();
    type Ports = Ports;

    fn ports(settings: &Settings, declare: &mut Declarations<'_>) -> Ports {
        let input = declare.any_type().input("SIGNAL_IN", types::CH1_WAVES);
        let output = declare.any_type().output("SIGNAL_OUT", types::CH1_TD_WAVES);
        declare.constrain_unit("SIGNAL_OUT", UnitRelation::SameType, "SIGNAL_IN");
        let ticks = usize::try_from(settings.delay_ticks).unwrap_or(usize::MAX);
        let words = ticks.saturating_mul(declare.signal_words("SIGNAL_IN"));
        Ports { input, output, line: declare.memory("LINE", words) }
    }

    /// Restarts the filling; old samples in the line are never output.
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
        state.position = context.next_row(line, state.position);
        context.set_state(state);
    }
}

/// Handles the slow cases: the line is filling or has length 0, or the signal is not a vector.
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
