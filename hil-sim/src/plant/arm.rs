//! An arm: an open chain of rigid links with revolute or prismatic joints.
//!
//! ```text
//!   base ── joint 0 ── link 0 ── joint 1 ── link 1 ── … ── link n-1 ── tip
//! ```
//! Joints are defined by the modified Denavit-Hartenberg parameters (J. J. Craig, "Introduction to Robotics", 1986,
//! chapter 3; W. Khalil, J. Kleinfinger, ICRA 1986): from the frame of the previous link, rotate by `alpha_rad` about
//! its x, translate by `a_m` along its x, rotate by `theta_rad` about the new z, translate by `d_m` along the new z.
//! The joint rotates about this z or translates along it; its position adds to `theta_rad` or `d_m`. The frame of a
//! link is at its joint; mass centre and tip are given in this frame.
//!
//! Quantities without a unit in their name are `rad`, `N m`, `kg m²` for a revolute joint and `m`, `N`, `kg` for a
//! prismatic joint. Integration, friction and stops are those of every [coupled machine](super::Coupled).

mod chain;
mod link;
mod spatial;
#[cfg(test)]
mod tests;
mod vector;

pub use chain::Chain;
pub use link::{LinkKind, LinkParameters};

use super::coupled::{Coupled, Stop};
use super::parameter::{ParameterError, finite, require};
use dimsart_core::limits::MAX_DOF;
use serde::{Deserialize, Serialize};

/// Simulation of an arm.
pub type Arm = Coupled<Chain>;

/// Parameters of an arm.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ArmParameters {
    /// Gravity in the base frame, `m/s²`; default: 9.81 against z.
    #[serde(default = "earth")]
    pub gravity_m_per_s2: [f64; 3],
    /// Tip in the frame of the last link, `m`; default: its origin.
    #[serde(default)]
    pub tip_m: [f64; 3],
    /// Links from base to tip.
    pub link: Vec<LinkParameters>,
}

fn earth() -> [f64; 3] {
    [0.0, 0.0, -9.81]
}

impl ArmParameters {
    /// Returns the arm without Coulomb friction and stops. Actuator limits and the coupled dynamics remain.
    #[must_use]
    pub fn linear(&self) -> Self {
        Self { link: self.link.iter().map(LinkParameters::linear).collect(), ..self.clone() }
    }

    /// Checks whether the arm is physically possible and can be simulated.
    ///
    /// # Errors
    /// The first parameter out of range, or the parameter that requires too many sub-steps at the start.
    pub fn check(&self) -> Result<(), ParameterError> {
        self.build().map(drop)
    }

    /// Builds the arm, at rest at its start positions.
    ///
    /// # Errors
    /// As [`check`](Self::check).
    pub fn build(&self) -> Result<Arm, ParameterError> {
        for (path, vector) in [("gravity_m_per_s2", &self.gravity_m_per_s2), ("tip_m", &self.tip_m)] {
            for (index, value) in vector.iter().enumerate() {
                finite(&format!("{path}[{index}]"), *value)?;
            }
        }
        let links = u32::try_from(self.link.len()).map_or(f64::INFINITY, f64::from);
        let is_allowed = (1..=MAX_DOF).contains(&self.link.len());
        require("link", links, is_allowed, &format!("1 to {MAX_DOF} links"))?;
        let mut actuators = Vec::new();
        let mut stops = Vec::new();
        for (axis, link) in self.link.iter().enumerate() {
            let path = format!("link[{axis}]");
            link.check().map_err(|error| error.with_path_prefix(&path))?;
            actuators.push(link.actuator(&path));
            if let Some(ends) = &link.stops {
                let direction = core::array::from_fn(|other| if other == axis { 1.0 } else { 0.0 });
                stops.push(Stop {
                    stiffness_path: format!("{path}.stops.stiffness"),
                    damping_path: format!("{path}.stops.damping"),
                    direction,
                    ends: ends.clone(),
                });
            }
        }
        Coupled::new(Chain::of(self), actuators, stops)
    }
}
