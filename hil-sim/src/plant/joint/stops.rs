//! End stops: a spring-damper at each end, which pushes only.

use super::state::State;
use crate::plant::parameter::{ParameterError, not_negative, positive, require};
use serde::{Deserialize, Serialize};

/// End stops. Units of a rotary output; of a linear output in parentheses.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct StopsParameters {
    /// Lower end, `rad` (`m`); `-inf`: no stop.
    pub min: f64,
    /// Upper end, `rad` (`m`), > `min`; `inf`: no stop.
    pub max: f64,
    /// `N m/rad` (`N/m`), > 0.
    pub stiffness: f64,
    /// `N m s/rad` (`N s/m`), >= 0.
    pub damping: f64,
}

impl Default for StopsParameters {
    /// No stops; default of a stop: 1e4 N m/rad (N/m) without damping.
    fn default() -> Self {
        Self { min: f64::NEG_INFINITY, max: f64::INFINITY, stiffness: 1e4, damping: 0.0 }
    }
}

/// Stop in contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::plant) enum Contact {
    Free,
    /// Inside a stop that cannot follow the retreating output.
    Released,
    Lower,
    Upper,
}

impl StopsParameters {
    pub(in crate::plant) fn check(&self) -> Result<(), ParameterError> {
        require("min", self.min, self.min < f64::INFINITY, "a number or -inf")?;
        require("max", self.max, self.max > self.min, "> `min`, or inf")?;
        positive("stiffness", self.stiffness)?;
        not_negative("damping", self.damping)
    }

    pub(in crate::plant) fn contact(&self, position: f64, velocity: f64) -> Contact {
        let (contact, depth, inward) = if position > self.max {
            (Contact::Upper, position - self.max, velocity)
        } else if position < self.min {
            (Contact::Lower, self.min - position, -velocity)
        } else {
            return Contact::Free;
        };
        if self.stiffness * depth + self.damping * inward > 0.0 { contact } else { Contact::Released }
    }

    /// Returns the force of the stop in `contact`, `N m` or `N`.
    pub(in crate::plant) fn force(&self, contact: Contact, position: f64, velocity: f64) -> f64 {
        match contact {
            Contact::Free | Contact::Released => 0.0,
            Contact::Lower => self.stiffness * (self.min - position) - self.damping * velocity,
            Contact::Upper => self.stiffness * (self.max - position) - self.damping * velocity,
        }
    }

    /// Minimum changes of position and velocity before a contact change: the force of a stop vanishes after half by
    /// position or half by velocity. `None` if unknown.
    pub(super) fn reach(&self, contact: Contact, state: &State) -> Option<[f64; 2]> {
        let State { position, velocity, .. } = *state;
        let depth = match contact {
            Contact::Free => return Some([(self.max - position).min(position - self.min), f64::INFINITY]),
            Contact::Released => return None,
            Contact::Lower => self.min - position,
            Contact::Upper => position - self.max,
        };
        let half_push = 0.5 * self.force(contact, position, velocity).abs();
        Some([depth.min(half_push / self.stiffness), half_push / self.damping])
    }

    /// Signed distance of the output beyond an end, `rad` or `m`.
    pub(in crate::plant) fn beyond(&self, position: f64) -> f64 {
        (position - self.max).max(0.0) - (self.min - position).max(0.0)
    }
}
