//! PD controller on position: spring and damper between desired and measured position.
//!
//! `F = K e + D (e - e[k-1]) / h`, `e = x_d - x`, `h` the sample period; `e[-1] = e[0]`. On takeover from another
//! module, `e[-1]` is chosen so that the first force equals the last force of that module, if `D > 0`.
//!
//! With `LAW_OUTPUT ON` the module also outputs the law of the next tick, `F = S (x_d - x) - M` with `S = K + D/h` and
//! `M = D e/h`, so that a wave transformer can solve for the desired position on which the force depends (its implicit
//! form).

use dimsart_core::{
    Context, Declarations, DeviceDescriptor, Input, Module, Output, PortSet, Unit, types, words,
};

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Output the control law of the next tick, for WTRANSF_MOD with FORM IMPLICIT.
        publishes_law: bool = structural_flag("LAW_OUTPUT", false),
    }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Proportional gain: force per position error.
        stiffness: f32 = per_axis("K_PARAM", Unit::Stiffness, 0.0..=1e6, 0.0),
        /// Derivative gain: force per velocity error.
        damping: f32 = per_axis("D_PARAM", Unit::Damping, 0.0..=1e4, 0.0),
        /// `D / h`.
        damping_per_tick: f32,
    }
    /// State of one axis.
    pub struct AxisState { previous_error: f32 }
    /// Ports.
    pub ports Ports {
        position: Input = input("POSITION", types::POSITION),
        desired_position: Input = input("DES_POSITION", types::DES_POSITION),
        force: Output = output("DES_FORCE", types::DES_FORCE),
        control_stiffness: Output,
        control_memory: Output,
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Pd;

impl Module for Pd {
    const NAME: &'static str = "PDCTRL_MOD";
    const SUMMARY: &'static str = "PD controller on position: F = K e + D de/dt.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn prepare_axis(_: &Settings, gains: &mut Gains, device: &DeviceDescriptor) {
        gains.damping_per_tick = gains.damping / device.sample_period_s();
    }

    fn ports(settings: &Settings, declare: &mut Declarations<'_>) -> Ports {
        let mut ports = Ports::declare(declare);
        if settings.publishes_law {
            ports.control_stiffness = declare.output("CONTROL_STIFFNESS", types::CONTROL_STIFFNESS);
            ports.control_memory = declare.output("CONTROL_MEMORY", types::CONTROL_MEMORY);
        }
        ports
    }

    fn begin(context: &Context<'_, Self>) {
        let Ports { position, desired_position, force, .. } = context.ports();
        let takes_over = context.takes_over();
        context.begin_axes([position, desired_position, force.last()], |gains, [x, desired, last_force]| {
            let error = desired - x;
            // Infinite or NaN with little damping or after an invalid force of the predecessor.
            let change = (last_force - gains.stiffness * error) / gains.damping_per_tick;
            let takes_over = takes_over && change.is_finite();
            AxisState { previous_error: if takes_over { error - change } else { error } }
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { position, desired_position, force, .. } = context.ports();
        context.map_axes([position, desired_position], [force], |gains, axis, [x, desired]| {
            let error = desired - x;
            let change = error - axis.previous_error;
            axis.previous_error = error;
            [gains.stiffness * error + gains.damping_per_tick * change]
        });
        if context.settings().publishes_law {
            let outputs = [context.ports().control_stiffness, context.ports().control_memory];
            context.map_axes([], outputs, |Gains { stiffness, damping_per_tick, .. }, axis, []| {
                [stiffness + damping_per_tick, damping_per_tick * axis.previous_error]
            });
        }
    }
}
