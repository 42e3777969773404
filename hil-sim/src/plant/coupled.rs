//! A machine whose axes move each other: what every such plant has in common.
//!
//! ```text
//!   (M(q) + B) q'' + n(q, q') = τ + load + stops - viscous q' - dry friction
//! ```
//! `M` is the mass matrix of the [`Mechanism`], `n` its bias: Coriolis, centrifugal and gravity terms. `B` is the
//! diagonal of the motors' inertias, seen from the joints; that a spinning rotor is also turned by the links before it
//! is left out. A new machine is one file that says `M` and `n`.
//!
//! Integrated in steps whose error is estimated, as long as 1e-11 allows. Dry friction is Coulomb's, not smoothed: an axis at
//! rest stays at rest, without creeping, until more than the friction pulls on it. Where an axis reverses or a stop touches,
//! the step is halved until that is located within 50 ns.
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

/// One value for each axis; entries past the last axis are 0.
pub type Axes = [f64; MAX_DOF];
/// One row and column for each axis; those past the last axis are 0.
pub type Matrix = SMatrix<f64, MAX_DOF, MAX_DOF>;

/// A machine's equations of motion, without friction and actuators.
pub trait Mechanism: core::fmt::Debug + Send {
    /// Number of axes, at most [`MAX_DOF`].
    fn axes(&self) -> usize;

    /// Mass matrix and bias at `position` and `velocity`.
    fn dynamics(&self, position: &Axes, velocity: &Axes) -> Dynamics;

    /// Energy in the field of gravity, `J`.
    fn potential_j(&self, position: &Axes) -> f64;

    /// Where the tip is, `m`, in the frame of the base.
    fn tip_m(&self, position: &Axes) -> [f64; 3];

    /// How the tip moves with the axes: `v = J q'`. One row per direction in space.
    fn tip_jacobian(&self, position: &Axes) -> [Axes; 3];
}

/// The equations of motion at one instant: `mass · q'' + bias = τ`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dynamics {
    /// Symmetric and positive definite.
    pub mass: Matrix,
    /// Coriolis, centrifugal and gravity terms, `N m` or `N`.
    pub bias: Axes,
}

/// The truth about one axis. No sensor stands in between.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CoupledAxisState {
    /// `rad` or `m`.
    pub position: f64,
    /// `rad/s` or `m/s`.
    pub velocity: f64,
    /// What the actuator applies, `N m` or `N`: the held command within its limit.
    pub actuator_force: f64,
}

/// The tip at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tip {
    /// Since the start of the run.
    pub time_s: f64,
    /// In the frame of the base.
    pub position_m: [f64; 3],
    /// In the frame of the base.
    pub velocity_m_per_s: [f64; 3],
}

/// A coupled machine as it moves.
#[derive(Debug)]
pub struct Coupled<M> {
    mechanism: M,
    /// One per axis.
    actuators: Vec<Actuator>,
    stops: Vec<Stop>,
    state: State,
    /// What the actuators applied in the last period.
    actuator_forces: Axes,
}

impl<M: Mechanism> Coupled<M> {
    /// At rest at the start position.
    ///
    /// # Errors
    /// The fastest parameter, if it takes too many sub-steps to resolve.
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

    /// The truth about an axis now; all 0 for an axis that it does not have.
    #[must_use]
    pub fn axis(&self, axis: usize) -> CoupledAxisState {
        let of = |values: &Axes| values.get(axis).copied().unwrap_or_default();
        CoupledAxisState {
            position: of(&self.state.position),
            velocity: of(&self.state.velocity),
            actuator_force: of(&self.actuator_forces),
        }
    }

    /// All positions now, `rad` or `m`.
    #[must_use]
    pub fn positions(&self) -> &Axes {
        &self.state.position
    }

    /// All velocities now, `rad/s` or `m/s`.
    #[must_use]
    pub fn velocities(&self) -> &Axes {
        &self.state.velocity
    }

