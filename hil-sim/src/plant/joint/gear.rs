//! A gear: ratio, inertia, efficiency.
//!
//! What it loses is a share of the power that goes through, whichever way: the output gets `η` of the torque while the motor
//! drives, and the motor gets `η` of it while the load does.

use serde::{Deserialize, Serialize};

use crate::plant::parameter::{ParameterError, not_negative, positive, require};

/// Between motor and output.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct GearParameters {
    /// Turns of the rotor, in rad, for one rad or one metre of the output, > 0.
    pub ratio: f64,
    /// At the rotor's side, `kg m²`, >= 0.
    pub inertia_kg_m2: f64,
    /// Share of the power that comes out, above 0, at most 1.
    pub efficiency: f64,
}

impl Default for GearParameters {
    /// None: the rotor is the output.
    fn default() -> Self {
        Self { ratio: 1.0, inertia_kg_m2: 0.0, efficiency: 1.0 }
    }
}

impl GearParameters {
    pub(super) fn check(&self) -> Result<(), ParameterError> {
        positive("ratio", self.ratio)?;
        not_negative("inertia_kg_m2", self.inertia_kg_m2)?;
        let is_share = self.efficiency > 0.0 && self.efficiency <= 1.0;
        require("efficiency", self.efficiency, is_share, "above 0 and at most 1")
    }
}
