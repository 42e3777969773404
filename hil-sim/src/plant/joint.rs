//! One actuated joint: motor, gear, elastic element, load.
//!
//! ```text
//!   command ──▶ current loop ──▶ rotor ──▶ gear ──▶ spring, backlash ──▶ load ◀── friction, stops, gravity, load(t)
//! ```
//! The output is rotary (`rad`, `N m`, `kg m²`) or linear (`m`, `N`, `kg`); quantities without a unit in their name
//! have the unit of the output. Missing sections are ideal: with `load.inertia` alone, a joint is this inertia with
//! an ideal torque source.
//!
//! A rigid joint is integrated exactly, a whole period at once if no event (contact, release, reversal, limit) is
//! possible. In voltage saturation, and with bristles, dead time or a flexible element, it is integrated by the
//! classical fourth-order Runge-Kutta method, in sub-steps that resolve the fastest dynamics. At reversals and
//! contact changes, the sub-step is halved until the event is located within 1/1024 of it.

mod bridge_motor;
mod brushed;
mod electric;
mod exact;
mod flexible;
mod friction;
mod gear;
mod leg;
mod load;
mod mechanics;
mod mode;
mod motor;
mod pace;
mod push;
mod state;
mod step;
mod stops;
mod sub_steps;
#[cfg(test)]
mod tests;
mod thermal;
mod three_phase;
mod winding;

pub use bridge_motor::{BridgeMotor, BridgeState};
pub use brushed::BrushedParameters;
pub use flexible::FlexibleParameters;
pub use friction::FrictionParameters;
pub use gear::GearParameters;
pub use load::LoadParameters;
pub(super) use mode::Slide;
pub use motor::JointMotorParameters;
pub(super) use stops::Contact;
pub use stops::StopsParameters;
pub use thermal::ThermalParameters;
pub use three_phase::ThreePhaseParameters;

use super::SUB_STEPS_MIN;
use super::parameter::{ParameterError, require};
use exact::ExactSteps;
use mechanics::{Inputs, Mechanics, Rates};
use serde::{Deserialize, Serialize};
use state::State;
use step::{HALVINGS_MAX, PERIOD_HALVINGS, Period};

/// Parameters of a joint.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct JointParameters {
    /// Load.
    pub load: LoadParameters,
    /// Motor; default: an ideal source.
    #[serde(default, skip_serializing_if = "is_default")]
    pub motor: JointMotorParameters,
    /// Gear between rotor and output; default: 1:1.
    #[serde(default, skip_serializing_if = "is_default")]
    pub gear: GearParameters,
    /// Elastic element between gear and load; default: rigid.
    #[serde(default)]
    pub flexible: Option<FlexibleParameters>,
    /// Friction at the output; default: none.
    #[serde(default)]
    pub friction: FrictionParameters,
    /// End stops; default: none.
    #[serde(default)]
    pub stops: Option<StopsParameters>,
}

/// Skips a missing part in a file.
fn is_default<P: Default + PartialEq>(part: &P) -> bool {
    *part == P::default()
}

impl JointParameters {
    /// Creates a joint with an ideal source and a load of this inertia (`kg m²` or `kg`).
    #[must_use]
    pub fn of_inertia(inertia: f64) -> Self {
        Self {
            load: LoadParameters::of_inertia(inertia),
            motor: JointMotorParameters::default(),
            gear: GearParameters::default(),
            flexible: None,
            friction: FrictionParameters::default(),
            stops: None,
        }
    }

    /// Returns the maximum force of the motor at the output of an ideal gear, `N m` or `N`; infinite for an ideal
    /// source.
    #[must_use]
    pub fn max_force(&self) -> f64 {
        self.gear.ratio * self.motor.max_torque_nm()
    }

    /// Returns the joint without nonlinearities: Coulomb friction, gear losses and backlash, stops. Motor limits
    /// remain.
    #[must_use]
    pub fn linear(&self) -> Self {
        let viscous = self.friction.viscous;
        let mut motor = self.motor.clone();
        match &mut motor {
            JointMotorParameters::Ideal {} => {}
            JointMotorParameters::Brushed(motor) => motor.coulomb_nm = 0.0,
            JointMotorParameters::ThreePhase(motor) => motor.coulomb_nm = 0.0,
        }
        let GearParameters { ratio, inertia_kg_m2, .. } = self.gear;
        Self {
            motor,
            gear: GearParameters { ratio, inertia_kg_m2, ..GearParameters::default() },
            friction: FrictionParameters { viscous, ..FrictionParameters::default() },
            stops: None,
            ..self.clone()
        }
    }

