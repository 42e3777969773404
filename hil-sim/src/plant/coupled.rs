//! Simulation of machines with coupled axes.
//!
//! ```text
//!   (M(q) + B) q'' + n(q, q') = τ + load + stops - viscous q' - dry friction
//! ```
//! `M` is the mass matrix of the [`Mechanism`], `n` its bias: Coriolis, centrifugal and gravity terms. `B` is the
//! diagonal matrix of motor inertias at the joints; gyroscopic effects of the rotors are neglected. A new machine is
//! a file that computes `M` and `n`.
//!
//! Integrated with error control at 1e-11. Friction is Coulomb friction without smoothing: an axis at rest does not
//! creep until the load exceeds the friction. At a reversal or contact change, the step is halved until the event is
//! located within 50 ns.
#![expect(clippy::indexing_slicing, reason = "matrices of a fixed size")]

mod actuator;
mod advance;
mod factors;
mod mode;
mod pace;
mod state;
mod step;
mod stop;

pub(super) use actuator::Actuator;
pub(super) use stop::Stop;

use super::joint::JointEnergy;
use super::parameter::ParameterError;
use dimsart_core::limits::MAX_DOF;
use nalgebra::{SMatrix, SVector};
use state::State;

/// One value per axis; surplus entries are 0.
pub type AxisValues = [f64; MAX_DOF];
/// One row and column per axis; surplus entries are 0.
pub type Matrix = SMatrix<f64, MAX_DOF, MAX_DOF>;

/// Equations of motion of a machine, without friction and actuators.
pub trait Mechanism: core::fmt::Debug + Send {
    /// Returns the number of axes, at most [`MAX_DOF`].
    fn axes(&self) -> usize;

    /// Computes mass matrix and bias at `position` and `velocity`.
    fn dynamics(&self, position: &AxisValues, velocity: &AxisValues) -> Dynamics;

    /// Returns the potential energy, `J`.
    fn potential_j(&self, position: &AxisValues) -> f64;

    /// Returns the tip position in the base frame, `m`.
    fn tip_m(&self, position: &AxisValues) -> [f64; 3];

    /// Returns the Jacobian of the tip: `v = J q'`, one row per direction in space.
    fn tip_jacobian(&self, position: &AxisValues) -> [AxisValues; 3];
}

/// The equations of motion at one instant: `mass · q'' + bias = τ`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dynamics {
    /// Symmetric and positive definite.
    pub mass: Matrix,
    /// Coriolis, centrifugal and gravity terms, `N m` or `N`.
    pub bias: AxisValues,
}

/// True state of one axis, without sensors.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CoupledAxisState {
    /// `rad` or `m`.
    pub position: f64,
    /// `rad/s` or `m/s`.
    pub velocity: f64,
    /// Force of the actuator, `N m` or `N`: the command within its limit.
    pub actuator_force: f64,
}

/// The tip at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tip {
    /// Energies since the start of the run.
    pub time_s: f64,
    /// In the base frame.
    pub position_m: [f64; 3],
    /// In the base frame.
    pub velocity_m_per_s: [f64; 3],
}

/// Simulation of a coupled machine.
#[derive(Debug)]
pub struct Coupled<M> {
    mechanism: M,
    /// One per axis.
    actuators: Vec<Actuator>,
    stops: Vec<Stop>,
    state: State,
    /// Forces of the actuators in the last period.
    actuator_forces: AxisValues,
}

impl<M: Mechanism> Coupled<M> {
    /// Creates the machine at rest at its start position.
    ///
    /// # Errors
    /// The parameter with the fastest dynamics, if it requires too many sub-steps.
    pub(super) fn new(
        mechanism: M,
        actuators: Vec<Actuator>,
        stops: Vec<Stop>,
    ) -> Result<Self, ParameterError> {
        let mut state = State::default();
        for (position, actuator) in state.position.iter_mut().zip(&actuators) {
            *position = actuator.start_position;
        }
        let coupled = Self { mechanism, actuators, stops, state, actuator_forces: [0.0; MAX_DOF] };
        pace::check(&coupled)?;
        Ok(coupled)
    }

    /// Number of axes.
    #[must_use]
    pub fn axes(&self) -> usize {
        self.mechanism.axes()
    }

    /// Returns the true state of an axis; 0 for a nonexistent axis.
    #[must_use]
    pub fn axis(&self, axis: usize) -> CoupledAxisState {
        let of = |values: &AxisValues| values.get(axis).copied().unwrap_or_default();
        CoupledAxisState {
            position: of(&self.state.position),
            velocity: of(&self.state.velocity),
            actuator_force: of(&self.actuator_forces),
        }
    }

    /// Returns all positions, `rad` or `m`.
    #[must_use]
    pub fn positions(&self) -> &AxisValues {
        &self.state.position
    }

