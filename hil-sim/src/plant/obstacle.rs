//! What a slow push meets: the straight line that an environment's force follows where it is pressed.

use super::{Environment, EnvironmentKind, Environments, ParameterError};

/// A spring and a damper from a surface on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Obstacle {
    /// Where its force begins, `m`.
    pub surface_m: f64,
    /// `N/m`, > 0.
    pub stiffness_n_per_m: f64,
    /// `N s/m`.
    pub damping_ns_per_m: f64,
}

impl Obstacle {
    /// What `environment` is to a mass that rests at `position_m`; none where it has no stiffness.
    #[must_use]
    pub fn at(environment: &dyn Environment, position_m: f64) -> Option<Self> {
        let law = environment.law(0.0, position_m, 0.0);
        (law.stiffness_n_per_m > 0.0).then(|| Self {
            surface_m: position_m + law.force_n / law.stiffness_n_per_m,
            stiffness_n_per_m: law.stiffness_n_per_m,
            damping_ns_per_m: law.damping_ns_per_m,
        })
    }
}

impl Environments {
    /// What an environment of this kind is to a mass that rests at `position_m`; none where it is not met.
    ///
    /// # Errors
    /// As [`build`](Self::build).
    pub fn obstacle(
        &self,
        kind: EnvironmentKind,
        position_m: f64,
    ) -> Result<Option<Obstacle>, ParameterError> {
        let environment = self.build(kind)?;
        Ok(environment.and_then(|environment| Obstacle::at(environment.as_ref(), position_m)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{SpringParameters, WallParameters};

    #[test]
    fn a_wall_is_met_behind_its_surface_and_a_spring_everywhere() {
        let environments = Environments {
            wall: WallParameters { position_m: 0.05, stiffness_n_per_m: 1e4, ..WallParameters::default() },
            spring: SpringParameters {
                rest_position_m: 0.01,
                stiffness_n_per_m: 200.0,
                damping_ns_per_m: 5.0,
            },
        };
        let met = |kind, position_m| environments.obstacle(kind, position_m).unwrap();
        let wall = met(EnvironmentKind::Wall, 0.5).unwrap();
        assert!((wall.surface_m - 0.05).abs() < 1e-12 && (wall.stiffness_n_per_m - 1e4).abs() < 1e-9);
        assert_eq!(met(EnvironmentKind::Wall, 0.02), None);
        for position_m in [-0.5, 0.5] {
            let spring = met(EnvironmentKind::Spring, position_m).unwrap();
            assert!((spring.surface_m - 0.01).abs() < 1e-12 && (spring.damping_ns_per_m - 5.0).abs() < 1e-12);
        }
        assert_eq!(met(EnvironmentKind::Nothing, 0.5), None);
    }
}
