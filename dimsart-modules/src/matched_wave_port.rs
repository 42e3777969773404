//! Impedance-matched wave port: a position controller for a robot of known mass, tuned to reflect no wave in free
//! motion.
//!
//! With `λ` the bandwidth in rad/s, `m` the robot's mass, `b` the wave impedance, `a = sqrt(2b)`:
//!
//! ```text
//! D = B = λ m,  K = λ² m,  R = b - λ m
//! on the line    F_c = R x_d' + B (x_d' - x') + K (x_d - x)        x_d' = (a in - F_c) / b       out = in - (2/a) F_c
//! on the robot   F = -D x' + B (x_d' - x') + K (x_d - x)
//! ```
//!
//! (Niemeyer and Slotine, *IJRR* 23(9), 2004.) In free motion `X/X_d = λ/(s + λ)` and `F_c = b x_d'`, so `out = 0`: the
//! line is terminated by its own impedance, for any delay. Contact forces on the robot return as a wave. `λ` is limited
//! to `b/m`, where `R` is 0. With `x_d` advanced by `h x_d'`, the two equations are solved together:
//! `x_d' = (a in + B x' - K (x_d[k-1] - x)) / (2 b + h K)`. The sample-and-hold leaves a reflection of the order `λ h`.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::CH2_WAVES, types::POSITION, types::VELOCITY],
//!     "all WMATCH_MOD MASS 0.5\nall MOD_ENG MOD_ON WMATCH_MOD\nall MOD_ENG MATCHING_CHECK",
//! )?;
//! assert_eq!(bench.tick(&[0.0, 0.2, 0.0], "DES_POSITION"), Some(0.2)); // starts at the robot's position
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use core::f32::consts::TAU;

use dimsart_core::{
    Context, DeviceDescriptor, Input, Module, Output, ParameterSet, Parameters, Unit, math, types, words,
};

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Wave impedance b.
        impedance: f32 = real("B_PARAM", Unit::Damping, 1e-3..=1e4, 10.0),
        /// Tracking bandwidth of the robot; limited to B_PARAM / MASS in rad/s.
        bandwidth_hz: f32 = real("BANDWIDTH", Unit::Hertz, 1e-3..=1e3, 3.0),
        /// `sqrt(2 b)`.
        a: f32,
        /// `2 / a`.
        two_over_a: f32,
        period_s: f32,
    }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Mass of the robot.
        mass: f32 = per_axis("MASS", Unit::Inertia, 1e-6..=1e4, 0.1),
        stiffness: f32,
        damping: f32,
        /// `1 / (2 b + h K)`.
        mobility: f32,
    }
    /// State of one axis.
    pub struct AxisState { desired: math::CompensatedSum }
    /// Ports.
    pub ports Ports {
        waves_in: Input = input("WAVES_IN", types::CH2_WAVES),
        position: Input = input("POSITION", types::POSITION),
        velocity: Input = input("VELOCITY", types::VELOCITY),
        waves_out: Output = output("WAVES_OUT", types::CH1_WAVES),
        desired_position: Output = output("DES_POSITION", types::DES_POSITION),
        force: Output = output("DES_FORCE", types::DES_FORCE),
        line_force: Output = output("LINE_FORCE", types::LINE_FORCE),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct MatchedWavePort;

impl Module for MatchedWavePort {
    const NAME: &'static str = "WMATCH_MOD";
    const SUMMARY: &'static str = "Impedance-matched wave port: no reflection in free motion.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn parameters(settings: &mut Settings, gains: &mut Gains, visit: &mut Parameters<'_>) {
        settings.visit(visit);
        gains.visit(visit);
    }

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.a = math::sqrt(2.0 * settings.impedance);
        settings.two_over_a = 2.0 / settings.a;
        settings.period_s = device.sample_period_s();
    }

    fn prepare_axis(settings: &Settings, gains: &mut Gains, device: &DeviceDescriptor) {
        let bandwidth_rad_per_s = (TAU * settings.bandwidth_hz).min(settings.impedance / gains.mass);
        gains.damping = bandwidth_rad_per_s * gains.mass;
        gains.stiffness = bandwidth_rad_per_s * gains.damping;
        gains.mobility = 1.0 / (2.0 * settings.impedance + device.sample_period_s() * gains.stiffness);
    }

    fn begin(context: &Context<'_, Self>) {
        let Ports { position, desired_position, .. } = context.ports();
        let takes_over = context.takes_over();
        context.begin_axes([position, desired_position.last()], |_, [x, last]| AxisState {
            desired: math::CompensatedSum::new(if takes_over { last } else { x }),
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { waves_in, position, velocity, waves_out, desired_position, force, line_force } =
            context.ports();
        let Settings { impedance, a, two_over_a, period_s, .. } = context.settings();
        let outputs = [waves_out, desired_position, force, line_force];
        context.map_axes([waves_in, position, velocity], outputs, |gains, axis, [wave, x, velocity]| {
            let Gains { stiffness, damping, mobility, .. } = gains;
            let pull = stiffness * (axis.desired.value() - x);
            let desired_velocity = mobility * (a * wave + damping * velocity - pull);
            let desired = axis.desired.add(period_s * desired_velocity);
            let port = a * wave - impedance * desired_velocity;
            let coupling = damping * (desired_velocity - velocity) + stiffness * (desired - x);
            [wave - two_over_a * port, desired, coupling - damping * velocity, port]
        });
    }
}
