//! Chirp: a sine that sweeps from one frequency to another, for system identification.
//!
//! `out = OFFSET + A sin(2 π p)`, with `p` in periods, `T = DURATION`, `f_0 = FROM`, `f_1 = TO`:
//!
//! | `SWEEP` | frequency | periods of tick `k` |
//! |---|---|---|
//! | `LINEAR` | `f_0 + (f_1 - f_0) t / T` | `f_0 h + (f_1 - f_0) h² (2 k + 1) / (2 T)` |
//! | `LOGARITHMIC` | `f_0 (f_1 / f_0)^(t / T)` | `f_0 (e^(c h) - 1) / c · e^(c k h)`, `c = ln(f_1 / f_0) / T` |
//!
//! The phase is a compensated sum (Kahan) modulo one period, so it does not drift. The signal starts at `OFFSET` and
//! holds its last value at the end of the sweep.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all CHIRP_MOD AMPLITUDE 2\nall CHIRP_MOD FROM 10\nall CHIRP_MOD TO 10
//!             all MOD_ENG MOD_ON CHIRP_MOD\nall MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION], rows)?;
//! let quarter = (0..26).filter_map(|_| bench.tick(&[0.0], "SIGNAL_OUT")).last();
//! assert!(quarter.is_some_and(|x| (x - 2.0).abs() < 1e-5));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use dimsart_core::{Context, DeviceDescriptor, Module, Output, Unit, choice, math, types, words};

choice! {
    /// Law of the frequency sweep.
    pub enum Sweep { Linear = "LINEAR", Logarithmic = "LOGARITHMIC" }
}

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Law of the frequency sweep.
        sweep: Sweep = choice("SWEEP"),
        /// Start frequency.
        from_hz: f32 = real("FROM", Unit::Hertz, 1e-3..=1e4, 0.1),
        /// End frequency.
        to_hz: f32 = real("TO", Unit::Hertz, 1e-3..=1e4, 10.0),
        /// Duration of the sweep.
        duration_s: f32 = real("DURATION", Unit::Second, 0.1..=1e4, 10.0),
        /// Periods of the first tick, without the growth term.
        periods: f32,
        /// Linear: increment per half tick. Logarithmic: exponent per tick.
        growth: f32,
        ticks: u32,
    }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Amplitude.
        amplitude: f32 = per_axis("AMPLITUDE", Unit::Any, -1e6..=1e6, 0.0),
        /// Offset added to the signal.
        offset: f32 = per_axis("OFFSET", Unit::Any, -1e6..=1e6, 0.0),
    }
    /// State common to all axes.
    pub struct State { periods: math::CompensatedSum, ticks: u32 }
    /// Ports.
    pub ports Ports { output: Output = output("SIGNAL_OUT", types::SIGNAL_OUT) }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Chirp;

impl Module for Chirp {
    const NAME: &'static str = "CHIRP_MOD";
    const SUMMARY: &'static str = "Generates a sine with swept frequency.";
    type Settings = Settings;
    type Gains = Gains;
    type State = State;
    type AxisState = ();
    type Ports = Ports;

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        let h = device.sample_period_s();
        let Settings { from_hz, to_hz, duration_s, .. } = *settings;
        match settings.sweep {
            Sweep::Linear => {
                settings.growth = (to_hz - from_hz) * h * h / (2.0 * duration_s);
                settings.periods = from_hz * h;
            }
            Sweep::Logarithmic => {
                let growth = logarithm(to_hz / from_hz) * h / duration_s;
                settings.growth = growth;
                // (e^x - 1) / x; x is small unless the sweep has few ticks.
                let share = if growth.abs() < 0.1 {
                    1.0 + growth / 2.0 * (1.0 + growth / 3.0 * (1.0 + growth / 4.0 * (1.0 + growth / 5.0)))
                } else {
                    (math::exp(growth) - 1.0) / growth
                };
                settings.periods = from_hz * h * share;
            }
        }
        settings.ticks = device.time_to_ticks(duration_s);
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Settings { sweep, periods: first, growth, ticks: end, .. } = context.settings();
        let State { mut periods, ticks } = context.state();
        let sine = math::sin(core::f32::consts::TAU * periods.value());
        context.map_axes([], [context.ports().output], |Gains { amplitude, offset }, (), []| {
            [offset + amplitude * sine]
        });
        if ticks >= end {
            return;
        }
        #[expect(clippy::cast_precision_loss, reason = "exact for hours")]
        let tick = ticks as f32;
        let step = match sweep {
            Sweep::Linear => first + growth * (2.0 * tick + 1.0),
            Sweep::Logarithmic => first * math::exp(growth * tick),
        };
        periods.add_wrapped(math::fraction(step.max(0.0)));
        context.set_state(State { periods, ticks: ticks + 1 });
    }
}

/// Returns the natural logarithm of `x > 0`; each step triples the number of correct digits (Halley).
fn logarithm(x: f32) -> f32 {
    let mut y = micromath::F32Ext::ln(x);
    for _ in 0..3 {
        let power = math::exp(y);
        y += 2.0 * (x - power) / (x + power);
    }
    y
}
