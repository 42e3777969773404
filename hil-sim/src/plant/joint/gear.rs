//! The gear: ratio, its own inertia, losses and lost motion.

use crate::plant::parameter::{ParameterError, not_negative, positive, require};
use serde::{Deserialize, Serialize};

/// A gear between rotor and output.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct GearParameters {
    /// `N`: rotor angle per output motion, `rad/rad` for an output that turns, `rad/m` for one that slides, > 0.
    pub ratio: f64,
    /// Inertia that turns with the rotor, `kg m²`, >= 0.
    pub inertia_kg_m2: f64,
    /// Share of the power that arrives when the motor drives the load, above 0, up to 1.
    pub efficiency: f64,
    /// Share of the power that arrives when the load drives the motor, above 0, up to 1.
    pub backdrive_efficiency: f64,
    /// Lost motion on reversal (the whole gap), at the output, `rad` or `m`, >= 0. Above 0 only with `flexible`,
    /// whose stiffness the teeth have.
    pub backlash: f64,
}

impl Default for GearParameters {
    /// No gear: 1:1 without losses.
    fn default() -> Self {
        Self { ratio: 1.0, inertia_kg_m2: 0.0, efficiency: 1.0, backdrive_efficiency: 1.0, backlash: 0.0 }
    }
}

impl GearParameters {
    pub(super) fn check(&self) -> Result<(), ParameterError> {
        let share = |path, value| require(path, value, value > 0.0 && value <= 1.0, "> 0 and <= 1");
        positive("ratio", self.ratio)?;
        not_negative("inertia_kg_m2", self.inertia_kg_m2)?;
        share("efficiency", self.efficiency)?;
        share("backdrive_efficiency", self.backdrive_efficiency)?;
        not_negative("backlash", self.backlash)
    }

    pub(super) fn is_lossy(&self) -> bool {
        self.efficiency < 1.0 || self.backdrive_efficiency < 1.0
    }

    /// Output torque (times `1/ratio`) per rotor torque, for a transmitted torque of the sign of `torque` while
    /// the gear turns in `direction` (-1, 0 or 1). A gear at rest shows no loss here: its losses hold it.
    pub(super) fn transmission(&self, torque: f64, direction: f64) -> f64 {
        self.share(Flow::of(torque * direction))
    }

    /// The same by the flow of power.
    pub(super) fn share(&self, flow: Flow) -> f64 {
        match flow {
            Flow::Forward => self.efficiency,
            Flow::Backward => self.backdrive_efficiency.recip(),
            Flow::None => 1.0,
        }
    }
}

/// Which way a gear transmits power.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Flow {
    None,
    /// From motor to load.
    Forward,
    /// From load to motor.
    Backward,
}

impl Flow {
    /// Of a power from motor to load.
    pub(super) fn of(power: f64) -> Self {
        if power > 0.0 {
            Self::Forward
        } else if power < 0.0 {
            Self::Backward
        } else {
            Self::None
        }
    }
}