    /// Checks whether the joint is physically possible and can be simulated.
    ///
    /// # Errors
    /// The first parameter out of range, or the parameter that requires too many sub-steps.
    pub fn check(&self) -> Result<(), ParameterError> {
        self.build().map(drop)
    }

    /// Builds the joint, at rest at its start position.
    ///
    /// # Errors
    /// As [`check`](Self::check).
    pub fn build(&self) -> Result<Joint, ParameterError> {
        self.load.check().map_err(|error| error.with_path_prefix("load"))?;
        self.motor.check().map_err(|error| error.with_path_prefix("motor"))?;
        self.gear.check().map_err(|error| error.with_path_prefix("gear"))?;
        self.friction.check().map_err(|error| error.with_path_prefix("friction"))?;
        let rotor_kg_m2 = self.motor.rotor_inertia_kg_m2() + self.gear.inertia_kg_m2;
        let backlash = self.gear.backlash;
        if let Some(flexible) = &self.flexible {
            flexible.check().map_err(|error| error.with_path_prefix("flexible"))?;
            let allowed = "> 0 with `flexible` unless the rotor has inertia";
            require("gear.inertia_kg_m2", self.gear.inertia_kg_m2, rotor_kg_m2 > 0.0, allowed)?;
        } else {
            require("gear.backlash", backlash, backlash <= 0.0, "0 without `flexible`")?;
        }
        if let Some(stops) = &self.stops {
            stops.check().map_err(|error| error.with_path_prefix("stops"))?;
        }
        let mut mechanics = Mechanics {
            load: self.load.clone(),
            stops: self.stops.clone(),
            friction: self.friction.clone(),
            gear: self.gear.clone(),
            flexible: self.flexible.as_ref().map(|flexible| flexible.with_backlash(backlash)),
            motor: self.motor.clone(),
            winding: None,
            rotor_kg_m2,
        };
        if mechanics.is_exact() {
            mechanics.winding = self.motor.winding();
        }
        let sub_steps_per_s = sub_steps::sub_steps_per_s(&mechanics)?;
        let state = mechanics.start();
        let exact = mechanics.is_exact().then(|| ExactSteps::new(&mechanics));
        let is_source = mechanics.is_source();
        Ok(Joint { mechanics, sub_steps_per_s, state, inputs: Inputs::default(), exact, is_source })
    }
}

/// Simulation of a joint.
#[derive(Debug)]
pub struct Joint {
    mechanics: Mechanics,
    sub_steps_per_s: f64,
    state: State,
    /// At the end of the last period.
    inputs: Inputs,
    exact: Option<ExactSteps>,
    /// Whether the commanded force arrives at the output unchanged.
    is_source: bool,
}

/// True state of a joint, without sensors.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointState {
    /// Output position, `rad` or `m`.
    pub position: f64,
    /// Output velocity, `rad/s` or `m/s`.
    pub velocity: f64,
    /// Rotor angle, `rad`.
    pub motor_position: f64,
    /// Rotor speed, `rad/s`.
    pub motor_velocity: f64,
    /// Force of the drive on the output, `N m` or `N`, as shown by a torque sensor at the gear output.
    pub force: f64,
    /// Winding current, `A`; three-phase: `i_q`, phase peak.
    pub current_a: f64,
    /// Motor voltage, `V`; three-phase: phase amplitude.
    pub voltage_v: f64,
    /// Winding temperature, `°C`.
    pub winding_c: f64,
}

/// Energies of a joint, `J`. Supplied minus dissipated energy equals the change of stored energy.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointEnergy {
    /// Supplied by amplifier and external force since the start.
    pub supplied_j: f64,
    /// Dissipated by friction, damping, gear, winding and dead time since the start.
    pub dissipated_j: f64,
    /// Stored in motion, springs, gravity and magnetic field.
    pub stored_j: f64,
}

impl Joint {
    /// Applies the constant `command` (`N m` or `N`, at the output of an ideal gear) from `start_s` for `period_s`
    /// with the external force `load(time_s)` (`N m` or `N`, positive towards larger positions).
    ///
    /// NaN and infinite commands are applied unchanged.
    pub fn advance(&mut self, start_s: f64, period_s: f64, command: f64, load: &dyn Fn(f64) -> f64) {
        self.advance_under(start_s, period_s, command, load, false);
    }

