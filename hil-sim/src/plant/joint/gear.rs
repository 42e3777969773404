//! Gear: ratio, inertia, losses and backlash.

use crate::plant::parameter::{ParameterError, not_negative, positive, require};
use serde::{Deserialize, Serialize};

/// A gear between rotor and output.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct GearParameters {
    /// `N`: rotor angle per output motion, `rad/rad` for a rotary output, `rad/m` for a linear one, > 0.
    pub ratio: f64,
    /// Inertia that turns with the rotor, `kg m²`, >= 0.
    pub inertia_kg_m2: f64,
    /// Efficiency when the motor drives the load, > 0 and <= 1.
    pub efficiency: f64,
    /// Efficiency when the load drives the motor, > 0 and <= 1.
    pub backdrive_efficiency: f64,
    /// Backlash (whole gap) at the output, `rad` or `m`, >= 0. Above 0 only with `flexible`, which is the stiffness
    /// of the teeth.
    pub backlash: f64,
}

impl Default for GearParameters {
    /// 1:1 without losses.
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

    /// Output torque (times `1/ratio`) per rotor torque, for a transmitted torque with the sign of `torque` and
    /// motion in `direction` (-1, 0 or 1). Losses at rest act as holding friction instead.
    pub(super) fn transmission(&self, torque: f64, direction: f64) -> f64 {
        self.share(Flow::of(torque * direction))
    }

    /// Output torque per rotor torque by direction of power.
    pub(super) fn share(&self, flow: Flow) -> f64 {
        match flow {
            Flow::Forward => self.efficiency,
            Flow::Backward => self.backdrive_efficiency.recip(),
            Flow::None => 1.0,
        }
    }
}

/// Direction of power through a gear.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Flow {
    None,
    /// From motor to load.
    Forward,
    /// From load to motor.
    Backward,
}

impl Flow {
    /// Direction of a power from motor to load.
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
