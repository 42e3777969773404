//! Three-phase permanent-magnet motor in the rotor's frame (dq), averaged over the inverter's switching.
//!
//! Amplitude-invariant: `|i|` is the peak of a phase current (Krause, Wasynczuk, Sudhoff, "Analysis of Electric
//! Machinery and Drive Systems", chapter on permanent-magnet AC machines; also with `3/2`):
//!
//! ```text
//!   u_d = R i_d + L_d i_d' - w_e L_q i_q              w_e = p w
//!   u_q = R i_q + L_q i_q' + w_e (L_d i_d + ψ)        τ = 3/2 p (ψ i_q + (L_d - L_q) i_d i_q)
//! ```
//! Two PI controllers with pole cancellation and feedforward of both couplings: `i/i_ref = wc/(s + wc)` on both axes
//! below voltage saturation. `i_d` is controlled to 0. The voltage is limited to the circle `U/sqrt(3)`, with
//! priority for `u_d`.
//!
//! Dead time reduces the voltage by `4/π U share` (the fundamental of a square wave of height `U share`) against the
//! current. The integrators compensate it with the time constant `L/R`.

use super::electric::Electric;
use super::pace::Pace;
use super::state::State;
use super::thermal::ThermalParameters;
use super::winding::Winding;
use crate::plant::parameter::{ParameterError, not_negative, positive, positive_or_infinite, require};
use serde::{Deserialize, Serialize};

/// Three-phase permanent-magnet motor, inverter and field-oriented current control.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct ThreePhaseParameters {
    /// `R` of a phase at 25 °C, > 0: half of the resistance between two leads.
    pub resistance_ohm: f64,
    /// `L_d`, `H`, > 0.
    pub direct_inductance_h: f64,
    /// `L_q`, `H`, > 0.
    pub quadrature_inductance_h: f64,
    /// `ψ`, peak flux linkage of a phase, `V s` per electrical radian, > 0.
    pub flux_linkage_vs: f64,
    /// `p`, >= 1.
    pub pole_pairs: u32,
    /// `kg m²`, >= 0; above 0 with a `flexible` joint, unless the gear has inertia.
    pub rotor_inertia_kg_m2: f64,
    /// Viscous friction of the rotor, `N m s/rad`, >= 0.
    pub viscous_nms_per_rad: f64,
    /// Coulomb friction of the rotor, `N m`, >= 0.
    pub coulomb_nm: f64,
    /// Maximum current, phase peak, `A`, > 0; `inf`: unlimited.
    pub current_limit_a: f64,
    /// `U`, supply voltage of the inverter, `V`, > 0; `inf`: unlimited.
    pub supply_v: f64,
    /// Dead time as a share of the PWM period, 0 to 0.2; > 0 only with a finite `supply_v`.
    pub dead_time_share: f64,
    /// Current below which the dead-time voltage is proportional to the current, `A`, > 0, due to current ripple.
    pub dead_time_current_a: f64,
    /// `wc`, bandwidth of the current loops, `rad/s`, > 0.
    pub current_bandwidth_rad_per_s: f64,
    /// Thermal model of the winding; default: 25 °C.
    pub thermal: Option<ThermalParameters>,
}

impl Default for ThreePhaseParameters {
    /// Order of magnitude of a 70 mm frameless joint motor at 48 V with a 1 kHz current loop; placeholders.
    fn default() -> Self {
        Self {
            resistance_ohm: 0.3,
            direct_inductance_h: 3e-4,
            quadrature_inductance_h: 3e-4,
            flux_linkage_vs: 0.008,
            pole_pairs: 10,
            rotor_inertia_kg_m2: 3e-5,
            viscous_nms_per_rad: 0.0,
            coulomb_nm: 0.0,
            current_limit_a: f64::INFINITY,
            supply_v: 48.0,
            dead_time_share: 0.0,
            dead_time_current_a: 0.2,
            current_bandwidth_rad_per_s: core::f64::consts::TAU * 1000.0,
            thermal: None,
        }
    }
}

