//! One moving mass and everything that acts on it.
//!
//! `m v' = F_motor + Σ F_environment - b v - F_coulomb`, `m` with everything that moves along.
//!
//! Between events this is linear and each sub-step is exact. An event is a change of regime: of the summed slopes
//! (contact, release), of the sliding direction, of the motor's supply. A sub-step that ends in another regime than
//! it began in is halved until the event is located within `period / 20 / 2^10`, 49 ns at 1 kHz.

use super::environment::{Environment, Law, Role};
use super::motor::{Motor, MotorParameters, Supply};
use super::parameter::ParameterError;
use super::transition::{Dynamics, Transition};
use super::{AxisTruth, DeviceParameters, EnvironmentParameters, SUB_STEPS_MIN};
use serde::{Deserialize, Serialize};

/// How often a sub-step may be halved.
const HALVINGS_MAX: u8 = 10;
/// Transitions kept; regimes times halvings in use are fewer in any usual scene.
const TRANSITIONS_MAX: usize = 64;

/// Everything about one axis.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct AxisParameters {
    /// The device itself.
    pub device: DeviceParameters,
    /// Its motor; none for an ideal force source.
    pub motor: Option<MotorParameters>,
    /// What acts on it.
    pub environments: Vec<EnvironmentParameters>,
}

impl AxisParameters {
    /// The axis these parameters describe.
    ///
    /// # Errors
    /// The first parameter outside its range.
    pub fn build(&self) -> Result<Axis, ParameterError> {
        let build = |(index, environment): (usize, &EnvironmentParameters)| {
            environment.build().map_err(|error| error.within(&format!("environments[{index}]")))
        };
        let environments = self.environments.iter().enumerate().map(build).collect::<Result<_, _>>()?;
        Axis::new(&self.device, self.motor.as_ref(), environments)
    }
}

/// One moving mass.
#[derive(Debug)]
pub struct Axis {
    scene: Scene,
    transitions: Transitions,
    state: State,
    regime: Regime,
    /// Since the start of the period, `s`.
    elapsed_s: f64,
}

impl Axis {
    /// An axis at rest at its start position, with no command.
    ///
    /// # Errors
    /// The first device or motor parameter outside its range.
    pub fn new(
        device: &DeviceParameters,
        motor: Option<&MotorParameters>,
        environments: Vec<Box<dyn Environment>>,
    ) -> Result<Self, ParameterError> {
        device.check().map_err(|error| error.within("device"))?;
        let motor = motor.map(Motor::new).transpose().map_err(|error| error.within("motor"))?;
        let mass_kg = device.mass_kg
            + motor.as_ref().map_or(0.0, Motor::referred_mass_kg)
            + environments.iter().map(|environment| environment.added_mass_kg()).sum::<f64>();
        let scene = Scene {
            device: device.clone(),
            motor,
            environments,
            inverse_mass_per_kg: 1.0 / mass_kg,
            command_n: 0.0,
        };
        let state = State { position_m: device.start_position_m, velocity_m_per_s: 0.0, actuator_n: 0.0 };
        let regime = scene.regime(0.0, &state);
        let transitions = Transitions::new(&scene, regime.key, 0.0);
        Ok(Self { scene, transitions, state, regime, elapsed_s: 0.0 })
    }

    /// What the encoder reports now, `m`.
    #[expect(clippy::cast_possible_truncation, reason = "the controller's number is an f32")]
    pub(super) fn sense(&self) -> f32 {
        self.scene.device.encoder_m(self.state.position_m) as f32
    }

    /// Holds `command_n` from now on, for the 20 [`sub_step`](Self::sub_step)s of a period.
    pub(super) fn begin_period(&mut self, start_s: f64, period_s: f64, command_n: f64) {
        self.scene.command_n = command_n;
        if self.scene.motor.is_none() {
            self.state.actuator_n = command_n;
        }
        for environment in &mut self.scene.environments {
            environment.begin_period(start_s, period_s);
        }
        self.elapsed_s = 0.0;
        self.regime = self.scene.regime(0.0, &self.state);
        let sub_step_s = period_s / f64::from(SUB_STEPS_MIN);
        if sub_step_s.to_bits() != self.transitions.sub_step_s.to_bits() {
            self.transitions = Transitions::new(&self.scene, self.regime.key, sub_step_s);
        }
    }

    /// Moves on by one sub-step.
    #[inline]
    pub(super) fn sub_step(&mut self) {
        self.step(0);
    }