    /// Returns all velocities, `rad/s` or `m/s`.
    #[must_use]
    pub fn velocities(&self) -> &AxisValues {
        &self.state.velocity
    }

    /// Sets positions and velocities; missing entries are 0, surplus is ignored. The energy account is not affected.
    pub fn set_state(&mut self, positions: &[f64], velocities: &[f64]) {
        self.state.position = self.axes_of(positions);
        self.state.velocity = self.axes_of(velocities);
    }

    /// Returns its energies.
    #[must_use]
    pub fn energy(&self) -> JointEnergy {
        let State { position, velocity, supplied_j, dissipated_j } = &self.state;
        let momentum = times(&self.dynamics(position, velocity).mass, velocity);
        let stops_j: f64 = self.stops.iter().map(|stop| stop.stored_j(position)).sum();
        JointEnergy {
            supplied_j: *supplied_j,
            dissipated_j: *dissipated_j,
            stored_j: 0.5 * dot(&momentum, velocity) + self.mechanism.potential_j(position) + stops_j,
        }
    }

    /// Returns the torques (`N m` or `N`) that compensate gravity at rest in `positions`.
    #[must_use]
    pub fn gravity_torques(&self, positions: &[f64]) -> AxisValues {
        self.bias(positions, &[])
    }

    /// Returns Coriolis, centrifugal and gravity terms, `N m` or `N`: the torques for zero acceleration, without
    /// friction.
    #[must_use]
    pub fn bias(&self, positions: &[f64], velocities: &[f64]) -> AxisValues {
        self.mechanism.dynamics(&self.axes_of(positions), &self.axes_of(velocities)).bias
    }

    /// Returns the mass matrix in `positions`, including motor inertias.
    #[must_use]
    pub fn mass_matrix(&self, positions: &[f64]) -> Matrix {
        self.dynamics(&self.axes_of(positions), &[0.0; MAX_DOF]).mass
    }

    /// Returns the tip in `positions`, `m`, in the base frame.
    #[must_use]
    pub fn forward_kinematics(&self, positions: &[f64]) -> [f64; 3] {
        self.mechanism.tip_m(&self.axes_of(positions))
    }

    /// Returns the Jacobian of the tip in `positions`: one row per direction in space, one column per axis.
    #[must_use]
    pub fn tip_jacobian(&self, positions: &[f64]) -> [AxisValues; 3] {
        self.mechanism.tip_jacobian(&self.axes_of(positions))
    }

    /// Returns position and velocity of the tip at `time_s`.
    #[must_use]
    pub fn tip(&self, time_s: f64) -> Tip {
        self.tip_of(time_s, &self.state.position, &self.state.velocity)
    }

    /// Whether an axis is in contact with a stop.
    #[must_use]
    pub fn is_at_stop(&self) -> bool {
        self.stops.iter().any(|stop| stop.stored_j(&self.state.position) > 0.0)
    }

    fn tip_of(&self, time_s: f64, position: &AxisValues, velocity: &AxisValues) -> Tip {
        Tip {
            time_s,
            position_m: self.mechanism.tip_m(position),
            velocity_m_per_s: self.mechanism.tip_jacobian(position).map(|row| dot(&row, velocity)),
        }
    }

    /// Returns mass matrix and bias, including motor inertias.
    fn dynamics(&self, position: &AxisValues, velocity: &AxisValues) -> Dynamics {
        let mut dynamics = self.mechanism.dynamics(position, velocity);
        for (axis, actuator) in self.actuators.iter().enumerate() {
            dynamics.mass[(axis, axis)] += actuator.inertia;
        }
        dynamics
    }

    /// Resizes to the number of axes; missing values are 0.
    pub(super) fn axes_of(&self, values: &[f64]) -> AxisValues {
        let mut axes = [0.0; MAX_DOF];
        for (axis, value) in axes.iter_mut().take(self.axes()).zip(values) {
            *axis = *value;
        }
        axes
    }
}

/// Returns the torques `Jᵀ f` of a force at the tip.
pub(super) fn transposed(jacobian: &[AxisValues; 3], force_n: &[f64; 3]) -> AxisValues {
    let mut torques = [0.0; MAX_DOF];
    for (row, force_n) in jacobian.iter().zip(force_n) {
        for (torque, lever) in torques.iter_mut().zip(row) {
            *torque += lever * force_n;
        }
    }
    torques
}

fn times(matrix: &Matrix, vector: &AxisValues) -> AxisValues {
    (matrix * SVector::from(*vector)).into()
}

fn dot(one: &AxisValues, other: &AxisValues) -> f64 {
    one.iter().zip(other).map(|(one, other)| one * other).sum()
}
