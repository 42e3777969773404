//! The forces on one mass, and which linear regime a motion is in.
//!
//! `m a = F_motor + Σ F_environment - b v + F_coulomb`

use super::DeviceParameters;
use super::environment::{Environment, Law};
use super::motor::{Motor, Supply};
use super::transition::{Dynamics, Motion, Transition};

/// Which way Coulomb friction acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Slide {
    /// There is none.
    Frictionless,
    /// The mass slides towards larger positions.
    Forward,
    /// The mass slides towards smaller positions.
    Backward,
    /// Friction holds the mass.
    Stuck,
}

impl Slide {
    /// Whether the velocity passed zero on the way to `next`: the mass was at rest for an instant.
    pub(super) fn is_reversed_by(self, next: Self) -> bool {
        matches!((self, next), (Self::Forward, Self::Backward) | (Self::Backward, Self::Forward))
    }
}

/// What one linear regime is recognised by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct RegimeKey {
    stiffness_bits: u64,
    damping_bits: u64,
    pub(super) slide: Slide,
    supply: Supply,
}

/// One linear regime, as found at one instant.
#[derive(Debug, Clone, Copy)]
pub(super) struct Regime {
    pub(super) key: RegimeKey,
    /// All forces but Coulomb friction, then.
    law: Law,
    elapsed_s: f64,
    position_m: f64,
    velocity_m_per_s: f64,
    actuator_n: f64,
}

impl Regime {
    /// How the acceleration changes with time alone, `m/s³`, under a transition of this regime.
    pub(super) fn jerk(&self, transition: &Transition) -> f64 {
        self.law.rate_n_per_s * transition.inverse_mass_per_kg
    }

    /// Whether the law holds that far from where it was found.
    #[inline]
    pub(super) fn holds_at(&self, position_m: f64, velocity_m_per_s: f64) -> bool {
        (position_m - self.position_m).abs() < self.law.reach_m
            && (velocity_m_per_s - self.velocity_m_per_s).abs() < self.law.reach_m_per_s
    }

    /// Whether the law holds all along the free oscillation of squared frequency `rad2_per_s2` from `motion`:
    /// its amplitude around the equilibrium is `sqrt(a²/w⁴ + v²/w²)`, and damping only shrinks it. Sliding friction
    /// reverses on the way, so never with it.
    pub(super) fn reaches_around(&self, motion: &Motion, rad2_per_s2: f64) -> bool {
        let (velocity, acceleration) = (motion.velocity_m_per_s, motion.acceleration_m_per_s2);
        let amplitude2 = (acceleration * acceleration / rad2_per_s2 + velocity * velocity) / rad2_per_s2;
        let swing_m = 2.0 * amplitude2.sqrt();
        let left_m = self.law.reach_m - (motion.position_m - self.position_m).abs();
        let left_m_per_s = self.law.reach_m_per_s - (velocity - self.velocity_m_per_s).abs();
        self.key.slide == Slide::Frictionless
            && swing_m < left_m
            && swing_m * rad2_per_s2.sqrt() < left_m_per_s
    }
}

/// What acts on the mass.
#[derive(Debug)]
pub(super) struct Scene {
    pub(super) device: DeviceParameters,
    pub(super) motor: Option<Motor>,
    pub(super) environments: Vec<Box<dyn Environment>>,
    /// Of everything that moves along, `1/kg`.
    pub(super) inverse_mass_per_kg: f64,
    /// Held command, `N`.
    pub(super) command_n: f64,
}

impl Scene {
    /// Asks everything for its force: the regime that `motion` is in. Sets the motion's rates of change.
    pub(super) fn regime(&self, elapsed_s: f64, motion: &mut Motion) -> Regime {
        let Motion { position_m, velocity_m_per_s, actuator_n, .. } = *motion;
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
        motion.acceleration_m_per_s2 = net_n * self.inverse_mass_per_kg;
        motion.actuator_rate_n_per_s = actuator_rate_n_per_s;
        let key = RegimeKey {
            stiffness_bits: law.stiffness_n_per_m.to_bits(),
            damping_bits: law.damping_ns_per_m.to_bits(),
            slide,
            supply,
        };
        Regime { key, law, elapsed_s, position_m, velocity_m_per_s, actuator_n }
    }

    /// Which way friction acts and what it leaves of `applied_n`.
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

    /// Whether `motion`, reached within `regime`, surely is still in it.
    #[inline]
    pub(super) fn lasts(&self, regime: &Regime, elapsed_s: f64, motion: &Motion) -> bool {
        let law = &regime.law;
        let slides_on = match regime.key.slide {
            Slide::Frictionless => true,
            Slide::Forward => motion.velocity_m_per_s > 0.0,
            Slide::Backward => motion.velocity_m_per_s < 0.0,
            Slide::Stuck => {
                let since_n = law.rate_n_per_s * (elapsed_s - regime.elapsed_s)
                    + (motion.actuator_n - regime.actuator_n);
                (law.force_n + since_n).abs() <= self.device.coulomb_friction_n
            }
        };
        slides_on
            && regime.holds_at(motion.position_m, motion.velocity_m_per_s)
            && self.motor.as_ref().is_none_or(|motor| {
                motor.drive(self.command_n, motion.actuator_n, motion.velocity_m_per_s).0 == regime.key.supply
            })
    }

    /// `motion` one step of `transition` later, if the regime lasts.
    #[inline]
    pub(super) fn step(&self, transition: &Transition, motion: &Motion, jerk: f64) -> Motion {
        if self.motor.is_none() {
            transition.step(motion, jerk)
        } else {
            transition.driven_step(motion, jerk)
        }
    }

    /// The exact step over `step_s` of the regime that `key` stands for.
    pub(super) fn transition(&self, key: RegimeKey, step_s: f64) -> Transition {
        let (decay_per_s, counter_n_per_m) =
            self.motor.as_ref().map_or((0.0, 0.0), |motor| motor.feedback(key.supply));
        // What friction holds has no acceleration, whatever the force.
        let inverse_mass_per_kg = if key.slide == Slide::Stuck { 0.0 } else { self.inverse_mass_per_kg };
        let dynamics = Dynamics {
            stiffness_n_per_m: f64::from_bits(key.stiffness_bits),
            damping_ns_per_m: f64::from_bits(key.damping_bits),
            inverse_mass_per_kg,
            decay_per_s,
            counter_n_per_m,
        };
        Transition::over(&dynamics, step_s)
    }
}
