//! Demultiplexer: routes a signal to one of up to four outputs.
//!
//! Selection 0 routes it to `OUT1`, 1 to `OUT2`, and so on up to `COUNT`; the other outputs are 0, or keep their value
//! with `HOLD`. The selection is `SELECT`, or `CONDITION` rounded to the nearest integer, per axis (`SELECT_BY`).
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all DEMUX_MOD SELECT_BY CONDITION\nall MOD_ENG MOD_ON DEMUX_MOD\nall MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::SIGNAL, types::CONDITION], rows)?;
//! assert_eq!(bench.tick(&[3.0, 1.0], "SIGNAL_OUT.2"), Some(3.0));
//! assert_eq!(bench.tick(&[3.0, 0.0], "SIGNAL_OUT.2"), Some(0.0));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use crate::mux::{SelectionSource, number};
use dimsart_core::{Context, Declarations, Input, Module, Output, Unit, UnitRelation, types, words};

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Source of the selection: parameter SELECT or port CONDITION.
        select_by: SelectionSource = structural_choice("SELECT_BY"),
        /// Number of outputs.
        count: u32 = structural_count("COUNT", Unit::One, 2..=4, 2),
        /// Index of the selected output, from 0.
        selected: u32 = count("SELECT", Unit::One, 0..=3, 0),
        /// Outputs that are not selected keep their value instead of 0.
        holds: bool = flag("HOLD", false),
    }
    /// State of one axis: the last value of each output.
    pub struct AxisState { outputs: [f32; 4] }
    /// Ports.
    pub ports Ports { input: Input, condition: Input, outputs: [Output; 4] }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Demux;

impl Module for Demux {
    const NAME: &'static str = "DEMUX_MOD";
    const SUMMARY: &'static str = "Demultiplexer: routes a signal to one of up to four outputs.";
    type Settings = Settings;
    type Gains = ();
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn ports(settings: &Settings, declare: &mut Declarations<'_>) -> Ports {
        let input = declare.input("SIGNAL_IN", types::SIGNAL);
        let condition = match settings.select_by {
            SelectionSource::Parameter => Input::default(),
            SelectionSource::Condition => declare.input("CONDITION", types::CONDITION),
        };
        let mut outputs = [Output::default(); 4];
        let count = usize::try_from(settings.count).unwrap_or(0);
        for ((output, name), number) in
            outputs.iter_mut().zip(["OUT1", "OUT2", "OUT3", "OUT4"]).zip(1..).take(count)
        {
            let signal = types::SIGNAL_OUT.instance(number);
            *output = declare.default_signal(signal).output(name, types::SIGNAL_OUT);
            declare.constrain_unit(name, UnitRelation::Same, "SIGNAL_IN");
        }
        Ports { input, condition, outputs }
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { input, condition, outputs } = context.ports();
        let Settings { select_by, count, selected, holds } = context.settings();
        context.map_axis_contexts([input], [], |axis, lane, [x]| {
            let selected = match select_by {
                SelectionSource::Parameter => selected,
                SelectionSource::Condition => number(context.axis(condition, axis)),
            };
            let selected = selected.min(count.saturating_sub(1));
            let mut values = lane.axis().outputs;
            for ((value, output), number) in values.iter_mut().zip(outputs).zip(0..) {
                if number == selected {
                    *value = x;
                } else if !holds {
                    *value = 0.0;
                }
                if number < count {
                    context.set_axis(output, axis, *value);
                }
            }
            lane.set_axis(AxisState { outputs: values });
            []
        });
    }
}
