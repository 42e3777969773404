//! Three-phase motor with half bridges, from duty cycles to phase currents, for tests of a board's current loop. A
//! [`Joint`](super::Joint) has its own motor model.
//!
//! The equations are those of [`ThreePhaseParameters`], averaged over a PWM period; dead time reduces each phase
//! voltage by `U share` against its current; with the bridge off the diodes conduct until the current is 0. The rotor
//! turns freely with its load: `J w' = τ + cogging - viscous w - coulomb tanh(w/w0)`.

use core::f64::consts::TAU;

use super::three_phase::ThreePhaseParameters;
use crate::plant::parameter::{ParameterError, positive, require};

/// Minimum Runge-Kutta steps per period.
const STEPS: f64 = 10.0;
/// Speed range of the sign change of Coulomb friction.
const REVERSING_RAD_PER_S: f64 = 0.05;

/// A motor with inverter and load.
#[derive(Debug, Clone)]
pub struct BridgeMotor {
    parameters: ThreePhaseParameters,
    cogging_nm: f64,
    cogging_periods: f64,
    state: BridgeState,
}

/// State.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BridgeState {
    /// d-axis current, `A`.
    pub direct_a: f64,
    /// q-axis current, `A`.
    pub quadrature_a: f64,
    /// Rotor angle, `rad`; 0: magnets aligned with phase U.
    pub angle_rad: f64,
    /// Rotor speed, `rad/s`.
    pub speed_rad_per_s: f64,
}

impl BridgeState {
    fn after(self, step_s: f64, rates: Self) -> Self {
        Self {
            direct_a: self.direct_a + step_s * rates.direct_a,
            quadrature_a: self.quadrature_a + step_s * rates.quadrature_a,
            angle_rad: self.angle_rad + step_s * rates.angle_rad,
            speed_rad_per_s: self.speed_rad_per_s + step_s * rates.speed_rad_per_s,
        }
    }
}

impl BridgeMotor {
    /// Creates a motor at rest without current. Parameters of current loop and winding temperature are not used.
    ///
    /// # Errors
    /// The first parameter out of range, or a rotor without inertia.
    pub fn new(parameters: &ThreePhaseParameters) -> Result<Self, ParameterError> {
        parameters.check()?;
        positive("rotor_inertia_kg_m2", parameters.rotor_inertia_kg_m2)?;
        let supply_v = parameters.supply_v;
        require("supply_v", supply_v, supply_v.is_finite(), "finite")?;
        Ok(Self {
            parameters: parameters.clone(),
            cogging_nm: 0.0,
            cogging_periods: 0.0,
            state: BridgeState::default(),
        })
    }

    /// Adds cogging with this number of periods per turn and this amplitude, `N m`.
    #[must_use]
    pub fn with_cogging(self, cogging_nm: f64, per_turn: u32) -> Self {
        Self { cogging_nm, cogging_periods: f64::from(per_turn), ..self }
    }

    /// State.
    #[must_use]
    pub fn state(&self) -> BridgeState {
        self.state
    }

    /// Sets rotor angle and speed.
    pub fn set_rotor(&mut self, angle_rad: f64, speed_rad_per_s: f64) {
        self.state = BridgeState { angle_rad, speed_rad_per_s, ..self.state };
    }

    /// Returns the torque of its currents, `N m`.
    #[must_use]
    pub fn torque_nm(&self) -> f64 {
        self.parameters.torque_nm([self.state.direct_a, self.state.quadrature_a])
    }

    /// Returns the phase currents U, V, W into the motor, `A`.
    #[must_use]
    pub fn phase_a(&self) -> [f64; 3] {
        self.phases([self.state.direct_a, self.state.quadrature_a], self.state.angle_rad)
    }

