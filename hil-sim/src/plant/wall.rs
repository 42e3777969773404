//! A wall: a spring-damper that pushes and never pulls.
//!
//! `F = max(0, K p + B dp/dt)` for penetration `p > 0`, else 0.

use super::environment::{Environment, Law, Role};
use super::parameter::{ParameterError, finite, not_negative, positive_or_infinite};
use serde::{Deserialize, Serialize};

/// What an infinite wall stiffness stands for, `N/m`: 1 nm of penetration per newton.
pub const RIGID_STIFFNESS_N_PER_M: f64 = 1e9;

/// Which side of a wall is solid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum WallSide {
    /// Positions above `position_m` are inside the wall; it pushes towards smaller positions.
    Above,
    /// Positions below `position_m` are inside the wall; it pushes towards larger positions.
    Below,
}

/// One wall.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct WallParameters {
    /// Surface, `m`.
    pub position_m: f64,
    /// `N/m`, > 0. `inf` means rigid: [`RIGID_STIFFNESS_N_PER_M`].
    pub stiffness_n_per_m: f64,
    /// `N s/m`, >= 0.
    pub damping_ns_per_m: f64,
    /// Which side is solid.
    pub solid: WallSide,
}

impl Default for WallParameters {
    /// An undamped wall of 10 kN/m, solid above 0.05 m.
    fn default() -> Self {
        Self { position_m: 0.05, stiffness_n_per_m: 1e4, damping_ns_per_m: 0.0, solid: WallSide::Above }
    }
}

impl WallParameters {
    /// Says whether a wall like this can exist.
    ///
    /// # Errors
    /// The first parameter outside its range.
    pub fn check(&self) -> Result<(), ParameterError> {
        finite("position_m", self.position_m)?;
        positive_or_infinite("stiffness_n_per_m", self.stiffness_n_per_m)?;
        not_negative("damping_ns_per_m", self.damping_ns_per_m)
    }

    /// The wall these parameters describe.
    ///
    /// # Errors
    /// The first parameter outside its range.
    pub fn build(&self) -> Result<Wall, ParameterError> {
        self.check()?;
        Ok(Wall {
            position_m: self.position_m,
            stiffness_n_per_m: self.stiffness_n_per_m.min(RIGID_STIFFNESS_N_PER_M),
            damping_ns_per_m: self.damping_ns_per_m,
            inward: match self.solid {
                WallSide::Above => 1.0,
                WallSide::Below => -1.0,
            },
        })
    }
}

/// A one-sided spring-damper.
#[derive(Debug, Clone)]
pub struct Wall {
    position_m: f64,
    stiffness_n_per_m: f64,
    damping_ns_per_m: f64,
    /// +1 or -1: the direction that leads into the wall.
    inward: f64,
}

impl Environment for Wall {
    fn role(&self) -> Role {
        Role::Wall
    }

    /// It changes where the push vanishes, which takes at least half of it by position or half by velocity.
    fn law(&self, _elapsed_s: f64, position_m: f64, velocity_m_per_s: f64) -> Law {
        let penetration_m = self.inward * (position_m - self.position_m);
        let push_n =
            self.stiffness_n_per_m * penetration_m + self.damping_ns_per_m * (self.inward * velocity_m_per_s);
        if penetration_m <= 0.0 {
            return Law { reach_m: -penetration_m, ..Law::default() };
        }
        let reach_m = (0.5 * push_n.abs() / self.stiffness_n_per_m).min(penetration_m);
        let reach_m_per_s = 0.5 * push_n.abs() / self.damping_ns_per_m;
        if push_n <= 0.0 {
            return Law { reach_m, reach_m_per_s, ..Law::default() };
        }
        Law {
            force_n: -self.inward * push_n,
            rate_n_per_s: 0.0,
            stiffness_n_per_m: self.stiffness_n_per_m,
            damping_ns_per_m: self.damping_ns_per_m,
            reach_m,
            reach_m_per_s,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Over all positions and velocities, whichever side is solid: never a pull, nothing outside.
    #[test]
    fn it_pushes_outward_or_not_at_all() {
        for (solid, inward) in [(WallSide::Above, 1.0), (WallSide::Below, -1.0)] {
            let wall = WallParameters { damping_ns_per_m: 50.0, solid, ..WallParameters::default() }
                .build()
                .unwrap();
            let mut pushes = 0;
            for i in -50..=50_i32 {
                for j in -50..=50_i32 {
                    let (penetration_m, inward_velocity) = (f64::from(i) * 1e-4, f64::from(j) * 0.02);
                    let push_n = -inward
                        * wall.law(0.0, 0.05 + inward * penetration_m, inward * inward_velocity).force_n;
                    let expected =
                        if i > 0 { (1e4 * penetration_m + 50.0 * inward_velocity).max(0.0) } else { 0.0 };
                    assert!((push_n - expected).abs() < 1e-9, "{push_n} N instead of {expected} N");
                    pushes += u32::from(push_n > 0.0);
                }
            }
            assert!((2000..5000).contains(&pushes), "{pushes} of 10201 states push");
        }
    }

    #[test]
    fn infinite_stiffness_is_rigid_and_nonsense_is_refused() {
        let wall =
            WallParameters { stiffness_n_per_m: f64::INFINITY, ..WallParameters::default() }.build().unwrap();
        assert!((wall.law(0.0, 0.05 + 1e-9, 0.0).force_n + 1.0).abs() < 1e-6, "1 nm holds 1 N");
        for stiffness_n_per_m in [f64::NAN, 0.0, -1e4] {
            let refused =
                WallParameters { stiffness_n_per_m, ..WallParameters::default() }.build().unwrap_err();
            assert_eq!(refused.path, "stiffness_n_per_m");
        }
    }
}
