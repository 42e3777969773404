//! An arm: an open chain of rigid links, each on a joint that turns or slides.
//!
//! ```text
//!   base ── joint 0 ── link 0 ── joint 1 ── link 1 ── … ── link n-1 ── tip
//! ```
//! Joints are placed by the modified Denavit-Hartenberg parameters (J. J. Craig, "Introduction to Robotics", 1986,
//! chapter 3; W. Khalil, J. Kleinfinger, ICRA 1986): from the frame of the link before, turn by `alpha_rad` about its x,
//! go `a_m` along its x, turn by `theta_rad` about the new z, go `d_m` along the new z. The joint turns about that z, or
//! slides along it, so that its position adds to `theta_rad` or to `d_m`. The frame of a link sits on its own joint; mass
//! centre and tip are said in that frame.
//!
//! What is named without a unit has that of a joint that turns or of one that slides: `rad`, `N m`, `kg m²` or `m`, `N`,
//! `kg`. The motion itself, friction and stops are those of every [coupled machine](super::Coupled).

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

/// An arm as it moves.
pub type Arm = Coupled<Chain>;

/// One arm.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ArmParameters {
    /// In the frame of the base, `m/s²`; without it, 9.81 against z.
    #[serde(default = "earth")]
    pub gravity_m_per_s2: [f64; 3],
    /// Where the tip is, in the frame of the last link, `m`; without it, its origin.
    #[serde(default)]
    pub tip_m: [f64; 3],
    /// From the base to the tip.
    pub link: Vec<LinkParameters>,
}

fn earth() -> [f64; 3] {
    [0.0, 0.0, -9.81]
}

impl ArmParameters {
    /// The same without dry friction and stops. An actuator keeps its limit. How the links pull at each other is not
    /// linear in any arm.
    #[must_use]
    pub fn linear(&self) -> Self {
        Self { link: self.link.iter().map(LinkParameters::linear).collect(), ..self.clone() }
    }

    /// Says whether an arm like this can exist, and be simulated.
    ///
    /// # Errors
    /// The first parameter out of its range, or the one that would need too many sub-steps at the start.
    pub fn check(&self) -> Result<(), ParameterError> {
        self.build().map(drop)
    }

    /// The arm at rest at its start positions.
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
            link.check().map_err(|error| error.within(&path))?;
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