/// Creates the motor and inverter of a drive's configuration, with defaults for other parameters.
impl From<&drive::Configuration> for ThreePhaseParameters {
    fn from(told: &drive::Configuration) -> Self {
        Self {
            resistance_ohm: told.motor.resistance_ohm.into(),
            direct_inductance_h: told.motor.direct_inductance_h.into(),
            quadrature_inductance_h: told.motor.quadrature_inductance_h.into(),
            flux_linkage_vs: told.motor.flux_linkage_vs.into(),
            pole_pairs: told.motor.pole_pairs.into(),
            dead_time_share: told.inverter.dead_time_share.into(),
            dead_time_current_a: told.inverter.dead_time_current_a.into(),
            ..Self::default()
        }
    }
}

impl ThreePhaseParameters {
    pub(super) fn check(&self) -> Result<(), ParameterError> {
        positive("resistance_ohm", self.resistance_ohm)?;
        positive("direct_inductance_h", self.direct_inductance_h)?;
        positive("quadrature_inductance_h", self.quadrature_inductance_h)?;
        positive("flux_linkage_vs", self.flux_linkage_vs)?;
        require("pole_pairs", f64::from(self.pole_pairs), self.pole_pairs >= 1, ">= 1")?;
        not_negative("rotor_inertia_kg_m2", self.rotor_inertia_kg_m2)?;
        not_negative("viscous_nms_per_rad", self.viscous_nms_per_rad)?;
        not_negative("coulomb_nm", self.coulomb_nm)?;
        positive_or_infinite("current_limit_a", self.current_limit_a)?;
        positive_or_infinite("supply_v", self.supply_v)?;
        let share = self.dead_time_share;
        let is_possible = (0.0..=0.2).contains(&share) && (share <= 0.0 || self.supply_v.is_finite());
        require("dead_time_share", share, is_possible, "0 to 0.2, or 0 without a finite `supply_v`")?;
        positive("dead_time_current_a", self.dead_time_current_a)?;
        positive("current_bandwidth_rad_per_s", self.current_bandwidth_rad_per_s)?;
        self.thermal
            .as_ref()
            .map_or(Ok(()), ThermalParameters::check)
            .map_err(|error| error.with_path_prefix("thermal"))
    }

    /// `3/2 p ψ`, `N m/A`.
    pub(super) fn torque_constant_nm_per_a(&self) -> f64 {
        1.5 * f64::from(self.pole_pairs) * self.flux_linkage_vs
    }

    /// Without dead time the d-axis current is 0.
    pub(super) fn winding(&self) -> Winding {
        let pole_pairs = f64::from(self.pole_pairs);
        Winding {
            nm_per_a: self.torque_constant_nm_per_a(),
            bandwidth_per_s: self.current_bandwidth_rad_per_s,
            current_limit_a: self.current_limit_a,
            resistance_ohm: self.resistance_ohm,
            inductance_h: self.quadrature_inductance_h,
            emf_vs: pole_pairs * self.flux_linkage_vs,
            coupling_h: pole_pairs * self.quadrature_inductance_h,
            voltage_limit_v: self.supply_v / 3.0_f64.sqrt(),
            power_share: 1.5,
            thermal: self.thermal.clone(),
        }
    }

    pub(super) fn torque_nm(&self, [d_a, q_a]: [f64; 2]) -> f64 {
        let saliency_h = self.direct_inductance_h - self.quadrature_inductance_h;
        1.5 * f64::from(self.pole_pairs) * (self.flux_linkage_vs + saliency_h * d_a) * q_a
    }

    pub(super) fn electric(&self, wanted_nm: f64, rotor_rad_per_s: f64, state: &State) -> Electric {
        let (d_a, q_a) = (state.direct_a, state.quadrature_a);
        let (d_h, q_h) = (self.direct_inductance_h, self.quadrature_inductance_h);
        let warmth = self.thermal.as_ref().map_or(1.0, |thermal| thermal.warmth(state.winding_c));
        let resistance_ohm = self.resistance_ohm * warmth;
        let (lost_d_v, lost_q_v) = self.lost_v(resistance_ohm, rotor_rad_per_s, [d_a, q_a]);

        let limit_a = self.current_limit_a;
        let wanted_a = (wanted_nm / self.torque_constant_nm_per_a()).clamp(-limit_a, limit_a);
        let bandwidth = self.current_bandwidth_rad_per_s;
        let (d_v, q_v) = self.within_circle(
            lost_d_v + state.learned_d_v - d_h * bandwidth * d_a,
            lost_q_v + state.learned_q_v + q_h * bandwidth * (wanted_a - q_a),
        );

        let dead_ohm = self.dead_time_v() / (d_a * d_a + q_a * q_a).sqrt().max(self.dead_time_current_a);
        let (dead_d_v, dead_q_v) = (dead_ohm * d_a, dead_ohm * q_a);
        let copper_w = 1.5 * resistance_ohm * (d_a * d_a + q_a * q_a);
        let rates = State {
            direct_a: (d_v - dead_d_v - lost_d_v) / d_h,
            quadrature_a: (q_v - dead_q_v - lost_q_v) / q_h,
            learned_d_v: (dead_d_v - state.learned_d_v) * self.resistance_ohm / d_h,
            learned_q_v: (dead_q_v - state.learned_q_v) * self.resistance_ohm / q_h,
            winding_c: self.thermal.as_ref().map_or(0.0, |thermal| thermal.rate(state.winding_c, copper_w)),
            ..State::default()
        };
        Electric {
            rates,
            voltage_v: (d_v * d_v + q_v * q_v).sqrt(),
            supplied_w: 1.5 * (d_v * d_a + q_v * q_a),
            lost_w: copper_w + 1.5 * (dead_d_v * d_a + dead_q_v * q_a),
        }
    }

