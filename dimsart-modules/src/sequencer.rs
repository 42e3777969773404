//! Sequencer: a state machine of up to eight states with one output each and transitions by conditions and time.
//!
//! In state `i`, `SIGNAL_OUT` is `OUTPUT[axis][i]`. The next state is `IF_A[axis][i]` if `A` is above 0.5, else
//! `IF_B[axis][i]` if `B` is above 0.5, else `THEN[axis][i]` after `AFTER[axis][i]` seconds; -1 disables the
//! transition. There is at most one transition per tick; the output changes in the same tick. The axes are independent.
//!
//! Initial state: 0.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! // 2 until A is true, then 5 for 2 ms.
//! let rows = "all SEQUENCE_MOD OUTPUT[0][0] 2\nall SEQUENCE_MOD OUTPUT[0][1] 5\nall SEQUENCE_MOD IF_A[0][0] 1
//!             all SEQUENCE_MOD AFTER[0][1] 0.002\nall SEQUENCE_MOD THEN[0][1] 0
//!             all SEQUENCE_MOD PORT_B CONDITION\nall MOD_ENG MOD_ON SEQUENCE_MOD\nall MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::CONDITION], rows)?;
//! let outputs = [0.0, 1.0, 0.0, 0.0].map(|a| bench.tick(&[a], "SIGNAL_OUT"));
//! assert_eq!(outputs, [2.0, 5.0, 5.0, 2.0].map(Some));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use dimsart_core::{Context, Declarations, DeviceDescriptor, Input, Module, Output, Unit, types, words};

/// Maximum number of states.
const STATES: usize = 8;

words! {
    /// Parameters common to all axes.
    pub parameters Settings { period_s: f32 }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Output of each state.
        outputs: [f32; STATES] = per_axis_row("OUTPUT", Unit::Any, -1e9..=1e9, 0.0),
        /// Next state of each state if A is true; -1: no transition.
        if_a: [f32; STATES] = per_axis_row("IF_A", Unit::One, -1.0..=7.0, -1.0),
        /// Next state of each state if B is true; -1: no transition.
        if_b: [f32; STATES] = per_axis_row("IF_B", Unit::One, -1.0..=7.0, -1.0),
        /// Next state of each state after AFTER; -1: no transition.
        then: [f32; STATES] = per_axis_row("THEN", Unit::One, -1.0..=7.0, -1.0),
        /// Duration of each state until the transition to THEN.
        after_s: [f32; STATES] = per_axis_row("AFTER", Unit::Second, 0.0..=1e4, 1.0),
    }
    /// State of one axis.
    pub struct AxisState { state: u16, ticks: u32 }
    /// Ports.
    pub ports Ports { a: Input, b: Input, output: Output, state: Output }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Sequencer;

impl Module for Sequencer {
    const NAME: &'static str = "SEQUENCE_MOD";
    const SUMMARY: &'static str = "Sequencer: up to eight states with transitions by condition and time.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.period_s = device.sample_period_s();
    }

    fn ports(_: &Settings, declare: &mut Declarations<'_>) -> Ports {
        let second = types::CONDITION.instance(2);
        Ports {
            a: declare.input("A", types::CONDITION),
            b: declare.default_signal(second).input("B", types::CONDITION),
            output: declare.output("SIGNAL_OUT", types::SIGNAL_OUT),
            state: declare.output("STATE", types::STATE),
        }
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { a, b, output, state } = context.ports();
        let Settings { period_s } = context.settings();
        context.map_axis_contexts([a, b], [output, state], |_, lane, [a, b]| {
            let mut axis = lane.axis();
            #[expect(clippy::cast_precision_loss, reason = "exact for hours")]
            let time_s = axis.ticks as f32 * period_s;
            // Rows in the order of the parameters.
            let of = |row: usize, state: u16| {
                let state = Some(usize::from(state)).filter(|state| *state < STATES);
                state.and_then(|state| lane.gain_element(row * STATES + state))
            };
            let [if_a, if_b, then] = [1, 2, 3].map(|row| of(row, axis.state).unwrap_or(-1.0));
            let next = if a > 0.5 && if_a >= 0.0 {
                if_a
            } else if b > 0.5 && if_b >= 0.0 {
                if_b
            } else if time_s + 0.5 * period_s >= of(4, axis.state).unwrap_or(-1.0) {
                then
            } else {
                -1.0
            };
            axis.ticks = axis.ticks.saturating_add(1);
            if next >= 0.0 {
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 7")]
                let number = (next + 0.5) as u16;
                axis = AxisState { state: number, ticks: 1 };
            }
            lane.set_axis(axis);
            let output: f32 = of(0, axis.state).unwrap_or(0.0);
            [output, f32::from(axis.state)]
        });
    }
}
