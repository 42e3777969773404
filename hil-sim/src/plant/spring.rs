//! A two-sided spring-damper to a fixed point, always attached.
//!
//! `F = K (rest - x) - B v`

use super::environment::{Environment, Law, Role};
use super::parameter::{ParameterError, finite, not_negative};
use serde::{Deserialize, Serialize};

/// One attached spring.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct SpringParameters {
    /// Where it pulls to, `m`.
    pub rest_position_m: f64,
    /// `N/m`, >= 0.
    pub stiffness_n_per_m: f64,
    /// `N s/m`, >= 0.
    pub damping_ns_per_m: f64,
}

impl SpringParameters {
    /// Says whether a spring like this can exist.
    ///
    /// # Errors
    /// The first parameter outside its range.
    pub fn check(&self) -> Result<(), ParameterError> {
        finite("rest_position_m", self.rest_position_m)?;
        not_negative("stiffness_n_per_m", self.stiffness_n_per_m)?;
        not_negative("damping_ns_per_m", self.damping_ns_per_m)
    }

    /// The spring these parameters describe.
    ///
    /// # Errors
    /// The first parameter outside its range.
    pub fn build(&self) -> Result<Spring, ParameterError> {
        self.check()?;
        Ok(Spring { parameters: self.clone() })
    }
}

/// A two-sided spring-damper.
#[derive(Debug, Clone)]
pub struct Spring {
    parameters: SpringParameters,
}

impl Environment for Spring {
    fn role(&self) -> Role {
        Role::Wall
    }

    fn law(&self, _elapsed_s: f64, position_m: f64, velocity_m_per_s: f64) -> Law {
        let SpringParameters { rest_position_m, stiffness_n_per_m, damping_ns_per_m } = self.parameters;
        Law {
            force_n: stiffness_n_per_m * (rest_position_m - position_m) - damping_ns_per_m * velocity_m_per_s,
            stiffness_n_per_m,
            damping_ns_per_m,
            ..Law::default()
        }
    }
}
