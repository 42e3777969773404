//! Time delay: gives a signal back a set number of ticks later.
//!
//! The line of `TD_PARAM × DoF` words is taken from the Data Base when the module is plugged in and
//! gives zero until the first sample comes through, after a reset too. `TD_PARAM 0` hands the signal through.

use crate::{Context, Declare, Input, Memory, Module, Output, Parameters, Unit, UnitRelation, types, words};

words! {
    /// Of all axes.
    pub struct Settings { delay_ticks: u32 }
    /// Of all axes.
    pub struct State {
        /// Where the oldest sample is; [`FILLING`] until there is one.
        position: u16,
        /// Where the next sample goes while the line fills.
        filled: u16,
    }
    /// Signals and memory.
    pub struct Ports { input: Input, output: Output, line: Memory }
}

/// A position outside every line.
const FILLING: u16 = u16::MAX;

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

    fn parameters(settings: &mut Settings, _: &mut (), visit: &mut Parameters<'_>) {
        let summary = "Delay; its samples are kept in the Data Base.";
        visit.structural_count(&mut settings.delay_ticks, "TD_PARAM", Unit::Tick, 0..=60_000, 0, summary);
    }

    fn ports(settings: &Settings, declare: &mut Declare<'_>) -> Ports {
        let input = declare.any_unit().input("SIGNAL_IN", types::CH1_WAVES);
        let output = declare.any_unit().output("SIGNAL_OUT", types::CH1_TD_WAVES);
        declare.tie("SIGNAL_OUT", UnitRelation::Same, "SIGNAL_IN");
        let ticks = usize::try_from(settings.delay_ticks).unwrap_or(usize::MAX);
        let words = ticks.saturating_mul(declare.device().dof());
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
            fill(context);
            return;
        };
        context.data().map_axes([input], [output], |axis, [sample]| {
            [oldest.get(axis).map_or(0.0, |cell| f32::from_bits(cell.replace(sample.to_bits())))]
        });
        state.position = context.row_after(line, state.position);
        context.set_state(state);
    }
}

/// A tick that has no sample to give back yet, or no line.
#[cold]
fn fill(context: &Context<'_, TimeDelay>) {
    let Ports { input, output, line } = context.ports();
    let mut state = context.state();
    let Some(cells) = context.row(line, state.filled) else {
        context.data().map_axes([input], [output], |_, [sample]| [sample]);
        return;
    };
    context.data().map_axes([input], [output], |axis, [sample]| {
        if let Some(cell) = cells.get(axis) {
            cell.set(sample.to_bits());
        }
        [0.0]
    });
    state.filled = context.row_after(line, state.filled);
    if state.filled == 0 {
        state.position = 0;
    }
    context.set_state(state);
}
