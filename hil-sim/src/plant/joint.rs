//! An actuated joint: motor, gear, flexible transmission, friction, load, hard stops.
//!
//! ```text
//!   command ──▶ motor ──▶ gear (ratio, efficiency) ──▶ transmission (spring, backlash) ──▶ load ◀── load from outside
//! ```
//! Everything is seen at the output, in rad and N m or in m and N; what has a fixed unit says it in its name. A section
//! that is left out is ideal: without `motor` the command is the torque, without `transmission` motor and load are one.
//!
//! Between two sub-steps everything smooth goes by the classic Runge-Kutta method of fourth order; dry friction comes
//! before and after it, half a step each, as an impulse that can stop the load and never turn it (Moreau's time stepping).
//! Sub-steps are a tenth of the fastest time constant at most.

mod friction;
mod gear;
mod load;
mod motor;
mod three_phase;
mod transmission;

pub use friction::{FrictionParameters, LuGreParameters};
pub use gear::GearParameters;
pub use load::{LoadParameters, StopsParameters};
pub use motor::{BrushedMotorParameters, WindingParameters};
pub use three_phase::ThreePhaseParameters;
pub use transmission::TransmissionParameters;

use serde::{Deserialize, Serialize};

use super::SUB_STEPS_MIN;
use super::parameter::{ParameterError, require};

/// Share of the fastest time constant that a sub-step takes.
const SHARE: f64 = 0.1;
/// Fastest rate that is simulated, `1/s`: 5 000 sub-steps a millisecond.
const MOST_RATE: f64 = 5e6 * SHARE;

/// What a joint is made of.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct JointParameters {
    /// What moves.
    pub load: LoadParameters,
    /// A brushed motor; without one, and without a three-phase one, the command is the torque.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motor: Option<BrushedMotorParameters>,
    /// A three-phase motor, instead of a brushed one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub three_phase: Option<ThreePhaseParameters>,
    /// Between motor and transmission.
    pub gear: GearParameters,
    /// Between gear and load; without one they are rigid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub transmission: Option<TransmissionParameters>,
    /// At the load.
    pub friction: FrictionParameters,
    /// Ends of the load's way.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stops: Option<StopsParameters>,
}

impl JointParameters {
    /// Says whether a joint like this can exist, and be simulated.
    ///
    /// # Errors
    /// The first parameter outside its range.
    pub fn check(&self) -> Result<(), ParameterError> {
        self.load.check().map_err(|error| error.within("load"))?;
        self.gear.check().map_err(|error| error.within("gear"))?;
        self.friction.check().map_err(|error| error.within("friction"))?;
        if let Some(motor) = &self.motor {
            motor.check().map_err(|error| error.within("motor"))?;
        }
        if let Some(motor) = &self.three_phase {
            motor.check().map_err(|error| error.within("three_phase"))?;
            require(
                "motor",
                1.0,
                self.motor.is_none(),
                "nothing beside `three_phase`: a joint has one motor",
            )?;
        }
        if let Some(stops) = &self.stops {
            stops.check().map_err(|error| error.within("stops"))?;
        }
        if let Some(transmission) = &self.transmission {
            transmission.check().map_err(|error| error.within("transmission"))?;
            let has_rotor = self.rotor_inertia() > 0.0;
            let allowed = "with a motor or gear that has an inertia: a spring needs a mass at both ends";
            require("transmission.stiffness", transmission.stiffness, has_rotor, allowed)?;
        }
        let rate = self.fastest_rate();
        let allowed =
            format!("with a fastest rate of {MOST_RATE} 1/s, not {rate:.0}: it takes too many sub-steps");
        require("load.inertia", self.load.inertia, rate <= MOST_RATE, &allowed)
    }

    /// The joint at rest at its start position, without a command.
    ///
    /// # Errors
    /// The first parameter outside its range.
    pub fn build(&self) -> Result<Joint, ParameterError> {
        self.check()?;
        let position = self.load.start_position;
        let ambient_c = self.winding().map_or(0.0, |winding| winding.ambient_c);
        let state = State { position, motor_position: position, winding_c: ambient_c, ..State::default() };
        Ok(Joint {
            parameters: self.clone(),
            rate: self.fastest_rate(),
            rotor_inertia: self.rotor_inertia(),
            state,
            bristle: 0.0,
            force: 0.0,
            voltage_v: 0.0,
        })
    }

    fn winding(&self) -> Option<&WindingParameters> {
        let brushed = self.motor.as_ref().map(|motor| &motor.winding);
        brushed.or(self.three_phase.as_ref().map(|motor| &motor.winding))
    }

    /// Of rotor and gear, seen at the output.
    fn rotor_inertia(&self) -> f64 {
        let rotor = self.motor.as_ref().map_or(0.0, |motor| motor.rotor_inertia_kg_m2)
            + self.three_phase.as_ref().map_or(0.0, |motor| motor.rotor_inertia_kg_m2);
        self.gear.ratio * self.gear.ratio * (rotor + self.gear.inertia_kg_m2)
    }

