//! Wave transformer: turns an incoming wave into a desired position, a force into the outgoing wave.
//!
//! With `F` the force commanded to the local device, `b` the wave impedance, `a = sqrt(2 b)`:
//!
//! ```text
//! x_d' = (a in - F) / b        out = in - (2/a) F        power: F x_d' = (in² - out²) / 2
//! ```
//!
//! (Niemeyer and Slotine, 1991.) The equations are the same on both sides; `CONF_MODE` says which
//! sign the force has on the line, `LINE_FORCE`: from master to slave.
//!
//! The controller between the desired position and the force makes a loop within the tick. `FORM`
//! says how it is closed; in each form the outgoing wave is made in the late stage, of the force that
//! was really commanded.
//!
//! | Form | Desired position | Passive for |
//! |---|---|---|
//! | `SPLIT` | `p += h/b (a in - F[k-1])`, `x_d = p - h/b F~` before the controller | `h K/b + 2 D/b <= 15/16` |
//! | `IMPLICIT` | solved with the law the controller publishes (`LAW_OUTPUT ON`) | every `K`, `D >= 0` |
//! | `PRINTED` | `x_d += h/b (a in - F)` after the controller, which uses it one tick later | never |
//!
//! In `SPLIT` the decoder is one force behind the encoder, so `p` alone settles `h/b F` beyond the
//! position that the waves carry and the port feels like `K/(1 - h K/b)`. Taking off the settled force
//! `F~ += (F - F~)/8` makes it feel like `K` and damps below 80 Hz. The bounds in the table are for a
//! clamped device; a held force also needs damping at the device or the hand, with
//! `k = h K/b + 2 D/b`: `b/2 k / (1 - 16/15 k)` in `SPLIT`, `(h K + 2 D)/2` in `IMPLICIT`
//! (derived and checked in `tests/oracle/passivity.py`).
//!
//! `PRINTED` is the order of the paper's listing: `|G| = (2+k)/(2-k) > 1` at the Nyquist frequency, `k = h K/b`.
//! The sum of `x_d` is compensated (Kahan), so that it does not drift over hours.

use crate::{
    Choice, Data, DeviceDescriptor, Input, Module, Output, Parameters, Ports, Unit, limits::MAX_DOF, math,
    types,
};

/// See the [module docs](self).
#[derive(Debug, Default)]
pub struct WaveTransformer {
    impedance: f32,
    mode: Mode,
    form: Form,
    waves_in: Input,
    position: Input,
    control_stiffness: Input,
    control_memory: Input,
    force: Input,
    waves_out: Output,
    desired_position: Output,
    line_force: Output,
    line_velocity: Output,
    axes: [Axis; MAX_DOF],
    is_fresh: bool,
    coefficients: Coefficients,
}

/// What is worked out once from the impedance.
#[derive(Debug, Default, Clone, Copy)]
struct Coefficients {
    /// `sqrt(2 b)`.
    a: f32,
    /// `2 / a`.
    two_over_a: f32,
    /// `1 / b`.
    mobility: f32,
    /// `h / b`.
    mobility_per_tick: f32,
    /// `+1` on the slave, `-1` on the master.
    line_sign: f32,
}

#[derive(Debug, Default)]
struct Axis {
    desired: math::CompensatedSum,
    previous_force: f32,
    /// The force without its fast part.
    settled_force: f32,
}

/// How much of the way the settled force goes to the present one in a tick.
const SETTLING: f32 = 0.125;

/// Which end of the line this is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
enum Mode {
    #[default]
    Master,
    Slave,
}

impl Choice for Mode {
    const VALUES: &'static [Self] = &[Self::Master, Self::Slave];
    const NAMES: &'static [&'static str] = &["MASTER", "SLAVE"];
}

/// How the loop with the controller is closed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
enum Form {
    #[default]
    Split,
    Implicit,
    Printed,
}

impl Choice for Form {
    const VALUES: &'static [Self] = &[Self::Split, Self::Implicit, Self::Printed];
    const NAMES: &'static [&'static str] = &["SPLIT", "IMPLICIT", "PRINTED"];
}

impl Module for WaveTransformer {
    const NAME: &'static str = "WTRANSF_MOD";
    const SUMMARY: &'static str = "Wave transformer: waves to desired position, force to waves.";

    fn parameters(&mut self, visit: &mut Parameters<'_>) {
        visit.real(&mut self.impedance, "B_PARAM", Unit::Damping, 1e-3..=1e4, 10.0, "Wave impedance b.");
        visit.choice(&mut self.mode, "CONF_MODE", "Which end of the line this is.");
        visit.structural_choice(&mut self.form, "FORM", "How the loop with the controller is closed.");
    }

