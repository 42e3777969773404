//! Motor: an ideal torque source, or a motor with its amplifier.

use super::brushed::BrushedParameters;
use super::electric::Electric;
use super::pace::Pace;
use super::state::State;
use super::thermal::{DATA_SHEET_C, ThermalParameters};
use super::three_phase::ThreePhaseParameters;
use super::winding::Winding;
use crate::plant::parameter::ParameterError;
use serde::{Deserialize, Serialize};

/// The kind of motor, chosen by `kind`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum JointMotorParameters {
    /// Ideal torque source without limit.
    Ideal {},
    /// Brushed DC motor.
    Brushed(BrushedParameters),
    /// Three-phase permanent-magnet motor with field-oriented control.
    ThreePhase(ThreePhaseParameters),
}

impl Default for JointMotorParameters {
    fn default() -> Self {
        Self::Ideal {}
    }
}

impl JointMotorParameters {
    pub(super) fn check(&self) -> Result<(), ParameterError> {
        match self {
            Self::Ideal {} => Ok(()),
            Self::Brushed(motor) => motor.check(),
            Self::ThreePhase(motor) => motor.check(),
        }
    }

    /// Whether it has a winding with current, voltage and temperature.
    #[must_use]
    pub fn has_winding(&self) -> bool {
        !matches!(self, Self::Ideal {})
    }

    /// Maximum torque at the rotor, `N m`; infinite for an ideal source.
    pub(super) fn max_torque_nm(&self) -> f64 {
        match self {
            Self::Ideal {} => f64::INFINITY,
            Self::Brushed(motor) => motor.torque_constant_nm_per_a * motor.current_limit_a,
            Self::ThreePhase(motor) => motor.torque_constant_nm_per_a() * motor.current_limit_a,
        }
    }

    /// `kg m²`.
    pub(super) fn rotor_inertia_kg_m2(&self) -> f64 {
        match self {
            Self::Ideal {} => 0.0,
            Self::Brushed(motor) => motor.rotor_inertia_kg_m2,
            Self::ThreePhase(motor) => motor.rotor_inertia_kg_m2,
        }
    }

    /// At the rotor, `N m s/rad`.
    pub(super) fn viscous_nms_per_rad(&self) -> f64 {
        match self {
            Self::Ideal {} => 0.0,
            Self::Brushed(motor) => motor.viscous_nms_per_rad,
            Self::ThreePhase(motor) => motor.viscous_nms_per_rad,
        }
    }

    /// At the rotor, `N m`.
    pub(super) fn coulomb_nm(&self) -> f64 {
        match self {
            Self::Ideal {} => 0.0,
            Self::Brushed(motor) => motor.coulomb_nm,
            Self::ThreePhase(motor) => motor.coulomb_nm,
        }
    }

    /// Whether its torque is linear in command and time below voltage saturation.
    pub(super) fn is_linear(&self) -> bool {
        !matches!(self, Self::ThreePhase(motor) if motor.dead_time_share > 0.0)
    }

    /// Of a linear motor.
    pub(super) fn winding(&self) -> Option<Winding> {
        match self {
            Self::Brushed(motor) => Some(motor.winding()),
            Self::ThreePhase(motor) if self.is_linear() => Some(motor.winding()),
            Self::Ideal {} | Self::ThreePhase(_) => None,
        }
    }

    pub(super) fn thermal(&self) -> Option<&ThermalParameters> {
        match self {
            Self::Ideal {} => None,
            Self::Brushed(motor) => motor.thermal.as_ref(),
            Self::ThreePhase(motor) => motor.thermal.as_ref(),
        }
    }

    pub(super) fn start_c(&self) -> f64 {
        self.thermal().map_or(DATA_SHEET_C, |thermal| thermal.ambient_c)
    }

    /// Returns the torque on the rotor, `N m`, for the command `wanted_nm`.
    pub(super) fn torque_nm(&self, wanted_nm: f64, state: &State) -> f64 {
        match self {
            Self::Ideal {} => wanted_nm,
            Self::Brushed(motor) => motor.torque_constant_nm_per_a * state.quadrature_a,
            Self::ThreePhase(motor) => motor.torque_nm([state.direct_a, state.quadrature_a]),
        }
    }

    /// Returns the electrical side for the command `wanted_nm` and the speed `rotor_rad_per_s`.
    pub(super) fn electric(&self, wanted_nm: f64, rotor_rad_per_s: f64, state: &State) -> Electric {
        match self {
            Self::Ideal {} => Electric { supplied_w: wanted_nm * rotor_rad_per_s, ..Electric::default() },
            Self::Brushed(motor) => motor.electric(wanted_nm, rotor_rad_per_s, state),
            Self::ThreePhase(motor) => motor.electric(wanted_nm, rotor_rad_per_s, state),
        }
    }

    /// Energy of the magnetic field, `J`.
    pub(super) fn field_j(&self, state: &State) -> f64 {
        match self {
            Self::Ideal {} => 0.0,
            Self::Brushed(motor) => 0.5 * motor.inductance_h * state.quadrature_a * state.quadrature_a,
            Self::ThreePhase(motor) => motor.field_j(state),
        }
    }

    /// Returns its fastest rate. `rotor_kg_m2` is the total inertia of the rotor side.
    pub(super) fn paces(&self, rotor_kg_m2: f64) -> Vec<Pace> {
        match self {
            Self::Ideal {} => Vec::new(),
            Self::Brushed(motor) => motor.paces(rotor_kg_m2).to_vec(),
            Self::ThreePhase(motor) => motor.paces(rotor_kg_m2).to_vec(),
        }
    }
}