    /// The fastest of all time constants, as its inverse, `1/s`.
    fn fastest_rate(&self) -> f64 {
        let (load, rotor) = (self.load.inertia, self.rotor_inertia());
        let moving = if self.transmission.is_some() { load } else { load + rotor };
        let spring = self.transmission.as_ref().map_or(0.0, |spring| {
            let inverse = 1.0 / load + 1.0 / rotor;
            (spring.stiffness * inverse).sqrt() + spring.damping * inverse
        });
        let stops = self
            .stops
            .as_ref()
            .map_or(0.0, |stops| (stops.stiffness / moving).sqrt() + stops.damping / moving);
        let bristles = self
            .friction
            .lugre
            .as_ref()
            .map_or(0.0, |lugre| (lugre.stiffness / moving).sqrt() + lugre.damping / moving);
        let motor = self.motor.as_ref().map_or(0.0, BrushedMotorParameters::rate)
            + self.three_phase.as_ref().map_or(0.0, ThreePhaseParameters::rate);
        let damping = (self.load.damping + self.friction.viscous) / moving;
        [spring, stops, bristles, motor, damping].into_iter().fold(0.0, f64::max)
    }
}

/// What goes on by itself; its rates of change have the same form.
#[derive(Debug, Clone, Copy, Default)]
struct State {
    position: f64,
    velocity: f64,
    /// Of the rotor, seen at the output.
    motor_position: f64,
    motor_velocity: f64,
    /// That makes the torque: of a brushed motor, or the cross-axis one of a three-phase motor.
    current_a: f64,
    /// The other one of a three-phase motor.
    direct_current_a: f64,
    winding_c: f64,
}

impl State {
    /// This much further along rates of change.
    fn along(&self, rates: &Self, time_s: f64) -> Self {
        Self {
            position: self.position + time_s * rates.position,
            velocity: self.velocity + time_s * rates.velocity,
            motor_position: self.motor_position + time_s * rates.motor_position,
            motor_velocity: self.motor_velocity + time_s * rates.motor_velocity,
            current_a: self.current_a + time_s * rates.current_a,
            direct_current_a: self.direct_current_a + time_s * rates.direct_current_a,
            winding_c: self.winding_c + time_s * rates.winding_c,
        }
    }
}

/// What is known of a joint now. Output quantities are in rad and N m, or in m and N.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointState {
    /// Of the load.
    pub position: f64,
    /// Of the load.
    pub velocity: f64,
    /// Of the rotor, `rad` where there is a gear ratio from rotor to output.
    pub motor_position: f64,
    /// Of the rotor.
    pub motor_velocity: f64,
    /// What gear or transmission exert on the load, as a torque sensor there shows it.
    pub force: f64,
    /// Current that makes the torque.
    pub current_a: f64,
    /// Voltage of the winding: of a three-phase motor the length of its vector.
    pub voltage_v: f64,
    /// Temperature of the winding.
    pub winding_c: f64,
}

/// One joint.
#[derive(Debug)]
pub struct Joint {
    parameters: JointParameters,
    /// Inverse of the fastest time constant, `1/s`.
    rate: f64,
    /// Seen at the output.
    rotor_inertia: f64,
    state: State,
    /// How far the bristles of `LuGre` friction are bent.
    bristle: f64,
    /// On the load, by the drive, in the last sub-step.
    force: f64,
    voltage_v: f64,
}

/// What acts on a joint in a moment.
#[derive(Debug, Clone, Copy)]
struct Inputs {
    command: f64,
    /// From outside, and friction that is known before the sub-step.
    load: f64,
}

impl Joint {
    /// Holds `command` (N m or N) from `start_s` for `period_s` and moves on; `load` is what pushes the output from
    /// outside at a time, `s`. A command that is no number is applied as it is.
    pub fn advance(&mut self, start_s: f64, period_s: f64, command: f64, load: &dyn Fn(f64) -> f64) {
        let wanted = (period_s * self.rate / SHARE).ceil().max(f64::from(SUB_STEPS_MIN));
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few thousand at most")]
        let sub_steps = wanted as u32;
        let step_s = period_s / f64::from(sub_steps);
        for sub_step in 0..sub_steps {
            let time_s = start_s + (f64::from(sub_step) + 0.5) * step_s;
            self.sub_step(step_s, command, load(time_s));
        }
    }

    /// What is known now.
    #[must_use]
    pub fn state(&self) -> JointState {
        let State { position, velocity, motor_position, motor_velocity, current_a, winding_c, .. } =
            self.state;
        let ratio = self.parameters.gear.ratio;
        let is_rigid = self.parameters.transmission.is_none();
        let (rotor_position, rotor_velocity) =
            if is_rigid { (position, velocity) } else { (motor_position, motor_velocity) };
        JointState {
            position,
            velocity,
            motor_position: ratio * rotor_position,
            motor_velocity: ratio * rotor_velocity,
            force: self.force,
            current_a,
            voltage_v: self.voltage_v,
            winding_c,
        }
    }

