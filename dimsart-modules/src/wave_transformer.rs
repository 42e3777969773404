//! Wave transformer: converts the incoming wave to a desired position and the force to the outgoing wave.
//!
//! With `F` the force commanded to the local device, `b` the wave impedance, `a = sqrt(2 b)`:
//!
//! ```text
//! x_d' = (a in - F) / b        out = in - (2/a) F        power: F x_d' = (in² - out²) / 2
//! ```
//!
//! (Niemeyer and Slotine, 1991.) The equations are the same on both sides; `CONF_MODE` sets the sign of the force on
//! the line, `LINE_FORCE`: from master to slave.
//!
//! The controller between desired position and force forms an algebraic loop within the tick. `FORM` selects how it is
//! resolved. In each form, the outgoing wave is computed in the late stage from the force actually commanded.
//!
//! | Form | Desired position | Passive for |
//! |---|---|---|
//! | `SPLIT` | `p += h/b (a in - F[k-1])`, `x_d = p - h/b F~` before the controller | `h K/b + 2 D/b <= 15/16` |
//! | `IMPLICIT` | solved with the law that the controller outputs (`LAW_OUTPUT ON`) | every `K`, `D >= 0` |
//! | `PRINTED` | `x_d += h/b (a in - F)` after the controller, which uses it one tick later | never |
//!
//! In `SPLIT`, the decoder uses a force one tick older than the encoder, so `p` alone settles `h/b F` past the position
//! carried by the waves, and the port has a stiffness of `K/(1 - h K/b)`. Subtracting the settled force
//! `F~ += (F - F~)/8` restores the stiffness `K` and adds damping below 80 Hz. The bounds in the table are for a
//! clamped device; a held force also needs damping at the device or the hand, with `k = h K/b + 2 D/b`:
//! `b/2 k / (1 - 16/15 k)` in `SPLIT`, `(h K + 2 D)/2` in `IMPLICIT` (derived and checked in
//! `tests/oracle/passivity.py`).
//!
//! `PRINTED` follows the paper's listing: `|G| = (2+k)/(2-k) > 1` at the Nyquist frequency, `k = h K/b`. The sum of
//! `x_d` is compensated (Kahan) and does not drift.

use dimsart_core::{
    Context, Declarations, DeviceDescriptor, Input, Module, Output, PortSet, Unit, choice, math, types, words,
};

choice! {
    /// Side of the line: master or slave.
    pub enum Mode { Master = "MASTER", Slave = "SLAVE" }
}

choice! {
    /// Solution of the algebraic loop with the controller.
    pub enum LoopSolution { Split = "SPLIT", Implicit = "IMPLICIT", Printed = "PRINTED" }
}

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Wave impedance b.
        impedance: f32 = real("B_PARAM", Unit::Damping, 1e-3..=1e4, 10.0),
        /// Side of the line: master or slave.
        mode: Mode = choice("CONF_MODE"),
        /// Solution of the algebraic loop with the controller.
        form: LoopSolution = structural_choice("FORM"),
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
    /// State of one axis.
    pub struct AxisState {
        desired: math::CompensatedSum,
        previous_force: f32,
        /// Low-pass filtered force.
        settled_force: f32,
    }
    /// Ports.
    pub ports Ports {
        waves_in: Input,
        position: Input = input("POSITION", types::POSITION),
        control_stiffness: Input,
        control_memory: Input,
        force: Input,
        waves_out: Output,
        desired_position: Output,
        line_force: Output,
        line_velocity: Output,
    }
}

/// Filter gain per tick of the settled force.
const SETTLING: f32 = 0.125;

/// See the [module docs](self).
#[derive(Debug)]
pub struct WaveTransformer;

