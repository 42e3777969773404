//! An end of the travel, of one axis or of a difference of axes.

use super::{Axes, dot};
use crate::plant::joint::{Contact, StopsParameters};

/// A spring-damper at each end of `direction · q`, which pushes and never pulls.
#[derive(Debug, Clone)]
pub(in crate::plant) struct Stop {
    /// Where its stiffness stands, for errors.
    pub(in crate::plant) stiffness_path: String,
    /// Where its damping stands, for errors.
    pub(in crate::plant) damping_path: String,
    /// Share of each axis in what the stop limits.
    pub(in crate::plant) direction: Axes,
    pub(in crate::plant) ends: StopsParameters,
}

impl Stop {
    pub(super) fn contact(&self, position: &Axes, velocity: &Axes) -> Contact {
        self.ends.contact(dot(&self.direction, position), dot(&self.direction, velocity))
    }

    /// Along its direction, `N m` or `N`.
    pub(super) fn force(&self, contact: Contact, position: &Axes, velocity: &Axes) -> f64 {
        self.ends.force(contact, dot(&self.direction, position), dot(&self.direction, velocity))
    }

    /// Of `force`, what its spring does not give back, `W`.
    pub(super) fn lost_w(&self, force: f64, position: &Axes, velocity: &Axes) -> f64 {
        let spring = self.ends.stiffness * self.ends.beyond(dot(&self.direction, position));
        -(force + spring) * dot(&self.direction, velocity)
    }

    pub(super) fn stored_j(&self, position: &Axes) -> f64 {
        let beyond = self.ends.beyond(dot(&self.direction, position));
        0.5 * self.ends.stiffness * beyond * beyond
    }
}
