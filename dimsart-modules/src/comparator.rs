//! Comparator with hysteresis for a signal of any unit.
//!
//! `CONDITION` becomes 1 when the signal rises above `LEVEL + HYSTERESIS / 2`, and 0 when it falls below
//! `LEVEL - HYSTERESIS / 2`; in between it keeps its value. `SIDE BELOW` inverts the comparison. `MAGNITUDE` compares
//! the absolute value.
//!
//! Initial state: 0, unless the signal is above the upper threshold.
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
    /// Side of the level on which the condition is 1.
    pub enum Side { Above = "ABOVE", Below = "BELOW" }
}

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Side of the level on which CONDITION is 1.
        side: Side = choice("SIDE"),
        /// Compare the absolute value of the signal.
        is_magnitude: bool = flag("MAGNITUDE", false),
    }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Threshold; centre of the hysteresis band.
        level: f32 = per_axis("LEVEL", Unit::Any, -1e9..=1e9, 0.0),
        /// Width of the hysteresis band around LEVEL.
        hysteresis: f32 = per_axis("HYSTERESIS", Unit::Any, 0.0..=1e9, 0.0),
    }
    /// State of one axis.
    pub struct AxisState { holds: bool }
    /// Ports.
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
    const SUMMARY: &'static str = "Compares a signal with a level, with hysteresis.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
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