    fn activate(&mut self, ports: &mut Ports<'_>) {
        ports.input(&mut self.position, "POSITION", types::POSITION);
        if self.form == Form::Implicit {
            ports.delayed_input(&mut self.control_stiffness, "CONTROL_STIFFNESS", types::CONTROL_STIFFNESS);
            ports.delayed_input(&mut self.control_memory, "CONTROL_MEMORY", types::CONTROL_MEMORY);
        }
        if self.form == Form::Printed {
            ports.late_input(&mut self.waves_in, "WAVES_IN", types::CH2_WAVES);
            ports.delayed_output(&mut self.desired_position, "DES_POSITION", types::DES_POSITION);
        } else {
            ports.input(&mut self.waves_in, "WAVES_IN", types::CH2_WAVES);
            ports.output(&mut self.desired_position, "DES_POSITION", types::DES_POSITION);
        }
        ports.late_input(&mut self.force, "DES_FORCE", types::DES_FORCE);
        ports.late_output(&mut self.waves_out, "WAVES_OUT", types::CH1_WAVES);
        ports.late_output(&mut self.line_force, "LINE_FORCE", types::LINE_FORCE);
        ports.late_output(&mut self.line_velocity, "LINE_VELOCITY", types::LINE_VELOCITY);
    }

    fn prepare(&mut self, device: &DeviceDescriptor) {
        let a = math::sqrt(2.0 * self.impedance);
        let mobility = 1.0 / self.impedance;
        self.coefficients = Coefficients {
            a,
            two_over_a: 2.0 / a,
            mobility,
            mobility_per_tick: device.sample_period_s() / self.impedance,
            line_sign: if self.mode == Mode::Master { -1.0 } else { 1.0 },
        };
    }

    fn compute(&mut self, data: &Data<'_>) {
        let Coefficients { a, mobility_per_tick, .. } = self.coefficients;
        if self.is_fresh {
            self.is_fresh = false;
            data.map_axes(&mut self.axes, [self.position], [self.desired_position], |axis, [x]| {
                *axis = Axis { desired: math::CompensatedSum::new(x), ..Axis::default() };
                [x]
            });
        }
        match self.form {
            Form::Split => {
                let outputs = [self.desired_position];
                data.map_axes(&mut self.axes, [self.waves_in], outputs, |axis, [wave]| {
                    let position = axis.desired.add(mobility_per_tick * (a * wave - axis.previous_force));
                    [position - mobility_per_tick * axis.settled_force]
                });
            }
            Form::Implicit => {
                let inputs = [self.waves_in, self.position, self.control_stiffness, self.control_memory];
                data.map_axes(&mut self.axes, inputs, [self.desired_position], |axis, inputs| {
                    let [wave, x, stiffness, memory] = inputs;
                    let free = axis.desired.value() + mobility_per_tick * (a * wave);
                    let force = (stiffness * (free - x) - memory) / (1.0 + stiffness * mobility_per_tick);
                    [free - mobility_per_tick * force]
                });
            }
            Form::Printed => {}
        }
    }

    fn compute_late(&mut self, data: &Data<'_>) {
        let Coefficients { a, two_over_a, mobility, line_sign, .. } = self.coefficients;
        let inputs = [self.waves_in, self.force];
        let outputs = [self.waves_out, self.line_force, self.line_velocity];
        data.map_axes(&mut self.axes, inputs, outputs, |axis, [wave, force]| {
            axis.previous_force = force;
            axis.settled_force += SETTLING * (force - axis.settled_force);
            [wave - two_over_a * force, line_sign * force, mobility * (a * wave - force)]
        });
        if self.form != Form::Split {
            self.follow(data);
        }
    }

    fn reset(&mut self) {
        self.is_fresh = true;
    }
}

impl WaveTransformer {
    /// Moves the desired position by the force that was really commanded.
    ///
    /// Not inlined, so that the usual form does not carry its weight.
    #[inline(never)]
    fn follow(&mut self, data: &Data<'_>) {
        let Coefficients { a, mobility_per_tick, .. } = self.coefficients;
        let inputs = [self.waves_in, self.force];
        let step = |axis: &mut Axis, [wave, force]: [f32; 2]| {
            axis.desired.add(mobility_per_tick * (a * wave - force))
        };
        if self.form == Form::Printed {
            data.map_axes(&mut self.axes, inputs, [self.desired_position], |axis, port| [step(axis, port)]);
        } else {
            // The force that was solved for and the one commanded differ by rounding: only the one
            // that is in the outgoing wave may go into the sum, or the two drift apart.
            data.map_axes(&mut self.axes, inputs, [], |axis, port| {
                step(axis, port);
                []
            });
        }
    }
}
