//! Environment of an axis: walls, springs, hands.

use serde::{Deserialize, Serialize};

use super::AxisSection;
use crate::plant::{JointParameters, StopsParameters};

/// Stiffness that replaces an infinite wall stiffness, `N/m` or `N m/rad`: 1 nm of penetration per newton.
pub const RIGID_STIFFNESS: f64 = 1e9;

/// Solid side of a wall.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum WallSide {
    /// Positions above the surface are inside the wall; it pushes towards smaller positions.
    Above,
    /// Positions below the surface are inside the wall; it pushes towards larger positions.
    Below,
}

/// Active environment of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum EnvironmentKind {
    /// The section `wall`.
    Wall,
    /// The section `spring`.
    Spring,
    /// No environment.
    Nothing,
}

/// `wall`: a one-sided spring-damper at the output. Units are rad and N m, or m and N.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct AxisWall {
    /// Position of the surface.
    pub position: f64,
    /// Stiffness, > 0; `inf` for a [rigid](RIGID_STIFFNESS) wall.
    pub stiffness: f64,
    /// Damping inside the wall.
    #[serde(default)]
    pub damping: f64,
    /// Solid side.
    #[serde(default = "above")]
    pub solid: WallSide,
}

/// `spring`: a two-sided spring-damper to ground, always attached.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct AxisSpring {
    /// Rest position.
    #[serde(default)]
    pub rest_position: f64,
    /// Stiffness, `N m/rad` or `N/m`, >= 0.
    pub stiffness: f64,
    /// Damping, `N m s/rad` or `N s/m`, >= 0.
    #[serde(default)]
    pub damping: f64,
}

/// `hand`: a human hand that is attached to the output, with a spring to its intended position; moves on `hand`
/// change this position.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct AxisHand {
    /// Inertia, `kg m²` or `kg`, >= 0.
    pub inertia: f64,
    /// Damping to ground, `N m s/rad` or `N s/m`, >= 0.
    pub damping: f64,
    /// Stiffness to the intended position, `N m/rad` or `N/m`, >= 0.
    #[serde(default)]
    pub stiffness: f64,
}

fn above() -> WallSide {
    WallSide::Above
}

impl AxisSection {
    /// Returns the joint with everything attached to it; `None` for a coupled axis. The spring of the hand pulls to
    /// 0; the rest of the hand's force is a [load](Self::hand_stiffness).
    #[must_use]
    pub fn joint(&self) -> Option<JointParameters> {
        let mut joint = self.plant.clone()?;
        if let Some(hand) = &self.hand {
            joint.load.inertia += hand.inertia;
            joint.load.damping += hand.damping;
        }
        let own = AxisSpring {
            rest_position: joint.load.rest_position,
            stiffness: joint.load.stiffness,
            damping: 0.0,
        };
        let AxisSpring { rest_position, stiffness, damping } = self.springs().fold(own, AxisSpring::beside);
        (joint.load.rest_position, joint.load.stiffness) = (rest_position, stiffness);
        joint.load.damping += damping;
        if let Some(wall) = self.active_wall() {
            let (min, max) = match wall.solid {
                WallSide::Above => (f64::NEG_INFINITY, wall.position),
                WallSide::Below => (wall.position, f64::INFINITY),
            };
            joint.stops =
                Some(StopsParameters { min, max, stiffness: wall.stiffness(), damping: wall.damping });
        }
        Some(joint)
    }

    /// Returns the active wall.
    #[must_use]
    pub fn active_wall(&self) -> Option<&AxisWall> {
        self.wall.as_ref().filter(|_| self.environment.is_none_or(|kind| kind == EnvironmentKind::Wall))
    }

    /// Returns the active spring.
    #[must_use]
    pub fn active_spring(&self) -> Option<&AxisSpring> {
        self.spring.as_ref().filter(|_| self.environment.is_none_or(|kind| kind == EnvironmentKind::Spring))
    }

    /// Returns the force of wall and spring on the axis.
    #[must_use]
    pub fn environment_force(&self, position: f64, velocity: f64) -> f64 {
        self.active_spring().map_or(0.0, |spring| spring.force(position, velocity))
            + self.active_wall().map_or(0.0, |wall| wall.force(position, velocity))
    }