impl Module for WaveTransformer {
    const NAME: &'static str = "WTRANSF_MOD";
    const SUMMARY: &'static str =
        "Wave transformer: converts a wave to a desired position and a force to a wave.";
    type Settings = Settings;
    type Gains = ();
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.a = math::sqrt(2.0 * settings.impedance);
        settings.two_over_a = 2.0 / settings.a;
        settings.mobility = 1.0 / settings.impedance;
        settings.mobility_per_tick = device.sample_period_s() / settings.impedance;
        settings.line_sign = if settings.mode == Mode::Master { -1.0 } else { 1.0 };
    }

    fn ports(settings: &Settings, declare: &mut Declarations<'_>) -> Ports {
        let mut ports = Ports::declare(declare);
        if settings.form == LoopSolution::Implicit {
            let stiffness = types::CONTROL_STIFFNESS;
            ports.control_stiffness = declare.delayed().input("CONTROL_STIFFNESS", stiffness);
            ports.control_memory = declare.delayed().input("CONTROL_MEMORY", types::CONTROL_MEMORY);
        }
        if settings.form == LoopSolution::Printed {
            ports.waves_in = declare.late().input("WAVES_IN", types::CH2_WAVES);
            ports.desired_position = declare.late().delayed().output("DES_POSITION", types::DES_POSITION);
        } else {
            ports.waves_in = declare.input("WAVES_IN", types::CH2_WAVES);
            ports.desired_position = declare.output("DES_POSITION", types::DES_POSITION);
        }
        ports.force = declare.late().input("DES_FORCE", types::DES_FORCE);
        ports.waves_out = declare.late().output("WAVES_OUT", types::CH1_WAVES);
        ports.line_force = declare.late().output("LINE_FORCE", types::LINE_FORCE);
        ports.line_velocity = declare.late().output("LINE_VELOCITY", types::LINE_VELOCITY);
        ports
    }

    fn begin(context: &Context<'_, Self>) {
        let Ports { position, desired_position, .. } = context.ports();
        context.map_axes([position], [desired_position], |(), axis, [x]| {
            *axis = AxisState { desired: math::CompensatedSum::new(x), ..AxisState::default() };
            [x]
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { waves_in, position, control_stiffness, control_memory, desired_position, .. } =
            context.ports();
        let Settings { form, a, mobility_per_tick, .. } = context.settings();
        match form {
            LoopSolution::Split => {
                context.map_axes([waves_in], [desired_position], |(), axis, [wave]| {
                    let position = axis.desired.add(mobility_per_tick * (a * wave - axis.previous_force));
                    [position - mobility_per_tick * axis.settled_force]
                });
            }
            LoopSolution::Implicit => {
                let inputs = [waves_in, position, control_stiffness, control_memory];
                context.map_axes(inputs, [desired_position], |(), axis, [wave, x, stiffness, memory]| {
                    let free = axis.desired.value() + mobility_per_tick * (a * wave);
                    let force = (stiffness * (free - x) - memory) / (1.0 + stiffness * mobility_per_tick);
                    [free - mobility_per_tick * force]
                });
            }
            LoopSolution::Printed => {}
        }
    }

    #[inline(always)]
    fn compute_late(context: &Context<'_, Self>) {
        let Ports { waves_in, force, waves_out, line_force, line_velocity, .. } = context.ports();
        let Settings { form, a, two_over_a, mobility, line_sign, .. } = context.settings();
        let outputs = [waves_out, line_force, line_velocity];
        context.map_axes([waves_in, force], outputs, |(), axis, [wave, force]| {
            axis.previous_force = force;
            axis.settled_force += SETTLING * (force - axis.settled_force);
            [wave - two_over_a * force, line_sign * force, mobility * (a * wave - force)]
        });
        if form != LoopSolution::Split {
            follow(context);
        }
    }
}

/// Integrates the desired position with the force actually commanded. Not inlined, to keep the common form small.
#[inline(never)]
fn follow(context: &Context<'_, WaveTransformer>) {
    let Ports { waves_in, force, desired_position, .. } = context.ports();
    let Settings { form, a, mobility_per_tick, .. } = context.settings();
    let inputs = [waves_in, force];
    let step = |axis: &mut AxisState, [wave, force]: [f32; 2]| {
        axis.desired.add(mobility_per_tick * (a * wave - force))
    };
    if form == LoopSolution::Printed {
        context.map_axes(inputs, [desired_position], |(), axis, port| [step(axis, port)]);
    } else {
        // The solved and the commanded force differ by rounding: integrate the force in the outgoing wave, or position and
        // wave drift apart.
        context.map_axes(inputs, [], |(), axis, port| {
            step(axis, port);
            []
        });
    }
}
