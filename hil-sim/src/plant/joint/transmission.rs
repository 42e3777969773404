//! Between gear and load: a spring with damping, and a gap in which nothing touches (Spong, 1987).

use serde::{Deserialize, Serialize};

use crate::plant::parameter::{ParameterError, not_negative, positive};

/// A flexible transmission, seen at the output.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct TransmissionParameters {
    /// `N m/rad` or `N/m`, > 0.
    pub stiffness: f64,
    /// `N m s/rad` or `N s/m`, >= 0.
    #[serde(default)]
    pub damping: f64,
    /// Backlash: the whole gap, `rad` or `m`, >= 0. At the start, the output stands in its middle.
    #[serde(default)]
    pub backlash: f64,
}

impl TransmissionParameters {
    pub(super) fn check(&self) -> Result<(), ParameterError> {
        positive("stiffness", self.stiffness)?;
        not_negative("damping", self.damping)?;
        not_negative("backlash", self.backlash)
    }

    /// On the load, by how far and how fast the gear is ahead. In a gap, what touches does not pull.
    pub(super) fn force(&self, ahead: f64, ahead_per_s: f64) -> f64 {
        let half = 0.5 * self.backlash;
        let bent = ahead - ahead.clamp(-half, half);
        let force = self.stiffness * bent + self.damping * ahead_per_s;
        if half <= 0.0 {
            force
        } else if bent > 0.0 {
            force.max(0.0)
        } else if bent < 0.0 {
            force.min(0.0)
        } else {
            0.0
        }
    }
}
