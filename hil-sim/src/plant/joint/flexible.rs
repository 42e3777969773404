//! The elastic element between gear and load: harmonic drive, torsion bar, torque sensor, belt.
//!
//! `τ = K x + D x'`, `x` the part of the twist `θ/N - q` beyond the backlash; teeth push and never pull.

use crate::plant::parameter::{ParameterError, not_negative, positive};
use serde::{Deserialize, Serialize};

/// A spring-damper between gear and load. Units of an output that turns; of one that slides in parentheses.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct FlexibleParameters {
    /// `K`, `N m/rad` (`N/m`), > 0.
    pub stiffness: f64,
    /// `D`, `N m s/rad` (`N s/m`), >= 0.
    pub damping: f64,
}

impl Default for FlexibleParameters {
    /// 1e4 N m/rad without damping: the order of a light arm's joint. A placeholder.
    fn default() -> Self {
        Self { stiffness: 1e4, damping: 0.0 }
    }
}

/// Which flanks of the teeth touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mesh {
    /// No backlash: both always do.
    Tight,
    /// None: in the gap, or leaving a flank faster than it follows.
    Open,
    /// Those that push the output forward.
    Forward,
    /// Those that push the output backward.
    Backward,
}

/// The spring with the backlash in it.
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

    /// On the output, `N m` or `N`.
    pub(super) fn torque(&self, mesh: Mesh, twist: f64, twist_rate: f64) -> f64 {
        let stretch = match mesh {
            Mesh::Open => return 0.0,
            Mesh::Tight => twist,
            Mesh::Forward => twist - self.half_gap,
            Mesh::Backward => twist + self.half_gap,
        };
        self.stiffness * stretch + self.damping * twist_rate
    }

    /// The part of the twist that stretches the spring, `rad` or `m`.
    pub(super) fn stretch(&self, twist: f64) -> f64 {
        twist - twist.clamp(-self.half_gap, self.half_gap)
    }
}
