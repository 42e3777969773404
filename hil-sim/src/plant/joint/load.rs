//! What a joint moves: inertia, damping, gravity; and the ends of its way.

use serde::{Deserialize, Serialize};

use crate::plant::parameter::{ParameterError, finite, not_negative, positive, require};

/// What moves. Units are of an output that turns, then of one that slides.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct LoadParameters {
    /// `kg m²` or `kg`, > 0.
    pub inertia: f64,
    /// Viscous damping to ground, `N m s/rad` or `N s/m`, >= 0.
    pub damping: f64,
    /// Largest torque of gravity, `m g l`, `N m`: `-gravity sin(position - gravity_angle_rad)`. Of an output that slides,
    /// nothing.
    pub gravity: f64,
    /// Where it hangs down, `rad`.
    pub gravity_angle_rad: f64,
    /// Where it stands at the start, at rest, `rad` or `m`.
    pub start_position: f64,
}

impl Default for LoadParameters {
    /// A small link, 0.01 kg m², with nothing that pulls or brakes it.
    fn default() -> Self {
        Self { inertia: 0.01, damping: 0.0, gravity: 0.0, gravity_angle_rad: 0.0, start_position: 0.0 }
    }
}

impl LoadParameters {
    pub(super) fn check(&self) -> Result<(), ParameterError> {
        positive("inertia", self.inertia)?;
        not_negative("damping", self.damping)?;
        finite("gravity", self.gravity)?;
        finite("gravity_angle_rad", self.gravity_angle_rad)?;
        finite("start_position", self.start_position)
    }

    pub(super) fn gravity_at(&self, position: f64) -> f64 {
        // Most joints in a file have none, and a sine takes longer than the rest.
        let is_there = self.gravity.abs() > 0.0;
        if is_there { -self.gravity * libm::sin(position - self.gravity_angle_rad) } else { 0.0 }
    }
}

/// Hard stops: springs with damping that push back and never pull.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct StopsParameters {
    /// Smallest free position, `rad` or `m`.
    pub min: f64,
    /// Largest free position, `rad` or `m`.
    pub max: f64,
    /// `N m/rad` or `N/m`, > 0.
    pub stiffness: f64,
    /// `N m s/rad` or `N s/m`, >= 0.
    #[serde(default)]
    pub damping: f64,
}

impl StopsParameters {
    pub(super) fn check(&self) -> Result<(), ParameterError> {
        finite("min", self.min)?;
        finite("max", self.max)?;
        require("max", self.max, self.max > self.min, &format!("> min = {}", self.min))?;
        positive("stiffness", self.stiffness)?;
        not_negative("damping", self.damping)
    }

    pub(super) fn force(&self, position: f64, velocity: f64) -> f64 {
        let beyond = position - position.clamp(self.min, self.max);
        let push = -self.stiffness * beyond - self.damping * velocity;
        if beyond > 0.0 {
            push.min(0.0)
        } else if beyond < 0.0 {
            push.max(0.0)
        } else {
            0.0
        }
    }
}