    /// Moves on by a sub-step halved `halvings` times.
    #[inline]
    fn step(&mut self, halvings: u8) {
        let key = self.regime.key;
        let transition = self.transitions.get(&self.scene, key, halvings);
        let is_last = halvings == HALVINGS_MAX;
        if is_last || !transition.is_too_coarse {
            let mut state = self.scene.step(transition, &self.state, &self.regime);
            let elapsed_s = self.elapsed_s + transition.step_s;
            let mut regime = self.scene.regime(elapsed_s, &state);
            if regime.key == key || is_last {
                if regime.key != key && key.slide.is_left_by(regime.key.slide) {
                    state.velocity_m_per_s = 0.0;
                    regime = self.scene.regime(elapsed_s, &state);
                }
                self.state = state;
                self.regime = regime;
                self.elapsed_s = elapsed_s;
                return;
            }
        }
        self.step_twice(halvings + 1);
    }

    #[cold]
    #[inline(never)]
    fn step_twice(&mut self, halvings: u8) {
        self.step(halvings);
        self.step(halvings);
    }

    /// The simulator's own truth about this axis now.
    #[must_use]
    pub fn truth(&self) -> AxisTruth {
        let State { position_m, velocity_m_per_s, actuator_n } = self.state;
        let acceleration = self.regime.net_n * self.scene.inverse_mass(self.regime.key.slide);
        let mut hand_force_n = 0.0;
        let mut wall_force_n = 0.0;
        let mut is_in_contact = false;
        for environment in &self.scene.environments {
            let force_n = environment.law(self.elapsed_s, position_m, velocity_m_per_s).force_n
                - environment.added_mass_kg() * acceleration;
            match environment.role() {
                Role::Hand => hand_force_n += force_n,
                Role::Wall => {
                    wall_force_n += force_n;
                    is_in_contact |= force_n.abs() > 0.0;
                }
                Role::Mechanism => {}
            }
        }
        AxisTruth {
            position_m,
            velocity_m_per_s,
            actuator_force_n: actuator_n,
            hand_force_n,
            wall_force_n,
            is_in_contact,
            motor: self
                .scene
                .motor
                .as_ref()
                .map(|motor| motor.truth(self.scene.command_n, actuator_n, velocity_m_per_s)),
        }
    }
}

/// What moves.
#[derive(Debug, Clone, Copy)]
struct State {
    position_m: f64,
    velocity_m_per_s: f64,
    /// What the motor applies, `N`.
    actuator_n: f64,
}

/// Which way Coulomb friction acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Slide {
    /// There is none.
    Frictionless,
    Forward,
    Backward,
    /// Friction holds the mass.
    Stuck,
}

impl Slide {
    /// Whether the velocity passed zero on the way to `next`: the mass was at rest for an instant.
    fn is_left_by(self, next: Self) -> bool {
        matches!((self, next), (Self::Forward, Self::Backward) | (Self::Backward, Self::Forward))
    }
}

/// What one linear regime is recognised by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct RegimeKey {
    stiffness_bits: u64,
    damping_bits: u64,
    slide: Slide,
    supply: Supply,
}

/// One linear regime and the forces at its present state.
#[derive(Debug, Clone, Copy)]
struct Regime {
    key: RegimeKey,
    /// Mass times acceleration, `N`.
    net_n: f64,
    /// How that changes with time alone, `N/s`.
    net_rate_n_per_s: f64,
    /// How the motor's force changes, `N/s`.
    actuator_rate_n_per_s: f64,
}

/// What acts on the mass.
#[derive(Debug)]
struct Scene {
    device: DeviceParameters,
    motor: Option<Motor>,
    environments: Vec<Box<dyn Environment>>,
    inverse_mass_per_kg: f64,
    command_n: f64,
}

impl Scene {
    /// The regime that `state` is in.
    #[inline]
    fn regime(&self, elapsed_s: f64, state: &State) -> Regime {
        let State { position_m, velocity_m_per_s, actuator_n } = *state;
        let damping_ns_per_m = self.device.damping_ns_per_m;
        let mut law = Law {
            force_n: actuator_n - damping_ns_per_m * velocity_m_per_s,
            damping_ns_per_m,
            ..Law::default()
        };
        for environment in &self.environments {
            law += environment.law(elapsed_s, position_m, velocity_m_per_s);
        }
        let (slide, net_n) = self.friction(velocity_m_per_s, law.force_n);
        let (supply, actuator_rate_n_per_s) = match &self.motor {
            Some(motor) => motor.drive(self.command_n, actuator_n, velocity_m_per_s),
            None => (Supply::Follows, 0.0),
        };
        Regime {
            key: RegimeKey {
                stiffness_bits: law.stiffness_n_per_m.to_bits(),
                damping_bits: law.damping_ns_per_m.to_bits(),
                slide,
                supply,
            },
            net_n,
            net_rate_n_per_s: law.rate_n_per_s,
            actuator_rate_n_per_s,
        }
    }

