//! Load: inertia with damping, gravity, and a spring to ground.

use crate::plant::parameter::{ParameterError, finite, not_negative, positive};
use serde::{Deserialize, Serialize};

/// The load on the output. Units of a rotary output; of a linear output in parentheses.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LoadParameters {
    /// Inertia, `kg m²` (`kg`), > 0. Required.
    pub inertia: f64,
    /// Viscous damping to ground, `N m s/rad` (`N s/m`), >= 0.
    #[serde(default)]
    pub damping: f64,
    /// Output position at the start, `rad` (`m`), at rest and with any spring relaxed.
    #[serde(default)]
    pub start_position: f64,
    /// `m g l` of a hanging load on a rotary output, `N m`: its torque is `-m g l sin(position - gravity_angle)`.
    /// Negative: inverted pendulum.
    #[serde(default)]
    pub gravity_torque_nm: f64,
    /// Position at which the load hangs straight down, `rad`.
    #[serde(default)]
    pub gravity_angle_rad: f64,
    /// Weight along a linear output, `N`, positive towards smaller positions.
    #[serde(default)]
    pub gravity_force_n: f64,
    /// Stiffness of the spring to ground, `N m/rad` (`N/m`), >= 0.
    #[serde(default)]
    pub stiffness: f64,
    /// Rest position of the spring, `rad` (`m`).
    #[serde(default)]
    pub rest_position: f64,
}

impl LoadParameters {
    /// Creates a load with this inertia (`kg m²` or `kg`).
    #[must_use]
    pub fn of_inertia(inertia: f64) -> Self {
        Self {
            inertia,
            damping: 0.0,
            start_position: 0.0,
            gravity_torque_nm: 0.0,
            gravity_angle_rad: 0.0,
            gravity_force_n: 0.0,
            stiffness: 0.0,
            rest_position: 0.0,
        }
    }

    pub(super) fn check(&self) -> Result<(), ParameterError> {
        positive("inertia", self.inertia)?;
        not_negative("damping", self.damping)?;
        finite("start_position", self.start_position)?;
        finite("gravity_torque_nm", self.gravity_torque_nm)?;
        finite("gravity_angle_rad", self.gravity_angle_rad)?;
        finite("gravity_force_n", self.gravity_force_n)?;
        not_negative("stiffness", self.stiffness)?;
        finite("rest_position", self.rest_position)
    }

    /// Returns the force of gravity and spring, `N m` or `N`.
    pub(super) fn potential_force(&self, position: f64) -> f64 {
        self.linear_force(position) + self.hanging_force(position)
    }

    /// Returns the gravity torque of a rotary load, `N m`.
    pub(super) fn hanging_force(&self, position: f64) -> f64 {
        if self.gravity_torque_nm.abs() <= 0.0 {
            return 0.0;
        }
        -self.gravity_torque_nm * libm::sin(position - self.gravity_angle_rad)
    }

    /// Returns the force of the spring and of a weight along a linear output, `N m` or `N`.
    pub(super) fn linear_force(&self, position: f64) -> f64 {
        self.stiffness * (self.rest_position - position) - self.gravity_force_n
    }

    /// Potential energy, `J`.
    pub(super) fn potential_j(&self, position: f64) -> f64 {
        let stretch = position - self.rest_position;
        let linear_j = 0.5 * self.stiffness * stretch * stretch + self.gravity_force_n * position;
        if self.gravity_torque_nm.abs() <= 0.0 {
            return linear_j;
        }
        linear_j - self.gravity_torque_nm * libm::cos(position - self.gravity_angle_rad)
    }
}