    fn sub_step(&mut self, step_s: f64, command: f64, load: f64) {
        self.rub(0.5 * step_s, command, load);
        let bristles = match &self.parameters.friction.lugre {
            Some(lugre) => {
                lugre.force(&mut self.bristle, self.state.velocity, step_s, &self.parameters.friction)
            }
            None => 0.0,
        };
        let inputs = Inputs { command, load: load - bristles };
        let state = self.state;
        let (first, ..) = self.rates(&state, inputs);
        let (second, ..) = self.rates(&state.along(&first, 0.5 * step_s), inputs);
        let (third, ..) = self.rates(&state.along(&second, 0.5 * step_s), inputs);
        let (fourth, force, voltage_v) = self.rates(&state.along(&third, step_s), inputs);
        let sum = first.along(&second, 2.0).along(&third, 2.0).along(&fourth, 1.0);
        self.state = state.along(&sum, step_s / 6.0);
        (self.force, self.voltage_v) = (force, voltage_v);
        self.rub(0.5 * step_s, command, load);
    }

    /// Rates of change, what the drive exerts on the load, and the winding's voltage.
    fn rates(&self, state: &State, inputs: Inputs) -> (State, f64, f64) {
        let JointParameters { load, gear, transmission, friction, stops, .. } = &self.parameters;
        let is_rigid = transmission.is_none();
        let rotor_velocity = if is_rigid { state.velocity } else { state.motor_velocity };
        let drive = self.drive(state, inputs.command, rotor_velocity);
        let at_stop = stops.as_ref().map_or(0.0, |stops| stops.force(state.position, state.velocity));
        let others = inputs.load + at_stop + load.gravity_at(state.position)
            - (load.damping + friction.viscous) * state.velocity;
        let (acceleration, motor_acceleration, force) = match transmission {
            None => {
                let accelerate = |efficiency: f64| {
                    let acceleration = (efficiency * drive.force + others)
                        / (load.inertia + efficiency * self.rotor_inertia);
                    (acceleration, efficiency * (drive.force - self.rotor_inertia * acceleration))
                };
                let forward = accelerate(gear.efficiency);
                let (acceleration, force) = if forward.1 * state.velocity >= 0.0 {
                    forward
                } else {
                    accelerate(1.0 / gear.efficiency)
                };
                (acceleration, acceleration, force)
            }
            Some(transmission) => {
                let force = transmission
                    .force(state.motor_position - state.position, state.motor_velocity - state.velocity);
                let efficiency =
                    if force * state.motor_velocity >= 0.0 { gear.efficiency } else { 1.0 / gear.efficiency };
                let motor_acceleration = (drive.force - force / efficiency) / self.rotor_inertia;
                ((force + others) / load.inertia, motor_acceleration, force)
            }
        };
        let rates = State {
            position: state.velocity,
            velocity: acceleration,
            motor_position: rotor_velocity,
            motor_velocity: motor_acceleration,
            current_a: drive.current_a_per_s,
            direct_current_a: drive.direct_current_a_per_s,
            winding_c: drive.winding_c_per_s,
        };
        (rates, force, drive.voltage_v)
    }

    fn drive(&self, state: &State, command: f64, rotor_velocity: f64) -> Drive {
        let ratio = self.parameters.gear.ratio;
        let rad_per_s = ratio * rotor_velocity;
        let mut drive = match (&self.parameters.motor, &self.parameters.three_phase) {
            (Some(motor), _) => motor.drive(state, command / ratio, rad_per_s),
            (None, Some(motor)) => motor.drive(state, command / ratio, rad_per_s),
            (None, None) => return Drive { force: command, ..Drive::default() },
        };
        drive.force *= ratio;
        drive
    }

    /// Lets dry friction act for a time.
    fn rub(&mut self, time_s: f64, command: f64, load: f64) {
        let friction = &self.parameters.friction;
        if friction.lugre.is_some() || friction.coulomb <= 0.0 {
            return;
        }
        let is_rigid = self.parameters.transmission.is_none();
        let inertia = self.parameters.load.inertia + if is_rigid { self.rotor_inertia } else { 0.0 };
        let velocity = self.state.velocity;
        if velocity.abs() > 0.0 {
            let loss = friction.dry(velocity.abs()) * time_s / inertia;
            self.state.velocity = velocity.signum() * (velocity.abs() - loss).max(0.0);
        } else {
            // What holds a load at rest takes off what pushes it, up to what it can.
            let (rates, ..) = self.rates(&self.state, Inputs { command, load });
            let push = rates.velocity * inertia;
            let held = push.clamp(-friction.dry(0.0), friction.dry(0.0));
            self.state.velocity -= held * time_s / inertia;
        }
        if is_rigid {
            self.state.motor_velocity = self.state.velocity;
        }
    }
}

/// What a motor does in a moment.
#[derive(Debug, Clone, Copy, Default)]
struct Drive {
    /// At the rotor, then at the output.
    force: f64,
    current_a_per_s: f64,
    direct_current_a_per_s: f64,
    winding_c_per_s: f64,
    voltage_v: f64,
}

#[cfg(test)]
mod tests;
