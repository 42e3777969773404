//! Environment of an axis: walls, springs, hands.

use serde::{Deserialize, Serialize};

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

impl AxisSpring {
    /// Combines two springs to ground: the stiffnesses add, and the rest position is where the forces cancel.
    pub(super) fn beside(self, other: Self) -> Self {
        let stiffness = self.stiffness + other.stiffness;
        let moment = self.stiffness * self.rest_position + other.stiffness * other.rest_position;
        let rest_position = if stiffness > 0.0 { moment / stiffness } else { 0.0 };
        Self { rest_position, stiffness, damping: self.damping + other.damping }
    }

    pub(super) fn force(&self, position: f64, velocity: f64) -> f64 {
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
    pub fn penetration_depth(&self, position: f64) -> f64 {
        let beyond = position - self.position;
        match self.solid {
            WallSide::Above => beyond.max(0.0),
            WallSide::Below => (-beyond).max(0.0),
        }
    }

    /// Force of the wall, which pushes only.
    pub(super) fn force(&self, position: f64, velocity: f64) -> f64 {
        let depth = self.penetration_depth(position);
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
