//! Signal generator: deterministic test signals from the tick count.
//!
//! With the time `t` since plug-in or reset, `p = FREQUENCY t` in periods, `A` and `OFFSET` per axis: `CONSTANT` is
//! `OFFSET + A`; `STEP` is `OFFSET`, then `OFFSET + A` from `STEP_TIME` on; `SINE` is `OFFSET + A sin(2 pi p)`;
//! `SQUARE` is `OFFSET ± A`; `TRIANGLE` starts at `OFFSET`, rising. The phase is a compensated sum, so a slow signal
//! keeps its frequency.

use dimsart_core::{Context, DeviceDescriptor, Module, Output, Parameters, Unit, choice, math, types, words};

choice! {
    /// Waveform of the signal.
    pub enum Waveform { Constant = "CONSTANT", Step = "STEP", Sine = "SINE", Square = "SQUARE", Triangle = "TRIANGLE" }
}

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        form: Waveform,
        frequency_hz: f32,
        /// Periods per tick, without whole periods.
        periods_per_tick: f32,
        step_time_s: f32,
        step_ticks: u32,
    }
    /// Parameters of one axis.
    pub parameters Gains { amplitude: f32, offset: f32 }
    /// State common to all axes.
    pub struct State { periods: math::CompensatedSum, ticks: u32 }
    /// Ports.
    pub ports Ports { output: Output = output("SIGNAL_OUT", types::SIGNAL_OUT) }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct SignalGenerator;

impl Module for SignalGenerator {
    const NAME: &'static str = "SIGGEN_MOD";
    const SUMMARY: &'static str = "Generates a constant, step, sine, square or triangle signal.";
    type Settings = Settings;
    type Gains = Gains;
    type State = State;
    type AxisState = ();
    type Ports = Ports;

    fn parameters(settings: &mut Settings, gains: &mut Gains, visit: &mut Parameters<'_>) {
        visit.choice(&mut settings.form, "FORM", "Waveform of the signal.");
        let Gains { amplitude, offset } = gains;
        visit.per_axis(amplitude, "AMPLITUDE", Unit::Any, -1e6..=1e6, 0.0, "Amplitude.");
        visit.per_axis(offset, "OFFSET", Unit::Any, -1e6..=1e6, 0.0, "Offset added to the signal.");
        let Settings { frequency_hz, step_time_s, .. } = settings;
        let summary = "Frequency of SINE, SQUARE and TRIANGLE.";
        visit.real(frequency_hz, "FREQUENCY", Unit::Hertz, 1e-4..=1e4, 1.0, summary);
        visit.real(step_time_s, "STEP_TIME", Unit::Second, 0.0..=1e4, 1.0, "Time of the step.");
    }

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        let periods_per_tick = (settings.frequency_hz * device.sample_period_s()).min(f32::MAX);
        settings.periods_per_tick = math::fraction(periods_per_tick);
        settings.step_ticks = device.time_to_ticks(settings.step_time_s);
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Settings { form, periods_per_tick, step_ticks, .. } = context.settings();
        let State { mut periods, ticks } = context.state();
        let p = periods.value();
        let shape = match form {
            Waveform::Constant => 1.0,
            Waveform::Step => f32::from(u8::from(ticks >= step_ticks)),
            Waveform::Sine => math::sin(core::f32::consts::TAU * p),
            Waveform::Square => {
                if p < 0.5 {
                    1.0
                } else {
                    -1.0
                }
            }
            Waveform::Triangle => {
                let rising = 4.0 * p;
                if p < 0.25 {
                    rising
                } else if p < 0.75 {
                    2.0 - rising
                } else {
                    rising - 4.0
                }
            }
        };
        context.map_axes([], [context.ports().output], |Gains { amplitude, offset }, (), []| {
            [offset + amplitude * shape]
        });
        periods.add_wrapped(periods_per_tick);
        context.set_state(State { periods, ticks: ticks.saturating_add(1) });
    }
}