    /// Like [`advance`](Self::advance), with a constant external force.
    #[inline]
    pub fn advance_with_constant_force(&mut self, start_s: f64, period_s: f64, command: f64, force: f64) {
        if let Some(steps) = &mut self.exact {
            let wanted_nm = command / self.mechanics.gear.ratio;
            self.inputs = Inputs { wanted_nm, load: force, ..self.inputs };
            if self.mechanics.glide(steps, &mut self.state, self.inputs, period_s) {
                return;
            }
        }
        self.advance_under(start_s, period_s, command, &|_| force, true);
    }

    fn advance_under(
        &mut self,
        start_s: f64,
        period_s: f64,
        command: f64,
        load: &dyn Fn(f64) -> f64,
        is_held: bool,
    ) {
        let Self { mechanics, state, exact, sub_steps_per_s, inputs: before, .. } = self;
        let exact = exact.as_mut();
        let (sub_steps, halvings) = match exact {
            Some(_) => (1.0, HALVINGS_MAX + PERIOD_HALVINGS),
            None => ((*sub_steps_per_s * period_s).ceil().max(f64::from(SUB_STEPS_MIN)), HALVINGS_MAX),
        };
        let step_s = period_s / sub_steps;
        let inputs = Inputs {
            wanted_nm: command / mechanics.gear.ratio,
            load: load(start_s),
            settling_max_per_s: step_s.recip(),
        };
        let mut mode = mechanics.mode(&inputs, state);
        let sub_steps_per_s = *sub_steps_per_s;
        let mut period = Period { mechanics, load, is_held, sub_steps_per_s, exact, inputs };
        let mut done = 0.0;
        while done < sub_steps {
            period.pass(state, &mut mode, start_s + done * step_s, step_s, halvings);
            done += 1.0;
        }
        *before = period.inputs;
    }

    /// Changes the spring of its load; the energy of the change is not accounted.
    pub fn set_load_spring(&mut self, stiffness: f64, rest_position: f64) {
        let load = &mut self.mechanics.load;
        let before_j = load.potential_j(self.state.position);
        (load.stiffness, load.rest_position) = (stiffness, rest_position);
        self.state.supplied_j += load.potential_j(self.state.position) - before_j;
    }

    /// Returns the output position, `rad` or `m`.
    #[must_use]
    pub fn position(&self) -> f64 {
        self.state.position
    }

    /// Returns the force of the drive on the output, `N m` or `N`.
    #[must_use]
    pub fn force(&self) -> f64 {
        if self.is_source {
            return self.mechanics.gear.ratio * self.inputs.wanted_nm;
        }
        self.rates().force
    }

    fn rates(&self) -> Rates {
        let Self { mechanics, state, inputs, .. } = self;
        mechanics.rates(inputs, state, &mechanics.mode(inputs, state))
    }

    /// Returns the output acceleration, `rad/s²` or `m/s²`.
    #[must_use]
    pub fn acceleration(&self) -> f64 {
        self.rates().state.velocity
    }

    /// Returns its state, without energies and winding temperature.
    pub(crate) fn values(&self) -> Vec<f64> {
        self.state.clone().values_mut().map(|value| *value).to_vec()
    }

    /// Sets its state; missing entries are unchanged.
    pub(crate) fn set_values(&mut self, values: &[f64]) {
        for (own, value) in self.state.values_mut().into_iter().zip(values) {
            *own = *value;
        }
    }

    /// Whether it is in contact with a stop.
    #[must_use]
    pub fn is_at_stop(&self) -> bool {
        let stops = self.mechanics.stops.as_ref();
        stops.is_some_and(|stops| stops.beyond(self.state.position).abs() > 0.0)
    }

    /// Returns the true state.
    #[must_use]
    pub fn state(&self) -> JointState {
        let Self { mechanics, state, .. } = self;
        let (motor_position, motor_velocity) = mechanics.rotor(state);
        let rates = match self.is_source {
            true => Rates { force: self.force(), ..Rates::default() },
            false => self.rates(),
        };
        JointState {
            position: state.position,
            velocity: state.velocity,
            motor_position,
            motor_velocity,
            force: rates.force,
            current_a: state.quadrature_a,
            voltage_v: rates.voltage_v,
            winding_c: state.winding_c,
        }
    }

    /// Returns its energies.
    #[must_use]
    pub fn energy(&self) -> JointEnergy {
        let State { supplied_j, dissipated_j, .. } = self.state;
        let stored_j = self.mechanics.stored_j(&self.state);
        // Exact steps have exact supplied and stored energies.
        let dissipated_j = match &self.exact {
            Some(steps) => supplied_j - (stored_j - steps.start_j),
            None => dissipated_j,
        };
        JointEnergy { supplied_j, dissipated_j, stored_j }
    }
}
