//! Brushed DC motor with a current loop.
//!
//! `L i' = u - R i - ke w`, `τ = kt i`, `ke = kt` (SI). The current controller is a PI with pole cancellation (`Kp =
//! wc L`, `Ki = wc R`) and back-EMF feedforward, with an ideal integrator in saturation and with a warm winding: `u =
//! R i + ke w + wc L (i_ref - i)`, limited; without limit, `i/i_ref = wc/(s + wc)` exactly.

use super::electric::Electric;
use super::pace::Pace;
use super::state::State;
use super::thermal::ThermalParameters;
use super::winding::Winding;
use crate::plant::parameter::{ParameterError, not_negative, positive, positive_or_infinite};
use serde::{Deserialize, Serialize};

/// Brushed DC motor and its amplifier.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct BrushedParameters {
    /// `R` at 25 °C, > 0.
    pub resistance_ohm: f64,
    /// `L`, `H`, > 0.
    pub inductance_h: f64,
    /// `kt = ke`, `N m/A` = `V s/rad`, > 0.
    pub torque_constant_nm_per_a: f64,
    /// `kg m²`, >= 0; above 0 with a `flexible` joint, unless the gear has inertia.
    pub rotor_inertia_kg_m2: f64,
    /// Viscous friction of the rotor, `N m s/rad`, >= 0.
    pub viscous_nms_per_rad: f64,
    /// Coulomb friction of rotor, brushes and bearings, `N m`, >= 0.
    pub coulomb_nm: f64,
    /// Maximum current, ±, `A`, > 0; `inf`: unlimited.
    pub current_limit_a: f64,
    /// Maximum voltage, ±, `V`, > 0; `inf`: unlimited.
    pub voltage_limit_v: f64,
    /// `wc`, bandwidth of the current loop, `rad/s`, > 0.
    pub current_bandwidth_rad_per_s: f64,
    /// Thermal model of the winding; default: 25 °C.
    pub thermal: Option<ThermalParameters>,
}

impl Default for BrushedParameters {
    /// A 10 W, 25 mm, 24 V motor with a 1 kHz current loop, without friction: electrical values of a Maxon RE25,
    /// unverified.
    fn default() -> Self {
        Self {
            resistance_ohm: 2.32,
            inductance_h: 2.38e-4,
            torque_constant_nm_per_a: 0.0234,
            rotor_inertia_kg_m2: 1.08e-6,
            viscous_nms_per_rad: 0.0,
            coulomb_nm: 0.0,
            current_limit_a: f64::INFINITY,
            voltage_limit_v: 24.0,
            current_bandwidth_rad_per_s: core::f64::consts::TAU * 1000.0,
            thermal: None,
        }
    }
}

impl BrushedParameters {
    pub(super) fn check(&self) -> Result<(), ParameterError> {
        positive("resistance_ohm", self.resistance_ohm)?;
        positive("inductance_h", self.inductance_h)?;
        positive("torque_constant_nm_per_a", self.torque_constant_nm_per_a)?;
        not_negative("rotor_inertia_kg_m2", self.rotor_inertia_kg_m2)?;
        not_negative("viscous_nms_per_rad", self.viscous_nms_per_rad)?;
        not_negative("coulomb_nm", self.coulomb_nm)?;
        positive_or_infinite("current_limit_a", self.current_limit_a)?;
        positive_or_infinite("voltage_limit_v", self.voltage_limit_v)?;
        positive("current_bandwidth_rad_per_s", self.current_bandwidth_rad_per_s)?;
        self.thermal
            .as_ref()
            .map_or(Ok(()), ThermalParameters::check)
            .map_err(|error| error.with_path_prefix("thermal"))
    }

    pub(super) fn winding(&self) -> Winding {
        Winding {
            nm_per_a: self.torque_constant_nm_per_a,
            bandwidth_per_s: self.current_bandwidth_rad_per_s,
            current_limit_a: self.current_limit_a,
            resistance_ohm: self.resistance_ohm,
            inductance_h: self.inductance_h,
            emf_vs: self.torque_constant_nm_per_a,
            coupling_h: 0.0,
            voltage_limit_v: self.voltage_limit_v,
            power_share: 1.0,
            thermal: self.thermal.clone(),
        }
    }

    pub(super) fn electric(&self, wanted_nm: f64, rotor_rad_per_s: f64, state: &State) -> Electric {
        let current_a = state.quadrature_a;
        let warmth = self.thermal.as_ref().map_or(1.0, |thermal| thermal.warmth(state.winding_c));
        let resistance_ohm = self.resistance_ohm * warmth;
        let lost_v = resistance_ohm * current_a + self.torque_constant_nm_per_a * rotor_rad_per_s;
        let limit_a = self.current_limit_a;
        let wanted_a = (wanted_nm / self.torque_constant_nm_per_a).clamp(-limit_a, limit_a);
        let pushing_v = self.inductance_h * self.current_bandwidth_rad_per_s * (wanted_a - current_a);
        let voltage_v = (lost_v + pushing_v).clamp(-self.voltage_limit_v, self.voltage_limit_v);
        let lost_w = resistance_ohm * current_a * current_a;
        let rates = State {
            quadrature_a: (voltage_v - lost_v) / self.inductance_h,
            winding_c: self.thermal.as_ref().map_or(0.0, |thermal| thermal.rate(state.winding_c, lost_w)),
            ..State::default()
        };
        Electric { rates, voltage_v, supplied_w: voltage_v * current_a, lost_w }
    }

    pub(super) fn paces(&self, rotor_kg_m2: f64) -> [Pace; 4] {
        let constant = self.torque_constant_nm_per_a;
        let bandwidth = self.current_bandwidth_rad_per_s;
        let electromechanical = constant / (self.inductance_h * rotor_kg_m2).sqrt();
        [
            Pace::of("motor.current_bandwidth_rad_per_s", bandwidth, bandwidth),
            Pace::of("motor.inductance_h", self.inductance_h, self.resistance_ohm / self.inductance_h),
            Pace::of("motor.torque_constant_nm_per_a", constant, electromechanical),
            Pace::of(
                "motor.viscous_nms_per_rad",
                self.viscous_nms_per_rad,
                self.viscous_nms_per_rad / rotor_kg_m2,
            ),
        ]
    }
}
