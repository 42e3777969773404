//! One moving mass and everything that acts on it.
//!
//! `m v' = F_motor + Σ F_environment - b v - F_coulomb`, `m` with everything that moves along.
//!
//! Between events this is linear and each sub-step is exact. An event is a change of regime: of the summed slopes
//! (contact, release), of the sliding direction, of the motor's supply. A sub-step that ends in another regime than
//! it began in is halved until the event is located within `period / 20 / 2^10`, 49 ns at 1 kHz.

use super::environment::{Environment, Role};
use super::motor::{Motor, MotorParameters};
use super::parameter::ParameterError;
use super::scene::{Regime, Scene, Slide};
use super::transition::Motion;
use super::transitions::{Span, Transitions};
use super::{Actuation, AxisTruth, DeviceParameters, SUB_STEPS_MIN};

/// How often a sub-step may be halved.
const HALVINGS_MAX: u8 = 10;

/// One moving mass.
#[derive(Debug)]
pub struct Axis {
    scene: Scene,
    transitions: Transitions,
    motion: Motion,
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
        let mut motion = Motion { position_m: device.start_position_m, ..Motion::default() };
        let regime = scene.regime(0.0, &mut motion);
        let transitions = Transitions::new(&scene, regime.key, 0.0);
        Ok(Self { scene, transitions, motion, regime, elapsed_s: 0.0 })
    }

    /// What the encoder reports now, `m`.
    #[expect(clippy::cast_possible_truncation, reason = "the controller's number is an f32")]
    pub(super) fn sense(&self) -> f32 {
        self.scene.device.encoder_m(self.motion.position_m) as f32
    }

    /// Holds `command_n` (`N`) from `start_s` for `period_s` and moves on.
    pub(super) fn advance(&mut self, start_s: f64, period_s: f64, command_n: f64) {
        self.scene.command_n = command_n;
        if self.scene.motor.is_none() {
            self.motion.actuator_n = command_n;
        }
        for environment in &mut self.scene.environments {
            environment.begin_period(start_s, period_s);
        }
        self.elapsed_s = 0.0;
        self.regime = self.scene.regime(0.0, &mut self.motion);
        if period_s.to_bits() != self.transitions.period_s.to_bits() {
            self.transitions = Transitions::new(&self.scene, self.regime.key, period_s);
        }
        if self.stride(period_s) {
            return;
        }
        let mut left = SUB_STEPS_MIN;
        while left > 0 {
            left -= self.glide(left);
            if left > 0 {
                self.step(0);
                left -= 1;
            }
        }
    }

    /// Takes the whole period in one exact step, if nothing can happen on the way; says whether it did.
    fn stride(&mut self, period_s: f64) -> bool {
        let Self { scene, transitions, motion, regime, elapsed_s } = self;
        if scene.motor.is_some() || !regime.outlasts(motion, scene.inverse_mass_per_kg, period_s) {
            return false;
        }
        let transition = transitions.get(scene, regime.key, Span::Period);
        *motion = transition.step(motion, regime.jerk(transition));
        *elapsed_s = period_s;
        true
    }

    /// Takes up to `sub_steps` while the regime surely lasts; returns how many.
    fn glide(&mut self, sub_steps: u32) -> u32 {
        let Self { scene, transitions, motion, regime, elapsed_s } = self;
        let transition = transitions.get(scene, regime.key, Span::SubStep { halvings: 0 });
        if transition
            .hiding_rad2_per_s2
            .is_some_and(|rad2_per_s2| !regime.reaches_around(motion, rad2_per_s2))
        {
            return 0;
        }
        let jerk = regime.jerk(transition);
        if scene.motor.is_none() && regime.key.slide == Slide::Frictionless {
            // Most of all sub-steps are of this kind, so they are not asked what cannot happen to them.
            let done = transition.glide(motion, jerk, sub_steps, |position_m, velocity_m_per_s| {
                regime.holds_at(position_m, velocity_m_per_s)
            });
            *elapsed_s += f64::from(done) * transition.step_s;
            return done;
        }
        let (mut here, mut now_s) = (*motion, *elapsed_s);
        let mut done = 0;
        while done < sub_steps {
            let next = scene.step(transition, &here, jerk);
            let next_s = now_s + transition.step_s;
            if !scene.lasts(regime, next_s, &next) {
                break;
            }
            (here, now_s) = (next, next_s);
            done += 1;
        }
        (*motion, *elapsed_s) = (here, now_s);
        done
    }

    /// Takes one sub-step, halved `halvings` times, at whose end everything is asked for its force again. If an
    /// event may have happened on the way, takes it in two halves instead.
    #[cold]
    #[inline(never)]
    fn step(&mut self, halvings: u8) {
        let Self { scene, transitions, motion, regime, elapsed_s } = self;
        let transition = transitions.get(scene, regime.key, Span::SubStep { halvings });
        let is_last = halvings == HALVINGS_MAX;
        let is_fine = |rad2_per_s2| regime.reaches_around(motion, rad2_per_s2);
        if is_last || transition.hiding_rad2_per_s2.is_none_or(is_fine) {
            let mut next = scene.step(transition, motion, regime.jerk(transition));
            let next_s = *elapsed_s + transition.step_s;
            let mut next_regime = scene.regime(next_s, &mut next);
            if is_last && regime.key.slide.is_reversed_by(next_regime.key.slide) {
                next.velocity_m_per_s = 0.0;
                next_regime = scene.regime(next_s, &mut next);
            }
            if is_last || next_regime.key == regime.key {
                (*motion, *regime, *elapsed_s) = (next, next_regime, next_s);
                return;
            }
        }
        self.step(halvings + 1);
        self.step(halvings + 1);
    }

    /// Where it really is now, `m`.
    pub(super) fn position_m(&self) -> f64 {
        self.motion.position_m
    }

    /// What its actuator does now.
    pub(super) fn actuation(&self) -> Actuation {
        let Motion { position_m: position, actuator_n: force, .. } = self.motion;
        Actuation { position, force, is_held: self.scene.motor.is_none(), moves_several: false }
    }

    /// Whether a wall pushes it now.
    pub(super) fn is_in_contact(&self) -> bool {
        let mut walls = self.scene.environments.iter().filter(|there| there.role() == Role::Wall);
        walls.any(|wall| self.force_n(wall.as_ref()).abs() > 0.0)
    }

    /// What something does to it now, its own inertia included, `N`.
    fn force_n(&self, environment: &dyn Environment) -> f64 {
        let Motion { position_m, velocity_m_per_s, acceleration_m_per_s2, .. } = self.motion;
        environment.law(self.elapsed_s, position_m, velocity_m_per_s).force_n
            - environment.added_mass_kg() * acceleration_m_per_s2
    }

    /// The simulator's own truth about this axis now.
    #[must_use]
    pub fn truth(&self) -> AxisTruth {
        let Motion { position_m, velocity_m_per_s, actuator_n, .. } = self.motion;
        let mut hand_force_n = 0.0;
        let mut wall_force_n = 0.0;
        let mut is_in_contact = false;
        for environment in &self.scene.environments {
            let force_n = self.force_n(environment.as_ref());
            match environment.role() {
                Role::Hand => hand_force_n += force_n,
                Role::Wall => {
                    wall_force_n += force_n;
                    is_in_contact |= force_n.abs() > 0.0;
                }
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
