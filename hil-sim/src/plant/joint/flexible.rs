//! Elastic element between gear and load: harmonic drive, torsion bar, torque sensor, belt.
//!
//! `τ = K x + D x'`, `x` is the part of the twist `θ/N - q` beyond the backlash; teeth push only.

use crate::plant::parameter::{ParameterError, not_negative, positive};
use serde::{Deserialize, Serialize};

/// A spring-damper between gear and load. Units of a rotary output; of a linear output in parentheses.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct FlexibleParameters {
    /// `K`, `N m/rad` (`N/m`), > 0.
    pub stiffness: f64,
    /// `D`, `N m s/rad` (`N s/m`), >= 0.
    pub damping: f64,
}

impl Default for FlexibleParameters {
    /// 1e4 N m/rad without damping, the order of magnitude of a light arm's joint; a placeholder.
    fn default() -> Self {
        Self { stiffness: 1e4, damping: 0.0 }
    }
}

/// Tooth flanks in contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mesh {
    /// Both, without backlash.
    Tight,
    /// No flank: in the gap, or separating.
    Open,
    /// Flanks that push the output forward.
    Forward,
    /// Flanks that push the output backward.
    Backward,
}

/// Spring with backlash.
#[derive(Debug, Clone)]
pub(super) struct Flexible {
    pub(super) stiffness: f64,
    pub(super) damping: f64,
    /// Half of the gap, `rad` or `m`.
    pub(super) half_gap: f64,
}

impl FlexibleParameters {
    pub(super) fn check(&self) -> Result<(), ParameterError> {
        positive("stiffness", self.stiffness)?;
        not_negative("damping", self.damping)
    }

    pub(super) fn with_backlash(&self, backlash: f64) -> Flexible {
        Flexible { stiffness: self.stiffness, damping: self.damping, half_gap: 0.5 * backlash }
    }
}

impl Flexible {
    pub(super) fn mesh(&self, twist: f64, twist_rate: f64) -> Mesh {
        if self.half_gap <= 0.0 {
            return Mesh::Tight;
        }
        let side = if twist > self.half_gap {
            Mesh::Forward
        } else if twist < -self.half_gap {
            Mesh::Backward
        } else {
            return Mesh::Open;
        };
        let torque = self.torque(side, twist, twist_rate);
        let pushes = if side == Mesh::Forward { torque > 0.0 } else { torque < 0.0 };
        if pushes { side } else { Mesh::Open }
    }

    /// Returns the force on the output, `N m` or `N`.
    pub(super) fn torque(&self, mesh: Mesh, twist: f64, twist_rate: f64) -> f64 {
        let stretch = match mesh {
            Mesh::Open => return 0.0,
            Mesh::Tight => twist,
            Mesh::Forward => twist - self.half_gap,
            Mesh::Backward => twist + self.half_gap,
        };
        self.stiffness * stretch + self.damping * twist_rate
    }

    /// Returns the part of the twist that stretches the spring, `rad` or `m`.
    pub(super) fn stretch(&self, twist: f64) -> f64 {
        twist - twist.clamp(-self.half_gap, self.half_gap)
    }
}
