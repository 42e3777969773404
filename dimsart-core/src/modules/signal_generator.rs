//! Signal generator: test signals from the tick count, the same in every run.
//!
//! With the time `t` since plug-in or reset, `p = FREQUENCY t` in periods, `A` and `OFFSET` per axis:
//! `CONSTANT` `OFFSET + A`, `STEP` `OFFSET`, then `OFFSET + A` from one period on, `SINE`
//! `OFFSET + A sin(2 pi p)`, `SQUARE` `OFFSET ± A`, `TRIANGLE` starts at `OFFSET`, rising. The periods are
//! a compensated sum, so that a slow signal keeps its frequency.

use crate::{Choice, Data, DeviceDescriptor, Module, Output, Parameters, PerAxis, Ports, Unit, math, types};

/// See the [module docs](self).
#[derive(Debug, Default)]
pub struct SignalGenerator {
    form: Form,
    amplitude: PerAxis,
    offset: PerAxis,
    frequency_hz: f32,
    output: Output,
    /// Without whole periods, which change nothing but that there was one.
    periods_per_tick: f32,
    is_faster_than_ticks: bool,
    periods: math::CompensatedSum,
    has_stepped: bool,
}

/// Form of the signal.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
enum Form {
    #[default]
    Constant,
    Step,
    Sine,
    Square,
    Triangle,
}

impl Choice for Form {
    const VALUES: &'static [Self] = &[Self::Constant, Self::Step, Self::Sine, Self::Square, Self::Triangle];
    const NAMES: &'static [&'static str] = &["CONSTANT", "STEP", "SINE", "SQUARE", "TRIANGLE"];
}

impl Module for SignalGenerator {
    const NAME: &'static str = "SIGGEN_MOD";
    const SUMMARY: &'static str = "Generates a constant, step, sine, square or triangle.";

    fn parameters(&mut self, visit: &mut Parameters<'_>) {
        visit.choice(&mut self.form, "FORM", "Form of the signal.");
        visit.per_axis(&mut self.amplitude, "AMPLITUDE", Unit::Any, -1e6..=1e6, 0.0, "Amplitude.");
        visit.per_axis(&mut self.offset, "OFFSET", Unit::Any, -1e6..=1e6, 0.0, "Added to the signal.");
        visit.real(&mut self.frequency_hz, "FREQUENCY", Unit::Hertz, 1e-4..=1e4, 1.0, "Periods per second.");
    }

    fn activate(&mut self, ports: &mut Ports<'_>) {
        ports.output(&mut self.output, "SIGNAL_OUT", types::SIGNAL_OUT);
    }

    fn prepare(&mut self, device: &DeviceDescriptor) {
        let periods_per_tick = (self.frequency_hz * device.sample_period_s()).min(f32::MAX);
        self.periods_per_tick = math::fraction(periods_per_tick);
        self.is_faster_than_ticks = periods_per_tick >= 1.0;
    }

    fn compute(&mut self, data: &Data<'_>) {
        let p = self.periods.value();
        let shape = match self.form {
            Form::Constant => 1.0,
            Form::Step => f32::from(u8::from(self.has_stepped)),
            Form::Sine => math::sin(core::f32::consts::TAU * p),
            Form::Square => {
                if p < 0.5 {
                    1.0
                } else {
                    -1.0
                }
            }
            Form::Triangle => {
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
        let lanes = self.amplitude.iter().zip(&self.offset);
        data.map_axes(lanes, [], [self.output], |(amplitude, offset), []| [offset + amplitude * shape]);
        self.has_stepped |= self.is_faster_than_ticks;
        if self.periods.add(self.periods_per_tick) >= 1.0 {
            self.periods.turn_back(1.0);
            self.has_stepped = true;
        }
    }

    fn reset(&mut self) {
        self.periods = math::CompensatedSum::default();
        self.has_stepped = false;
    }
}