    /// Which way friction acts and what it leaves of `applied_n`.
    #[inline]
    fn friction(&self, velocity_m_per_s: f64, applied_n: f64) -> (Slide, f64) {
        let friction_n = self.device.coulomb_friction_n;
        if friction_n <= 0.0 {
            return (Slide::Frictionless, applied_n);
        }
        let is_at_rest = velocity_m_per_s.abs() <= 0.0;
        if velocity_m_per_s > 0.0 || (is_at_rest && applied_n > friction_n) {
            (Slide::Forward, applied_n - friction_n)
        } else if velocity_m_per_s < 0.0 || (is_at_rest && applied_n < -friction_n) {
            (Slide::Backward, applied_n + friction_n)
        } else {
            (Slide::Stuck, 0.0)
        }
    }

    /// What friction holds has no acceleration, whatever the force.
    fn inverse_mass(&self, slide: Slide) -> f64 {
        if slide == Slide::Stuck { 0.0 } else { self.inverse_mass_per_kg }
    }

    /// The state one step of `transition` later, if the regime lasts. A force that changes with time is taken
    /// at the middle of the step.
    #[inline]
    fn step(&self, transition: &Transition, state: &State, regime: &Regime) -> State {
        let net_n = regime.net_n + regime.net_rate_n_per_s * (0.5 * transition.step_s);
        let acceleration = net_n * transition.inverse_mass_per_kg;
        if self.motor.is_none() {
            let (position, velocity) = transition.increments(state.velocity_m_per_s, acceleration);
            return State {
                position_m: state.position_m + position,
                velocity_m_per_s: state.velocity_m_per_s + velocity,
                actuator_n: state.actuator_n,
            };
        }
        let (position, velocity, force) =
            transition.driven_increments(state.velocity_m_per_s, acceleration, regime.actuator_rate_n_per_s);
        State {
            position_m: state.position_m + position,
            velocity_m_per_s: state.velocity_m_per_s + velocity,
            actuator_n: state.actuator_n + force,
        }
    }

    /// The exact step over `step_s` of the regime that `key` stands for.
    fn transition(&self, key: RegimeKey, step_s: f64) -> Transition {
        let (decay_per_s, counter_n_per_m) =
            self.motor.as_ref().map_or((0.0, 0.0), |motor| motor.feedback(key.supply));
        let dynamics = Dynamics {
            stiffness_n_per_m: f64::from_bits(key.stiffness_bits),
            damping_ns_per_m: f64::from_bits(key.damping_bits),
            inverse_mass_per_kg: self.inverse_mass(key.slide),
            decay_per_s,
            counter_n_per_m,
        };
        Transition::over(&dynamics, step_s)
    }
}

/// The exact step of one regime over one length.
#[derive(Debug, Clone, Copy)]
struct Known {
    key: RegimeKey,
    halvings: u8,
    transition: Transition,
}

/// The exact steps of the regimes met so far.
#[derive(Debug)]
struct Transitions {
    sub_step_s: f64,
    known: Vec<Known>,
    latest: Known,
}

impl Transitions {
    fn new(scene: &Scene, key: RegimeKey, sub_step_s: f64) -> Self {
        let latest = Known { key, halvings: 0, transition: scene.transition(key, sub_step_s) };
        Self { sub_step_s, known: vec![latest], latest }
    }

    #[inline]
    fn get(&mut self, scene: &Scene, key: RegimeKey, halvings: u8) -> &Transition {
        if self.latest.key != key || self.latest.halvings != halvings {
            self.latest = self.seek(scene, key, halvings);
        }
        &self.latest.transition
    }

    #[cold]
    #[inline(never)]
    fn seek(&mut self, scene: &Scene, key: RegimeKey, halvings: u8) -> Known {
        if let Some(known) = self.known.iter().find(|known| known.key == key && known.halvings == halvings) {
            return *known;
        }
        if self.known.len() >= TRANSITIONS_MAX {
            self.known.clear();
        }
        let step_s = self.sub_step_s / f64::from(1_u32 << halvings);
        let made = Known { key, halvings, transition: scene.transition(key, step_s) };
        self.known.push(made);
        made
    }
}
