//! End stops of an axis or of a difference of axes.

use super::{AxisValues, dot};
use crate::plant::joint::{Contact, StopsParameters};

/// A spring-damper at each end of `direction · q`, which pushes only.
#[derive(Debug, Clone)]
pub(in crate::plant) struct Stop {
    /// Path of its stiffness, for errors.
    pub(in crate::plant) stiffness_path: String,
    /// Path of its damping, for errors.
    pub(in crate::plant) damping_path: String,
    /// Weight of each axis in the limited coordinate.
    pub(in crate::plant) direction: AxisValues,
    pub(in crate::plant) ends: StopsParameters,
}

impl Stop {
    pub(super) fn contact(&self, position: &AxisValues, velocity: &AxisValues) -> Contact {
        self.ends.contact(dot(&self.direction, position), dot(&self.direction, velocity))
    }

    /// Force along its direction, `N m` or `N`.
    pub(super) fn force(&self, contact: Contact, position: &AxisValues, velocity: &AxisValues) -> f64 {
        self.ends.force(contact, dot(&self.direction, position), dot(&self.direction, velocity))
    }

    /// Power dissipated by `force`, `W`.
    pub(super) fn lost_w(&self, force: f64, position: &AxisValues, velocity: &AxisValues) -> f64 {
        let spring = self.ends.stiffness * self.ends.beyond(dot(&self.direction, position));
        -(force + spring) * dot(&self.direction, velocity)
    }

    pub(super) fn stored_j(&self, position: &AxisValues) -> f64 {
        let beyond = self.ends.beyond(dot(&self.direction, position));
        0.5 * self.ends.stiffness * beyond * beyond
    }
}
