//! Moving average of a signal of any unit.
//!
//! `y = (x + x[k-1] + ... + x[k-N+1]) / N`, `N = WINDOW`; before `N` samples have arrived, their average. Signals with
//! a period of `N` ticks are rejected completely (Smith, *The Scientist and Engineer's Guide to Digital Signal
//! Processing*, chapter 15).
//!
//! The running sum adds the newest sample and subtracts the oldest. It does not drift: a second sum restarts every `N`
//! samples and replaces the first when it is complete.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all MOVING_AVERAGE_MOD WINDOW 2
//!             all MOD_ENG MOD_ON MOVING_AVERAGE_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::SIGNAL], rows)?;
//! let averages = [1.0, 3.0, 5.0].map(|x| bench.tick(&[x], "SIGNAL_OUT"));
//! assert_eq!(averages, [Some(1.0), Some(2.0), Some(4.0)]);
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use crate::filtered::FilterPorts;
use dimsart_core::math::CompensatedSum;
use dimsart_core::{Context, Declarations, Input, Memory, Module, Output, PortSet, Unit, words};

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Number of samples to average, which are stored in the Data Base.
        window_ticks: u32 = structural_count("WINDOW", Unit::Tick, 1..=60_000, 10),
    }
    /// State common to all axes.
    pub struct State {
        /// Index of the next sample in the memory.
        position: u16,
        /// Samples received, at most `WINDOW`.
        samples: u32,
    }
    /// State of one axis.
    pub struct AxisState {
        sum: CompensatedSum,
        /// Sum of the samples since the memory wrapped.
        fresh_sum: CompensatedSum,
    }
    /// Ports and memory.
    pub ports Ports { input: Input, output: Output, window: Memory }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct MovingAverage;

impl Module for MovingAverage {
    const NAME: &'static str = "MOVING_AVERAGE_MOD";
    const SUMMARY: &'static str = "Moving average of the last samples of a signal.";
    type Settings = Settings;
    type Gains = ();
    type State = State;
    type AxisState = AxisState;
    type Ports = Ports;

    fn ports(settings: &Settings, declare: &mut Declarations<'_>) -> Ports {
        let FilterPorts { input, output } = FilterPorts::declare(declare);
        let ticks = usize::try_from(settings.window_ticks).unwrap_or(usize::MAX);
        let words = ticks.saturating_mul(declare.signal_words("SIGNAL_IN"));
        Ports { input, output, window: declare.memory("WINDOW", words) }
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { input, output, window } = context.ports();
        let State { position, samples } = context.state();
        let Some((row, next)) = context.words_at(window, position, context.dof()) else { return };
        let is_full = samples == context.settings().window_ticks;
        let samples = if is_full { samples } else { samples + 1 };
        #[expect(clippy::cast_precision_loss, reason = "at most 60 000")]
        let scale = 1.0 / samples as f32;
        context.map_axis_contexts([input], [output], |number, lane, [x]| {
            let mut axis = lane.axis();
            let oldest = row.get(number).map_or(0, |cell| cell.replace(x.to_bits()));
            axis.sum.add(x);
            if is_full {
                axis.sum.add(-f32::from_bits(oldest));
            }
            axis.fresh_sum.add(x);
            if next == 0 {
                axis = AxisState { sum: axis.fresh_sum, fresh_sum: CompensatedSum::default() };
            }
            lane.set_axis(axis);
            [axis.sum.value() * scale]
        });
        context.set_state(State { position: next, samples });
    }
}
