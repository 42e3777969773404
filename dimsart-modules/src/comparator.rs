//! Comparator with hysteresis: says whether a signal of any unit is beyond a level.
//!
//! `CONDITION` becomes 1 where the signal is above `LEVEL + HYSTERESIS / 2`, and 0 where it is below `LEVEL - HYSTERESIS / 2`;
//! between them it stays. `BELOW` compares the other way round. `MAGNITUDE` compares what the signal is without its sign.
//!
//! It begins with 0, unless the signal is beyond the upper level.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all COMPARE_MOD LEVEL 1\nall COMPARE_MOD HYSTERESIS 0.5
//!             all MOD_ENG MOD_ON COMPARE_MOD\nall MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::SIGNAL], rows)?;
//! assert_eq!([1.1, 1.3, 0.9, 0.7].map(|x| bench.tick(&[x], "CONDITION")), [0.0, 1.0, 1.0, 0.0].map(Some));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use dimsart_core::{Context, Input, Module, Output, Unit, choice, types, words};

choice! {
    /// On which side of the level the condition holds.
    pub enum Side { Above = "ABOVE", Below = "BELOW" }
}

words! {
    /// Of all axes.
    pub parameters Settings {
        /// Where the condition holds.
        side: Side = choice("SIDE"),
        /// Whether the sign of the signal does not count.
        is_magnitude: bool = flag("MAGNITUDE", false),
    }
    /// Of an axis.
    pub parameters Gains {
        /// Middle of the two levels.
        level: f32 = per_axis("LEVEL", Unit::Any, -1e9..=1e9, 0.0),
        /// From the lower level to the upper one.
        hysteresis: f32 = per_axis("HYSTERESIS", Unit::Any, 0.0..=1e9, 0.0),
    }
    /// Of an axis.
    pub struct Axis { holds: bool }
    /// Signals.
    pub ports Ports {
        input: Input = input("SIGNAL_IN", types::SIGNAL),
        condition: Output = output("CONDITION", types::CONDITION),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Comparator;

impl Module for Comparator {
    const NAME: &'static str = "COMPARE_MOD";
    const SUMMARY: &'static str = "Says whether a signal is beyond a level, with hysteresis.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type Axis = Axis;
    type Ports = Ports;

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { input, condition } = context.ports();
        let Settings { side, is_magnitude } = context.settings();
        context.map_axes([input], [condition], |gains, axis, [x]| {
            let beyond = (if is_magnitude { x.abs() } else { x }) - gains.level;
            let beyond = if side == Side::Above { beyond } else { -beyond };
            let half = 0.5 * gains.hysteresis;
            axis.holds = if axis.holds { beyond >= -half } else { beyond > half };
            [f32::from(u8::from(axis.holds))]
        });
    }
}
