//! Multiplexer: selects one of up to four signals.
//!
//! Selection 0 outputs `IN1`, 1 `IN2`, and so on up to `COUNT`. The selection is `SELECT`, or `CONDITION` rounded to
//! the nearest integer, per axis (`SELECT_BY`): a condition thus selects one of two signals.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all MUX_MOD SELECT_BY CONDITION\nall MUX_MOD PORT_IN1 FORCE\nall MUX_MOD PORT_IN2 FEED_FORCE
//!             all MOD_ENG MOD_ON MUX_MOD\nall MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::FORCE, types::FEED_FORCE, types::CONDITION], rows)?;
//! assert_eq!(bench.tick(&[3.0, 5.0, 0.0], "SIGNAL_OUT"), Some(3.0));
//! assert_eq!(bench.tick(&[3.0, 5.0, 1.0], "SIGNAL_OUT"), Some(5.0));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use dimsart_core::{Context, Declarations, Input, Module, Output, Unit, UnitRelation, choice, types, words};

choice! {
    /// Source of the selection.
    pub enum SelectionSource { Parameter = "PARAMETER", Condition = "CONDITION" }
}

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Source of the selection: parameter SELECT or port CONDITION.
        select_by: SelectionSource = structural_choice("SELECT_BY"),
        /// Number of inputs.
        count: u32 = structural_count("COUNT", Unit::One, 2..=4, 2),
        /// Index of the selected input, from 0.
        selected: u32 = count("SELECT", Unit::One, 0..=3, 0),
    }
    /// Ports.
    pub ports Ports { inputs: [Input; 4], condition: Input, output: Output }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Mux;

impl Module for Mux {
    const NAME: &'static str = "MUX_MOD";
    const SUMMARY: &'static str = "Multiplexer: selects one of up to four signals.";
    type Settings = Settings;
    type Gains = ();
    type State = ();
    type AxisState = ();
    type Ports = Ports;

    fn ports(settings: &Settings, declare: &mut Declarations<'_>) -> Ports {
        let mut inputs = [Input::default(); 4];
        let count = usize::try_from(settings.count).unwrap_or(0);
        for (input, name) in inputs.iter_mut().zip(["IN1", "IN2", "IN3", "IN4"]).take(count) {
            *input = declare.input(name, types::SIGNAL);
            if name != "IN1" {
                declare.constrain_unit(name, UnitRelation::Same, "IN1");
            }
        }
        let condition = match settings.select_by {
            SelectionSource::Parameter => Input::default(),
            SelectionSource::Condition => declare.input("CONDITION", types::CONDITION),
        };
        let output = declare.output("SIGNAL_OUT", types::SIGNAL_OUT);
        declare.constrain_unit("SIGNAL_OUT", UnitRelation::Same, "IN1");
        Ports { inputs, condition, output }
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { inputs: [first, second, third, fourth], condition, output } = context.ports();
        let Settings { select_by, count, selected } = context.settings();
        context.map_axis_contexts([], [output], |axis, _, []| {
            let selected = match select_by {
                SelectionSource::Parameter => selected,
                SelectionSource::Condition => number(context.axis(condition, axis)),
            };
            let input = match selected.min(count.saturating_sub(1)) {
                0 => first,
                1 => second,
                2 => third,
                _ => fourth,
            };
            [context.axis(input, axis)]
        });
    }
}

/// Rounds to the nearest integer of at least 0; returns 0 for NaN.
#[inline(always)]
pub(super) fn number(condition: f32) -> u32 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
    let number = (condition + 0.5) as u32;
    number
}
