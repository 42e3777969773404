//! A brushed motor with its current loop, and the temperature of its winding.
//!
//! `L i' = u - R i - k ω`, `τ = k i`. The loop gives `u = R₂₅ i + k ω + L ω_c (i* - i)`, at most the supply's voltage
//! either way: pole cancellation, a first-order lag of `ω_c` until the voltage is at its limit. The wanted current `i*` is
//! cut at the limit. The winding, `R = R₂₅ (1 + α (T - 25 °C))`, gets warm by `C T' = R i² - (T - T_ambient) / R_th`.

use serde::{Deserialize, Serialize};

use super::{Drive, State};
use crate::plant::parameter::{ParameterError, finite, not_negative, positive, positive_or_infinite};

/// Of copper, `1/K`.
const COPPER_PER_K: f64 = 0.00393;
/// At which a winding's resistance is given, `°C`.
const RATED_C: f64 = 25.0;

/// A brushed motor.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct BrushedMotorParameters {
    /// `k`: torque constant, and the voltage constant in V s/rad, `N m/A`, > 0.
    pub torque_constant_nm_per_a: f64,
    /// `kg m²`, >= 0.
    #[serde(default)]
    pub rotor_inertia_kg_m2: f64,
    /// Largest current either way, `A`.
    #[serde(default = "none")]
    pub current_limit_a: f64,
    /// Of the supply, either way, `V`.
    #[serde(default = "none")]
    pub voltage_limit_v: f64,
    /// `ω_c` of the current loop, `rad/s`, > 0.
    #[serde(default = "kilohertz")]
    pub current_bandwidth_rad_per_s: f64,
    /// What the current goes through.
    pub winding: WindingParameters,
}

/// A winding, of a phase where there are three.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct WindingParameters {
    /// At 25 °C, `Ω`, > 0.
    pub resistance_ohm: f64,
    /// `H`, > 0.
    pub inductance_h: f64,
    /// From winding to ambient, `K/W`; left out, it stays cold.
    #[serde(default)]
    pub thermal_resistance_k_per_w: f64,
    /// Heat capacity, `J/K`; left out, it stays cold.
    #[serde(default = "none")]
    pub heat_capacity_j_per_k: f64,
    /// Ambient, and the winding at the start, `°C`.
    #[serde(default = "rated")]
    pub ambient_c: f64,
}

fn none() -> f64 {
    f64::INFINITY
}

fn kilohertz() -> f64 {
    6283.0
}

fn rated() -> f64 {
    RATED_C
}

impl WindingParameters {
    pub(super) fn check(&self) -> Result<(), ParameterError> {
        positive("resistance_ohm", self.resistance_ohm)?;
        positive("inductance_h", self.inductance_h)?;
        not_negative("thermal_resistance_k_per_w", self.thermal_resistance_k_per_w)?;
        positive_or_infinite("heat_capacity_j_per_k", self.heat_capacity_j_per_k)?;
        finite("ambient_c", self.ambient_c)
    }

    pub(super) fn resistance_ohm(&self, winding_c: f64) -> f64 {
        self.resistance_ohm * (1.0 + COPPER_PER_K * (winding_c - RATED_C))
    }

    /// How fast it gets warm by so many watts.
    pub(super) fn winding_c_per_s(&self, winding_c: f64, heat_w: f64) -> f64 {
        let lost_w = match self.thermal_resistance_k_per_w > 0.0 {
            true => (winding_c - self.ambient_c) / self.thermal_resistance_k_per_w,
            false => 0.0,
        };
        (heat_w - lost_w) / self.heat_capacity_j_per_k
    }
}

impl BrushedMotorParameters {
    pub(super) fn check(&self) -> Result<(), ParameterError> {
        positive("torque_constant_nm_per_a", self.torque_constant_nm_per_a)?;
        not_negative("rotor_inertia_kg_m2", self.rotor_inertia_kg_m2)?;
        positive_or_infinite("current_limit_a", self.current_limit_a)?;
        positive_or_infinite("voltage_limit_v", self.voltage_limit_v)?;
        positive("current_bandwidth_rad_per_s", self.current_bandwidth_rad_per_s)?;
        self.winding.check().map_err(|error| error.within("winding"))
    }

    /// Of its electrical side, `1/s`.
    pub(super) fn rate(&self) -> f64 {
        self.current_bandwidth_rad_per_s + self.winding.resistance_ohm / self.winding.inductance_h
    }

    /// What it does about a wanted torque at the rotor, which turns so fast.
    pub(super) fn drive(&self, state: &State, torque_nm: f64, rad_per_s: f64) -> Drive {
        let Self { torque_constant_nm_per_a, current_bandwidth_rad_per_s, winding, .. } = self;
        let current_a = state.current_a;
        let wanted_a = limited(torque_nm / torque_constant_nm_per_a, self.current_limit_a);
        let back_v = torque_constant_nm_per_a * rad_per_s;
        let rise_v = winding.inductance_h * current_bandwidth_rad_per_s * (wanted_a - current_a);
        let voltage_v = limited(winding.resistance_ohm * current_a + back_v + rise_v, self.voltage_limit_v);
        let resistance_ohm = winding.resistance_ohm(state.winding_c);
        Drive {
            force: torque_constant_nm_per_a * current_a,
            current_a_per_s: (voltage_v - resistance_ohm * current_a - back_v) / winding.inductance_h,
            direct_current_a_per_s: 0.0,
            winding_c_per_s: winding.winding_c_per_s(state.winding_c, resistance_ohm * current_a * current_a),
            voltage_v,
        }
    }
}

/// Cut either way. What is no number stays none.
pub(super) fn limited(value: f64, limit: f64) -> f64 {
    if value > limit {
        limit
    } else if value < -limit {
        -limit
    } else {
        value
    }
}
