//! A winding with a first-order current response, `i' = wc (i_ref - i)`, below voltage saturation.

use super::state::State;
use super::thermal::ThermalParameters;
use crate::plant::transition::Transition;

/// Negligible d-axis current, `A`.
const NO_CURRENT_A: f64 = 1e-9;

/// Winding of a brushed motor, or three phases without dead time: all current produces torque.
#[derive(Debug, Clone)]
pub(super) struct Winding {
    pub(super) nm_per_a: f64,
    pub(super) bandwidth_per_s: f64,
    pub(super) current_limit_a: f64,
    /// At 25 °C.
    pub(super) resistance_ohm: f64,
    pub(super) inductance_h: f64,
    /// Voltage per rotor speed.
    pub(super) emf_vs: f64,
    /// Voltage per rotor speed and current, orthogonal to the others; 0 for a brushed motor.
    pub(super) coupling_h: f64,
    pub(super) voltage_limit_v: f64,
    /// Power per voltage times current.
    pub(super) power_share: f64,
    pub(super) thermal: Option<ThermalParameters>,
}

/// Current over a step: final value, and initial deviation.
#[derive(Debug, Clone, Copy)]
pub(super) struct Current {
    pub(super) settled_a: f64,
    pub(super) off_a: f64,
}

impl Current {
    /// Its range.
    pub(super) fn range_a(self) -> [f64; 2] {
        let start_a = self.settled_a + self.off_a;
        [self.settled_a.min(start_a), self.settled_a.max(start_a)]
    }
}

impl Winding {
    pub(super) fn current(&self, wanted_nm: f64, state: &State) -> Current {
        let limit_a = self.current_limit_a;
        let settled_a = (wanted_nm / self.nm_per_a).clamp(-limit_a, limit_a);
        Current { settled_a, off_a: state.quadrature_a - settled_a }
    }

    /// Whether the voltage is not saturated while the current settles and the rotor speed changes by up to
    /// `change_rad_per_s`.
    pub(super) fn follows(
        &self,
        state: &State,
        current: Current,
        rotor_rad_per_s: f64,
        change_rad_per_s: f64,
    ) -> bool {
        let warmth = self.thermal.as_ref().map_or(1.0, |thermal| thermal.warmth(state.winding_c));
        let Current { settled_a, off_a } = current;
        let start_a = settled_a + off_a;
        // The required voltage is linear in the current.
        let needs_v = |current_a: f64, off_a: f64| {
            let own_v = self.resistance_ohm * warmth * current_a + self.emf_vs * rotor_rad_per_s;
            (own_v - self.inductance_h * self.bandwidth_per_s * off_a).abs()
        };
        let along_v = needs_v(start_a, off_a).max(needs_v(settled_a, 0.0)) + self.emf_vs * change_rad_per_s;
        let fastest = rotor_rad_per_s.abs() + change_rad_per_s;
        let across_v = self.coupling_h * fastest * start_a.abs().max(settled_a.abs());
        let is_along =
            state.direct_a.abs() <= NO_CURRENT_A && state.learned_d_v.abs() + state.learned_q_v.abs() <= 0.0;
        is_along && along_v * along_v + across_v * across_v <= self.voltage_limit_v * self.voltage_limit_v
    }

    /// Advances current and temperature by a step without saturation; returns the energy consumed in addition to the
    /// mechanical work, `J`.
    pub(super) fn settle(
        &self,
        transition: &Transition,
        state: &mut State,
        current: Current,
        step_s: f64,
    ) -> f64 {
        let Current { settled_a, off_a } = current;
        let (lag, lag_s) = transition.lag();
        let before_a = state.quadrature_a;
        (state.direct_a, state.quadrature_a) = (0.0, settled_a + off_a * lag);
        let squared_s = 0.5 * (1.0 - lag * lag) / self.bandwidth_per_s;
        let square_a2s =
            settled_a * settled_a * step_s + 2.0 * settled_a * off_a * lag_s + off_a * off_a * squared_s;
        let cold_j = self.power_share * self.resistance_ohm * square_a2s;
        let copper_j = self.thermal.as_ref().map_or(cold_j, |thermal| {
            let warming_k = thermal.warming_k(state.winding_c, cold_j, step_s);
            let mean_c = state.winding_c + 0.5 * warming_k;
            state.winding_c += warming_k;
            cold_j * thermal.warmth(mean_c)
        });
        let half_h = 0.5 * self.power_share * self.inductance_h;
        copper_j + half_h * (state.quadrature_a * state.quadrature_a - before_a * before_a)
    }
}
