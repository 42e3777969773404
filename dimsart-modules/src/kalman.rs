//! Kalman filter for a measured position: estimates velocity and, optionally, acceleration.
//!
//! The model is a mass driven by random noise of standard deviation `σ_a = ACCELERATION_NOISE`, constant within a tick:
//! its acceleration (`CONSTANT_VELOCITY`) or the change of its acceleration (`CONSTANT_ACCELERATION`). The position is
//! measured with standard deviation `σ_x = POSITION_NOISE`. With `r = x - x̂⁻` and the prediction `x̂⁻`:
//!
//! `x̂ = x̂⁻ + α r`, `v̂ = v̂⁻ + β r / h`, `â = â⁻ + γ r / h²`.
//!
//! It is computed from differences only, as in [`VELOCITY_OBSERVER_MOD`](crate::velocity_observer), so precision does
//! not degrade far from zero.
//!
//! The gains are the steady-state gains, so the cost of a tick does not depend on the noise. They have closed forms in
//! `λ = σ_a h² / σ_x` (Kalata, *The Tracking Index*, 1984; Gray & Murray, 1993), written here in `u = 1 - sqrt(1 - α)`
//! to avoid cancellation in `f32`:
//!
//! | `MODEL` | `u` | α | β | γ |
//! |---|---|---|---|---|
//! | `CONSTANT_VELOCITY` | `2 λ / (λ + sqrt(λ² + 8 λ))` | `u (2 - u)` | `2 u²` | |
//! | `CONSTANT_ACCELERATION` | root of `u³ = λ (1 - u) (1 - u/2)` | `u (2 - u)` | `2 u²` | `2 u³ / (2 - u)` |
//!
//! Initial state: the measured position, at rest; on takeover, with the last velocity output.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all KALMAN_MOD MODEL CONSTANT_ACCELERATION
//!             all MOD_ENG MOD_ON KALMAN_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION], rows)?;
//! // Free fall at 9.81 m/s².
//! let fall = (0..400_u16).map(|tick| -9.81e-6 / 2.0 * f32::from(tick).powi(2));
//! let last = fall.filter_map(|x| bench.tick(&[x], "ACCELERATION")).last().unwrap_or_default();
//! assert!((last + 9.81).abs() < 0.02, "{last}");
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use crate::take_over::first;
use dimsart_core::{
    Context, Declarations, DeviceDescriptor, Input, Module, Output, ParameterSet, Parameters, Unit, choice,
    math, types, words,
};

choice! {
    /// Motion model.
    pub enum Model { Velocity = "CONSTANT_VELOCITY", Acceleration = "CONSTANT_ACCELERATION" }
}

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Motion model; CONSTANT_ACCELERATION adds the output ACCELERATION.
        model: Model = structural_choice("MODEL"),
        period_s: f32,
    }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Standard deviation of the measured position.
        position_noise: f32 = per_axis("POSITION_NOISE", Unit::Position, 1e-9..=1e3, 1e-5),
        /// Standard deviation per tick of the acceleration; CONSTANT_ACCELERATION: of its change.
        acceleration_noise: f32 = per_axis("ACCELERATION_NOISE", Unit::Acceleration, 1e-6..=1e6, 1.0),
        /// `1 - α`.
        kept: f32,
        /// `β / h`.
        velocity_gain: f32,
        /// `γ / h²`.
        acceleration_gain: f32,
    }
    /// State of one axis.
    pub struct AxisState {
        /// Position of the last tick.
        previous: f32,
        /// Position minus its estimate.
        error: f32,
        velocity: f32,
        acceleration: f32,
    }
    /// Ports.
    pub ports Ports { position: Input, velocity: Output, acceleration: Output }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Kalman;

impl Module for Kalman {
    const NAME: &'static str = "KALMAN_MOD";
    const SUMMARY: &'static str = "Kalman filter: velocity and acceleration from a measured position.";
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
        settings.period_s = device.sample_period_s();
    }

    fn prepare_axis(settings: &Settings, gains: &mut Gains, _: &DeviceDescriptor) {
        let h = settings.period_s;
        let index = gains.acceleration_noise * h * h / gains.position_noise;
        let (u, gamma) = match settings.model {
            Model::Velocity => (2.0 * index / (index + math::sqrt(index * index + 8.0 * index)), 0.0),
            Model::Acceleration => {
                let u = root(index);
                (u, 2.0 * u * u * u / (2.0 - u))
            }
        };
        gains.kept = (1.0 - u) * (1.0 - u);
        gains.velocity_gain = 2.0 * u * u / h;
        gains.acceleration_gain = gamma / (h * h);
    }

    fn ports(settings: &Settings, declare: &mut Declarations<'_>) -> Ports {
        let position = declare.input("POSITION", types::POSITION);
        let velocity = declare.output("VELOCITY", types::VELOCITY);
        let acceleration = match settings.model {
            Model::Velocity => Output::default(),
            Model::Acceleration => declare.output("ACCELERATION", types::ACCELERATION),
        };
        Ports { position, velocity, acceleration }
    }

    fn begin(context: &Context<'_, Self>) {
        let Ports { position, velocity, .. } = context.ports();
        let Settings { period_s, .. } = context.settings();
        let takes_over = context.takes_over();
        context.begin_axes([position, velocity.last()], |_, [x, last]| {
            let velocity = first(takes_over, last, 0.0);
            AxisState { previous: x, error: period_s * velocity, velocity, acceleration: 0.0 }
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { position, velocity, acceleration } = context.ports();
        let Settings { period_s, .. } = context.settings();
        context.map_axis_contexts([position], [velocity], |number, lane, [x]| {
            let (gains, axis) = (lane.gains(), lane.axis());
            let gained = period_s * axis.acceleration;
            let beyond = (x - axis.previous) + axis.error - period_s * (axis.velocity + 0.5 * gained);
            let axis = AxisState {
                previous: x,
                error: gains.kept * beyond,
                velocity: axis.velocity + gained + gains.velocity_gain * beyond,
                acceleration: axis.acceleration + gains.acceleration_gain * beyond,
            };
            lane.set_axis(axis);
            context.set_axis(acceleration, number, axis.acceleration);
            [axis.velocity]
        });
    }
}

/// Returns the only root of `u³ = λ (1 - u) (1 - u/2)` between 0 and 1: the left side rises, the right side falls.
fn root(index: f32) -> f32 {
    let (mut below, mut above) = (0.0, 1.0);
    // Enough steps for the precision of a small root.
    for _ in 0..48 {
        let u: f32 = 0.5 * (below + above);
        if u * u * u < index * (1.0 - u) * (1.0 - 0.5 * u) {
            below = u;
        } else {
            above = u;
        }
    }
    above
}