    /// Advances by `period_s` with these duty cycles of the upper switches, or with all switches off.
    pub fn advance(&mut self, duties: Option<[f64; 3]>, period_s: f64) {
        let ThreePhaseParameters { direct_inductance_h, quadrature_inductance_h, .. } = self.parameters;
        let ThreePhaseParameters { supply_v, dead_time_current_a, dead_time_share, .. } = self.parameters;
        // The fastest dynamics are at a current reversal: the diodes conduct at half of the supply voltage, with the
        // bridge on for its dead time.
        let share = if duties.is_some() { dead_time_share } else { 0.5 };
        let turning_per_s =
            share * supply_v / dead_time_current_a / direct_inductance_h.min(quadrature_inductance_h);
        let steps = (turning_per_s * period_s).ceil().max(STEPS);
        let step_s = period_s / steps;
        let rates = |state| self.rates(state, duties);
        let mut state = self.state;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
        for _ in 0..steps as u32 {
            let first = rates(state);
            let second = rates(state.after(0.5 * step_s, first));
            let third = rates(state.after(0.5 * step_s, second));
            let fourth = rates(state.after(step_s, third));
            state = state
                .after(step_s / 6.0, first)
                .after(step_s / 3.0, second)
                .after(step_s / 3.0, third)
                .after(step_s / 6.0, fourth);
        }
        self.state = state;
    }

    fn rates(&self, state: BridgeState, duties: Option<[f64; 3]>) -> BridgeState {
        let ThreePhaseParameters { supply_v, dead_time_share, dead_time_current_a, .. } = self.parameters;
        let currents_a = [state.direct_a, state.quadrature_a];
        let phases_a = self.phases(currents_a, state.angle_rad);
        let against = phases_a.map(|phase_a| (phase_a / dead_time_current_a).clamp(-1.0, 1.0));
        let lost_v =
            self.parameters.lost_v(self.parameters.resistance_ohm, state.speed_rad_per_s, currents_a);
        let [d_v, q_v] = match duties {
            Some(duties) => {
                let volts = std::iter::zip(duties, against)
                    .map(|(duty, against)| supply_v * (duty - dead_time_share * against));
                self.turned(volts, state.angle_rad)
            }
            None => {
                self.turned(against.into_iter().map(|against| -0.5 * supply_v * against), state.angle_rad)
            }
        };
        // Diodes do not conduct by themselves: the back-EMF stays below the supply voltage.
        let is_led = duties.is_some() || against.iter().any(|against| against.abs() > 1e-3);
        let lost_v = if is_led { lost_v } else { (0.0, 0.0) };
        let field_nm = self.parameters.torque_nm(currents_a);
        let cogging_nm = -self.cogging_nm * (self.cogging_periods * state.angle_rad).sin();
        let speed = state.speed_rad_per_s;
        let ThreePhaseParameters { viscous_nms_per_rad, coulomb_nm, .. } = self.parameters;
        let friction_nm = viscous_nms_per_rad * speed + coulomb_nm * (speed / REVERSING_RAD_PER_S).tanh();
        let torque_nm = field_nm + cogging_nm - friction_nm;
        BridgeState {
            direct_a: (d_v - lost_v.0) / self.parameters.direct_inductance_h,
            quadrature_a: (q_v - lost_v.1) / self.parameters.quadrature_inductance_h,
            angle_rad: speed,
            speed_rad_per_s: torque_nm / self.parameters.rotor_inertia_kg_m2,
        }
    }

    /// Converts a dq vector to phases.
    fn phases(&self, [d, q]: [f64; 2], angle_rad: f64) -> [f64; 3] {
        let electrical_rad = f64::from(self.parameters.pole_pairs) * angle_rad;
        [0.0, 1.0, 2.0].map(|phase| {
            let (sin, cos) = (electrical_rad - phase * TAU / 3.0).sin_cos();
            d * cos - q * sin
        })
    }

    /// Converts phases to a dq vector; the common mode has no effect with a floating star point.
    fn turned(&self, phases: impl Iterator<Item = f64>, angle_rad: f64) -> [f64; 2] {
        let electrical_rad = f64::from(self.parameters.pole_pairs) * angle_rad;
        phases.zip([0.0, 1.0, 2.0]).fold([0.0, 0.0], |[d, q], (value, phase)| {
            let (sin, cos) = (electrical_rad - phase * TAU / 3.0).sin_cos();
            [d + 2.0 / 3.0 * value * cos, q - 2.0 / 3.0 * value * sin]
        })
    }
}