    /// Puts it to these positions and velocities; missing entries are 0, surplus is ignored. The energy account goes
    /// on as if it had always been there.
    pub fn place(&mut self, positions: &[f64], velocities: &[f64]) {
        self.state.position = self.axes_of(positions);
        self.state.velocity = self.axes_of(velocities);
    }

    /// Where the energy is now.
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

    /// The torques (`N m` or `N`) that hold it at rest in `positions` against gravity.
    #[must_use]
    pub fn gravity_torques(&self, positions: &[f64]) -> Axes {
        self.bias(positions, &[])
    }

    /// Coriolis, centrifugal and gravity terms, `N m` or `N`: what acceleration 0 takes, friction aside.
    #[must_use]
    pub fn bias(&self, positions: &[f64], velocities: &[f64]) -> Axes {
        self.mechanism.dynamics(&self.axes_of(positions), &self.axes_of(velocities)).bias
    }

    /// The mass matrix in `positions`, the motors' inertias included.
    #[must_use]
    pub fn mass_matrix(&self, positions: &[f64]) -> Matrix {
        self.dynamics(&self.axes_of(positions), &[0.0; MAX_DOF]).mass
    }

    /// Where the tip is in `positions`, `m`, in the frame of the base.
    #[must_use]
    pub fn forward_kinematics(&self, positions: &[f64]) -> [f64; 3] {
        self.mechanism.tip_m(&self.axes_of(positions))
    }

    /// The Jacobian of the tip in `positions`: one row per direction in space, one column per axis.
    #[must_use]
    pub fn tip_jacobian(&self, positions: &[f64]) -> [Axes; 3] {
        self.mechanism.tip_jacobian(&self.axes_of(positions))
    }

    /// Where the tip is and how it moves, at `time_s`.
    #[must_use]
    pub fn tip(&self, time_s: f64) -> Tip {
        self.tip_of(time_s, &self.state.position, &self.state.velocity)
    }

    /// Whether it pushes against an end of its travel.
    #[must_use]
    pub fn is_at_stop(&self) -> bool {
        self.stops.iter().any(|stop| stop.stored_j(&self.state.position) > 0.0)
    }

    fn tip_of(&self, time_s: f64, position: &Axes, velocity: &Axes) -> Tip {
        Tip {
            time_s,
            position_m: self.mechanism.tip_m(position),
            velocity_m_per_s: self.mechanism.tip_jacobian(position).map(|row| dot(&row, velocity)),
        }
    }

    /// Of mechanism and motors.
    fn dynamics(&self, position: &Axes, velocity: &Axes) -> Dynamics {
        let mut dynamics = self.mechanism.dynamics(position, velocity);
        for (axis, actuator) in self.actuators.iter().enumerate() {
            dynamics.mass[(axis, axis)] += actuator.inertia;
        }
        dynamics
    }

    /// As many values as it has axes; missing ones are 0.
    pub(super) fn axes_of(&self, values: &[f64]) -> Axes {
        let mut axes = [0.0; MAX_DOF];
        for (axis, value) in axes.iter_mut().take(self.axes()).zip(values) {
            *axis = *value;
        }
        axes
    }
}

/// The torques `Jᵀ f` that a force at the tip makes.
pub(super) fn transposed(jacobian: &[Axes; 3], force_n: &[f64; 3]) -> Axes {
    let mut torques = [0.0; MAX_DOF];
    for (row, force_n) in jacobian.iter().zip(force_n) {
        for (torque, lever) in torques.iter_mut().zip(row) {
            *torque += lever * force_n;
        }
    }
    torques
}

fn times(matrix: &Matrix, vector: &Axes) -> Axes {
    (matrix * SVector::from(*vector)).into()
}

fn dot(one: &Axes, other: &Axes) -> f64 {
    one.iter().zip(other).map(|(one, other)| one * other).sum()
}
