//! Winding temperature, one body: `C T' = P - (T - T_ambient)/R_th`, with the resistance of copper.

use crate::plant::parameter::{ParameterError, finite, not_negative, positive};
use serde::{Deserialize, Serialize};

/// Reference temperature of winding resistance in data sheets, `°C`.
pub(super) const DATA_SHEET_C: f64 = 25.0;

/// Minimum relative resistance, of copper near 40 K.
const MIN_WARMTH: f64 = 0.1;

/// Thermal model of a winding.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct ThermalParameters {
    /// `R_th` from winding to ambient, `K/W`, > 0.
    pub resistance_k_per_w: f64,
    /// `C`, `J/K`, > 0.
    pub capacity_j_per_k: f64,
    /// Ambient temperature, `°C`, also at the start.
    pub ambient_c: f64,
    /// Temperature coefficient of the resistance, relative to 25 °C, `1/K`, >= 0. Copper: 0.0039.
    pub coefficient_per_k: f64,
}

impl Default for ThermalParameters {
    /// A small copper motor in air at 25 °C: 14 K/W, time constant 210 s; placeholders.
    fn default() -> Self {
        Self {
            resistance_k_per_w: 14.0,
            capacity_j_per_k: 15.0,
            ambient_c: DATA_SHEET_C,
            coefficient_per_k: 0.0039,
        }
    }
}

impl ThermalParameters {
    pub(super) fn check(&self) -> Result<(), ParameterError> {
        positive("resistance_k_per_w", self.resistance_k_per_w)?;
        positive("capacity_j_per_k", self.capacity_j_per_k)?;
        finite("ambient_c", self.ambient_c)?;
        not_negative("coefficient_per_k", self.coefficient_per_k)
    }

    /// Returns the rate, `K/s`, with the loss `loss_w`.
    pub(super) fn rate(&self, winding_c: f64, loss_w: f64) -> f64 {
        (loss_w - (winding_c - self.ambient_c) / self.resistance_k_per_w) / self.capacity_j_per_k
    }

    /// Returns the temperature rise in `step_s`, `K`, for a loss of `cold_j` at the resistance of 25 °C.
    pub(super) fn warming_k(&self, winding_c: f64, cold_j: f64, step_s: f64) -> f64 {
        let warmth = self.warmth(winding_c);
        let cooling_j = step_s * (winding_c - self.ambient_c) / self.resistance_k_per_w;
        let first_k = (cold_j * warmth - cooling_j) / self.capacity_j_per_k;
        // T' = α + β T over a time in which `b = ∫ β` is small: (e^b - 1)/b.
        let rises = if warmth > MIN_WARMTH { cold_j * self.coefficient_per_k } else { 0.0 };
        let b = (rises - step_s / self.resistance_k_per_w) / self.capacity_j_per_k;
        first_k * (1.0 + b / 2.0 * (1.0 + b / 3.0 * (1.0 + b / 4.0)))
    }

    /// Returns the resistance relative to 25 °C, at least [`MIN_WARMTH`].
    pub(super) fn warmth(&self, winding_c: f64) -> f64 {
        (1.0 + self.coefficient_per_k * (winding_c - DATA_SHEET_C)).max(MIN_WARMTH)
    }
}
