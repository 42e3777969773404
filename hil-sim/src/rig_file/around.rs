//! What an axis meets, and who holds it: walls, springs, hands.

use serde::{Deserialize, Serialize};

use super::AxisSection;
use crate::plant::{JointParameters, StopsParameters, WallSide};

/// `wall`: a one-sided spring-damper at the output. Units are rad and N m, or m and N.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct AxisWall {
    /// Its surface.
    pub position: f64,
    /// Of its spring, > 0.
    pub stiffness: f64,
    /// Acts while the axis is inside.
    #[serde(default)]
    pub damping: f64,
    /// Which side of the surface is solid.
    #[serde(default = "above")]
    pub solid: WallSide,
}

/// `spring`: a two-sided spring-damper to ground, always attached.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct AxisSpring {
    /// Where it is relaxed.
    #[serde(default)]
    pub rest_position: f64,
    /// `N m/rad` or `N/m`, >= 0.
    pub stiffness: f64,
    /// `N m s/rad` or `N s/m`, >= 0.
    #[serde(default)]
    pub damping: f64,
}

/// `hand`: a human hand that moves with the output, and a spring to where it wants to be, which moves on `hand` move.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct AxisHand {
    /// `kg m²` or `kg`, >= 0.
    pub inertia: f64,
    /// To ground, `N m s/rad` or `N s/m`, >= 0.
    pub damping: f64,
    /// To its target, `N m/rad` or `N/m`, >= 0.
    #[serde(default)]
    pub stiffness: f64,
}

fn above() -> WallSide {
    WallSide::Above
}

impl AxisSection {
    /// The joint with all that moves with it and holds it; the spring of its hand pulls to 0, and what it wants more than
    /// that is a [load](Self::hand_stiffness).
    #[must_use]
    pub fn joint(&self) -> JointParameters {
        let mut joint = self.plant.clone();
        if let Some(hand) = &self.hand {
            joint.load.inertia += hand.inertia;
            joint.load.damping += hand.damping;
            add_spring(&mut joint, hand.stiffness, 0.0);
        }
        if let Some(spring) = &self.spring {
            joint.load.damping += spring.damping;
            add_spring(&mut joint, spring.stiffness, spring.rest_position);
        }
        if let Some(wall) = &self.wall {
            let (min, max) = match wall.solid {
                WallSide::Above => (f64::NEG_INFINITY, wall.position),
                WallSide::Below => (wall.position, f64::INFINITY),
            };
            joint.stops =
                Some(StopsParameters { min, max, stiffness: wall.stiffness, damping: wall.damping });
        }
        joint
    }

    /// The joint as a linear system, free or, where it has a wall, held by that from both sides.
    #[must_use]
    pub fn linear_joint(&self, in_contact: bool) -> JointParameters {
        let mut joint = self.joint().linear();
        if let Some(wall) = self.wall.as_ref().filter(|_| in_contact) {
            joint.load.damping += wall.damping;
            // Touching as it stands.
            let start_position = joint.load.start_position;
            add_spring(&mut joint, wall.stiffness, start_position);
        }
        joint
    }

    /// Of the hand's spring, `N m/rad` or `N/m`; 0 without one.
    #[must_use]
    pub fn hand_stiffness(&self) -> f64 {
        self.hand.as_ref().map_or(0.0, |hand| hand.stiffness)
    }
}

/// Two springs to ground are one: their stiffnesses add up, and its rest is where their forces cancel.
fn add_spring(joint: &mut JointParameters, stiffness: f64, rest_position: f64) {
    let load = &mut joint.load;
    let both = load.stiffness + stiffness;
    if both > 0.0 {
        load.rest_position = (load.stiffness * load.rest_position + stiffness * rest_position) / both;
        load.stiffness = both;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_springs_pull_as_one() {
        let mut joint = JointParameters::of_inertia(1.0);
        add_spring(&mut joint, 3.0, 0.2);
        add_spring(&mut joint, 1.0, -0.4);
        for position in [-1.0, 0.0, 0.7] {
            let apart = 3.0 * (0.2 - position) + (-0.4 - position);
            let together = joint.load.stiffness * (joint.load.rest_position - position);
            assert!((apart - together).abs() < 1e-12);
        }
    }
}
