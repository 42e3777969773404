//! Lookup table: piecewise linear function of a signal with up to 16 points.
//!
//! `out = Y_i + (in - X_i) (Y_{i+1} - Y_i) / (X_{i+1} - X_i)` for `X_i <= in < X_{i+1}`; outside the table, the output
//! is that of the first or last point. `X` must rise; two points with the same `X` make a step. The output accepts any
//! unit.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all TABLE_MOD COUNT 2\nall TABLE_MOD X[0][1] 2\nall TABLE_MOD Y[0][1] 10
//!             all MOD_ENG MOD_ON TABLE_MOD\nall MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::SIGNAL], rows)?;
//! assert_eq!([-1.0, 0.5, 3.0].map(|x| bench.tick(&[x], "SIGNAL_OUT")), [0.0, 2.5, 10.0].map(Some));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use dimsart_core::{Context, DeviceDescriptor, Input, Module, Output, Unit, math, types, words};

/// Maximum number of points.
const POINTS: usize = 16;

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Number of points.
        count: u32 = count("COUNT", Unit::One, 1..=16, 1),
    }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Inputs of the points, in rising order.
        x: [f32; POINTS] = per_axis_row("X", Unit::Any, -1e9..=1e9, 0.0),
        /// Outputs of the points.
        y: [f32; POINTS] = per_axis_row("Y", Unit::Any, -1e9..=1e9, 0.0),
        /// Slopes from each point to the next.
        slopes: [f32; POINTS],
    }
    /// Ports.
    pub ports Ports {
        input: Input = input("SIGNAL_IN", types::SIGNAL),
        output: Output = output("SIGNAL_OUT", types::SIGNAL_OUT),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Table;

impl Module for Table {
    const NAME: &'static str = "TABLE_MOD";
    const SUMMARY: &'static str = "Lookup table: piecewise linear function of a signal.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type AxisState = ();
    type Ports = Ports;

    fn prepare_axis(settings: &Settings, gains: &mut Gains, _: &DeviceDescriptor) {
        let count = usize::try_from(settings.count).unwrap_or(POINTS);
        let Gains { x, y, slopes } = gains;
        slopes.fill(0.0);
        let ends = x.iter().zip(y.iter()).take(count).skip(1);
        for ((slope, (from_x, from_y)), (to_x, to_y)) in
            slopes.iter_mut().zip(x.iter().zip(y.iter())).zip(ends)
        {
            let width = to_x - from_x;
            *slope = if width > 0.0 { math::limit((to_y - from_y) / width, 1e30) } else { 0.0 };
        }
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { input, output } = context.ports();
        let count = usize::try_from(context.settings().count).unwrap_or(POINTS);
        context.map_axis_contexts([input], [output], |_, lane, [x]| {
            let word = |place: usize| lane.gain_element(place).unwrap_or(0.0);
            // Below the first point, its value applies.
            let mut found = None;
            for place in 0..POINTS {
                if place < count && x >= word(place) {
                    found = Some(place);
                }
            }
            let place = found.unwrap_or(0);
            let slope = found.map_or(0.0, |place| word(2 * POINTS + place));
            [word(POINTS + place) + (x - word(place)) * slope]
        });
    }
}