    /// Voltages of resistance, coupling and back-EMF on `d` and `q`, `V`, at currents in `A`.
    pub(super) fn lost_v(
        &self,
        resistance_ohm: f64,
        rotor_rad_per_s: f64,
        [d_a, q_a]: [f64; 2],
    ) -> (f64, f64) {
        let electrical_rad_per_s = f64::from(self.pole_pairs) * rotor_rad_per_s;
        (
            resistance_ohm * d_a - electrical_rad_per_s * self.quadrature_inductance_h * q_a,
            resistance_ohm * q_a
                + electrical_rad_per_s * (self.direct_inductance_h * d_a + self.flux_linkage_vs),
        )
    }

    /// Maximum voltage of dead time, `V`.
    fn dead_time_v(&self) -> f64 {
        if self.dead_time_share > 0.0 {
            4.0 / core::f64::consts::PI * self.supply_v * self.dead_time_share
        } else {
            0.0
        }
    }

    /// Limits `u_d` to the inverter's voltage and `u_q` to the rest.
    fn within_circle(&self, d_v: f64, q_v: f64) -> (f64, f64) {
        let radius_v = self.supply_v / 3.0_f64.sqrt();
        if radius_v.is_infinite() {
            return (d_v, q_v);
        }
        let d_v = d_v.clamp(-radius_v, radius_v);
        let room_v = (radius_v * radius_v - d_v * d_v).max(0.0).sqrt();
        (d_v, q_v.clamp(-room_v, room_v))
    }

    pub(super) fn field_j(&self, state: &State) -> f64 {
        let (d_a, q_a) = (state.direct_a, state.quadrature_a);
        0.75 * (self.direct_inductance_h * d_a * d_a + self.quadrature_inductance_h * q_a * q_a)
    }

    pub(super) fn paces(&self, rotor_kg_m2: f64) -> [Pace; 6] {
        let bandwidth = self.current_bandwidth_rad_per_s;
        let min_h = self.direct_inductance_h.min(self.quadrature_inductance_h);
        let dead_ohm = self.dead_time_v() / self.dead_time_current_a;
        let back_emf_vs = f64::from(self.pole_pairs) * self.flux_linkage_vs;
        // Above no-load speed the voltage cannot compensate the coupling of the axes.
        let no_load_rad_per_s = if self.supply_v.is_finite() {
            self.supply_v / (3.0_f64.sqrt() * self.flux_linkage_vs)
        } else {
            0.0
        };
        let electromechanical = back_emf_vs * (1.5 / (min_h * rotor_kg_m2)).sqrt();
        [
            Pace::of("motor.current_bandwidth_rad_per_s", bandwidth, bandwidth),
            Pace::of("motor.direct_inductance_h", self.direct_inductance_h, self.resistance_ohm / min_h),
            Pace::of("motor.dead_time_current_a", self.dead_time_current_a, dead_ohm / min_h),
            Pace::of("motor.supply_v", self.supply_v, no_load_rad_per_s),
            Pace::of("motor.flux_linkage_vs", self.flux_linkage_vs, electromechanical),
            Pace::of(
                "motor.viscous_nms_per_rad",
                self.viscous_nms_per_rad,
                self.viscous_nms_per_rad / rotor_kg_m2,
            ),
        ]
    }
}