    /// Returns the force of hand, spring and wall on the axis, without the inertia of the hand; the spring of the
    /// hand pulls to 0.
    #[must_use]
    pub fn force(&self, position: f64, velocity: f64) -> f64 {
        let springs: f64 = self.springs().map(|spring| spring.force(position, velocity)).sum();
        let hand = self.hand.as_ref().map_or(0.0, |hand| -hand.damping * velocity);
        springs + hand + self.active_wall().map_or(0.0, |wall| wall.force(position, velocity))
    }

    /// Adds the inertia and damping of the hand, without its stiffness.
    #[must_use]
    pub fn without_hand_stiffness(&self) -> Self {
        let hand = self.hand.clone().map(|hand| AxisHand { stiffness: 0.0, ..hand });
        Self { hand, ..self.clone() }
    }

    /// Stiffness of the hand, `N m/rad` or `N/m`; 0 without a hand.
    #[must_use]
    pub fn hand_stiffness(&self) -> f64 {
        self.hand.as_ref().map_or(0.0, |hand| hand.stiffness)
    }

    /// Attaches a further spring-damper.
    pub(super) fn attach(&mut self, stiffness: f64, rest_position: f64, damping: f64) {
        let one = AxisSpring { rest_position, stiffness, damping };
        self.spring = Some(self.spring.take().map_or(one.clone(), |spring| spring.beside(one)));
    }

    /// Stiffness of the hand, and spring-damper of the environment.
    fn springs(&self) -> impl Iterator<Item = AxisSpring> {
        let hand = AxisSpring { rest_position: 0.0, stiffness: self.hand_stiffness(), damping: 0.0 };
        core::iter::once(hand).chain(self.active_spring().cloned())
    }
}

impl AxisSpring {
    /// Combines two springs to ground: the stiffnesses add, and the rest position is where the forces cancel.
    fn beside(self, other: Self) -> Self {
        let stiffness = self.stiffness + other.stiffness;
        let moment = self.stiffness * self.rest_position + other.stiffness * other.rest_position;
        let rest_position = if stiffness > 0.0 { moment / stiffness } else { 0.0 };
        Self { rest_position, stiffness, damping: self.damping + other.damping }
    }

    fn force(&self, position: f64, velocity: f64) -> f64 {
        self.stiffness * (self.rest_position - position) - self.damping * velocity
    }
}

impl AxisWall {
    /// Stiffness of its spring.
    #[must_use]
    pub fn stiffness(&self) -> f64 {
        self.stiffness.min(RIGID_STIFFNESS)
    }

    /// Penetration depth of a position, >= 0.
    #[must_use]
    pub fn depth(&self, position: f64) -> f64 {
        let beyond = position - self.position;
        match self.solid {
            WallSide::Above => beyond.max(0.0),
            WallSide::Below => (-beyond).max(0.0),
        }
    }

    /// Force of the wall, which pushes only.
    fn force(&self, position: f64, velocity: f64) -> f64 {
        let depth = self.depth(position);
        if depth <= 0.0 {
            return 0.0;
        }
        let outward = match self.solid {
            WallSide::Above => -1.0,
            WallSide::Below => 1.0,
        };
        outward * (self.stiffness() * depth - self.damping * outward * velocity).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_springs_pull_as_one() {
        let springs = [(3.0, 0.2, 0.1), (1.0, -0.4, 0.5)]
            .map(|(stiffness, rest_position, damping)| AxisSpring { rest_position, stiffness, damping });
        let [one, other] = springs.clone();
        let together = one.beside(other);
        for (position, velocity) in [(-1.0, 0.0), (0.0, 2.0), (0.7, -1.0)] {
            let apart: f64 = springs.iter().map(|spring| spring.force(position, velocity)).sum();
            assert!((apart - together.force(position, velocity)).abs() < 1e-12);
        }
    }

    #[test]
    fn a_wall_pushes_out_and_never_holds() {
        for (solid, sign) in [(WallSide::Above, 1.0), (WallSide::Below, -1.0)] {
            let wall = AxisWall { position: 0.1 * sign, stiffness: 100.0, damping: 5.0, solid };
            assert!(wall.force(0.05 * sign, 3.0 * sign).abs() < 1e-12, "outside");
            assert!((wall.force(0.2 * sign, 1.0 * sign) + 15.0 * sign).abs() < 1e-9, "going in");
            assert!(wall.force(0.2 * sign, -10.0 * sign).abs() < 1e-12, "leaving faster than it follows");
        }
    }
}
