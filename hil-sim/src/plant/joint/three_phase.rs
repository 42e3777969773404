//! A three-phase motor with permanent magnets, in the rotor's axes, and its inverter.
//!
//! `L d/dt i_d = u_d - R i_d + p ω L i_q`, `L d/dt i_q = u_q - R i_q - p ω (L i_d + ψ)`, `τ = 3/2 p ψ i_q` (amplitude-
//! invariant). Current loops on both with decoupling give what makes each a first-order lag of `ω_c`, `i_d* = 0`; the voltage
//! that they ask for is shortened to the circle of `U/√3`. In the dead time of a switch the current decides: a voltage of
//! `U t_dead f` against it is lost, of which the fundamental, `4/π` of that, is modelled.

use serde::{Deserialize, Serialize};

use super::motor::{WindingParameters, limited};
use super::{Drive, State};
use crate::plant::parameter::{ParameterError, not_negative, positive, positive_or_infinite};

/// A three-phase motor.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ThreePhaseParameters {
    /// `p`, > 0.
    pub pole_pairs: f64,
    /// `ψ` of the magnets, `V s`, > 0.
    pub flux_vs: f64,
    /// `kg m²`, >= 0.
    #[serde(default)]
    pub rotor_inertia_kg_m2: f64,
    /// Largest current, `A`, peak.
    #[serde(default = "none")]
    pub current_limit_a: f64,
    /// Of the inverter's supply, `V`.
    #[serde(default = "none")]
    pub bus_voltage_v: f64,
    /// `ω_c` of the current loops, `rad/s`, > 0.
    #[serde(default = "kilohertz")]
    pub current_bandwidth_rad_per_s: f64,
    /// Share of a switching period in which both switches of a phase are off, 0 to 0.1.
    #[serde(default)]
    pub dead_time: f64,
    /// Of a phase.
    pub winding: WindingParameters,
}

fn none() -> f64 {
    f64::INFINITY
}

fn kilohertz() -> f64 {
    6283.0
}

/// Current around which a phase's voltage error changes its sign, `A`: no diode switches at once.
const COMMUTATION_A: f64 = 0.05;

impl ThreePhaseParameters {
    pub(super) fn check(&self) -> Result<(), ParameterError> {
        positive("pole_pairs", self.pole_pairs)?;
        positive("flux_vs", self.flux_vs)?;
        not_negative("rotor_inertia_kg_m2", self.rotor_inertia_kg_m2)?;
        positive_or_infinite("current_limit_a", self.current_limit_a)?;
        positive_or_infinite("bus_voltage_v", self.bus_voltage_v)?;
        positive("current_bandwidth_rad_per_s", self.current_bandwidth_rad_per_s)?;
        let is_share = (0.0..=0.1).contains(&self.dead_time);
        crate::plant::parameter::require("dead_time", self.dead_time, is_share, "0 to 0.1")?;
        self.winding.check().map_err(|error| error.within("winding"))
    }

    /// Of its electrical side, `1/s`.
    pub(super) fn rate(&self) -> f64 {
        self.current_bandwidth_rad_per_s + self.winding.resistance_ohm / self.winding.inductance_h
    }

    /// `3/2 p ψ`, `N m/A`.
    fn torque_constant_nm_per_a(&self) -> f64 {
        1.5 * self.pole_pairs * self.flux_vs
    }

    /// What it does about a wanted torque at the rotor, which turns so fast.
    pub(super) fn drive(&self, state: &State, torque_nm: f64, rad_per_s: f64) -> Drive {
        let WindingParameters { resistance_ohm, inductance_h, .. } = self.winding;
        let State { current_a: cross_a, direct_current_a: direct_a, winding_c, .. } = *state;
        let electrical = self.pole_pairs * rad_per_s;
        let wanted_a = limited(torque_nm / self.torque_constant_nm_per_a(), self.current_limit_a);
        let rise = inductance_h * self.current_bandwidth_rad_per_s;
        let direct_v = resistance_ohm * direct_a - electrical * inductance_h * cross_a - rise * direct_a;
        let cross_v = resistance_ohm * cross_a
            + electrical * (inductance_h * direct_a + self.flux_vs)
            + rise * (wanted_a - cross_a);
        let (asked_v, most_v) = (libm::hypot(direct_v, cross_v), self.bus_voltage_v / 3.0_f64.sqrt());
        let share = if asked_v > most_v { most_v / asked_v } else { 1.0 };
        let (direct_v, cross_v) = (share * direct_v, share * cross_v);
        let current_a = libm::hypot(direct_a, cross_a);
        let lost_v = if self.dead_time > 0.0 {
            4.0 / std::f64::consts::PI * self.dead_time * self.bus_voltage_v / (current_a + COMMUTATION_A)
        } else {
            0.0
        };
        let warm_ohm = self.winding.resistance_ohm(winding_c) + lost_v;
        let heat_w = 1.5 * self.winding.resistance_ohm(winding_c) * current_a * current_a;
        Drive {
            force: self.torque_constant_nm_per_a() * cross_a,
            current_a_per_s: (cross_v
                - warm_ohm * cross_a
                - electrical * (inductance_h * direct_a + self.flux_vs))
                / inductance_h,
            direct_current_a_per_s: (direct_v - warm_ohm * direct_a + electrical * inductance_h * cross_a)
                / inductance_h,
            winding_c_per_s: self.winding.winding_c_per_s(winding_c, heat_w),
            voltage_v: libm::hypot(direct_v, cross_v),
        }
    }
}
