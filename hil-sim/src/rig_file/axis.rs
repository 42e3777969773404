//! `[[device.axis]]`: an axis with its plant and environment.

use std::collections::BTreeMap;

use dimsart_core::AxisKind;
use serde::{Deserialize, Serialize};

use super::{AxisHand, AxisSpring, AxisWall, EnvironmentKind, WallSide};
use crate::plant::{JointParameters, SensorParameters, StopsParameters};

/// `[[device.axis]]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct AxisSection {
    /// Number of equal axes.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub count: usize,
    /// Rotary (`rad`) or linear (`m`).
    #[serde(default)]
    pub unit: AxisUnit,
    /// Plant of an axis that is not coupled.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plant: Option<JointParameters>,
    /// Sensor errors by signal; default: ideal sensors.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub sensor: BTreeMap<String, SensorParameters>,
    /// Limits of the safety stage, as declared by a board.
    #[serde(default, skip_serializing_if = "ActuatorSection::is_unlimited")]
    pub actuator: ActuatorSection,
    /// Which of `wall` and `spring` is active; default: both.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub environment: Option<EnvironmentKind>,
    /// One-sided wall; equivalent to a stop of the `plant`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wall: Option<AxisWall>,
    /// Spring to ground.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spring: Option<AxisSpring>,
    /// Hand on the axis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hand: Option<AxisHand>,
}

impl Default for AxisSection {
    fn default() -> Self {
        Self {
            count: 1,
            unit: AxisUnit::default(),
            plant: None,
            sensor: BTreeMap::new(),
            actuator: ActuatorSection::default(),
            environment: None,
            wall: None,
            spring: None,
            hand: None,
        }
    }
}

/// `actuator`: range and rate of an axis' force.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct ActuatorSection {
    /// Maximum force, ±, `N` or `N m`; `inf`: the maximum of the motor.
    pub max_force: f64,
    /// Maximum rate of the force, `N/s` or `N m/s`; `inf`: unlimited.
    pub max_rate: f64,
}

impl Default for ActuatorSection {
    fn default() -> Self {
        Self { max_force: f64::INFINITY, max_rate: f64::INFINITY }
    }
}

impl ActuatorSection {
    fn is_unlimited(&self) -> bool {
        *self == Self::default()
    }
}

/// Unit of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
pub enum AxisUnit {
    /// Rotary.
    #[default]
    #[serde(rename = "rad")]
    Radian,
    /// Linear.
    #[serde(rename = "m")]
    Metre,
}

impl AxisUnit {
    /// Returns the axis kind of the controller.
    #[must_use]
    pub const fn kind(self) -> AxisKind {
        match self {
            Self::Radian => AxisKind::Rotary,
            Self::Metre => AxisKind::Linear,
        }
    }

    /// Returns the unit of stiffness.
    #[must_use]
    pub const fn stiffness(self) -> &'static str {
        match self {
            Self::Radian => "N m/rad",
            Self::Metre => "N/m",
        }
    }
}

impl AxisSection {
    /// Returns the joint with everything attached to it; `None` for a coupled axis. The spring of the hand pulls to
    /// 0; the rest of the hand's force is a [load](Self::hand_stiffness).
    #[must_use]
    pub fn joint(&self) -> Option<JointParameters> {
        let mut joint = self.plant.clone()?;
        if let Some(hand) = &self.hand {
            joint.load.inertia += hand.inertia;
            joint.load.damping += hand.damping;
        }
        let own = AxisSpring {
            rest_position: joint.load.rest_position,
            stiffness: joint.load.stiffness,
            damping: 0.0,
        };
        let AxisSpring { rest_position, stiffness, damping } = self.springs().fold(own, AxisSpring::beside);
        (joint.load.rest_position, joint.load.stiffness) = (rest_position, stiffness);
        joint.load.damping += damping;
        if let Some(wall) = self.active_wall() {
            let (min, max) = match wall.solid {
                WallSide::Above => (f64::NEG_INFINITY, wall.position),
                WallSide::Below => (wall.position, f64::INFINITY),
            };
            joint.stops =
                Some(StopsParameters { min, max, stiffness: wall.stiffness(), damping: wall.damping });
        }
        Some(joint)
    }

    /// Returns the active wall.
    #[must_use]
    pub fn active_wall(&self) -> Option<&AxisWall> {
        self.wall.as_ref().filter(|_| self.environment.is_none_or(|kind| kind == EnvironmentKind::Wall))
    }

    /// Returns the active spring.
    #[must_use]
    pub fn active_spring(&self) -> Option<&AxisSpring> {
        self.spring.as_ref().filter(|_| self.environment.is_none_or(|kind| kind == EnvironmentKind::Spring))
    }

    /// Returns the force of wall and spring on the axis.
    #[must_use]
    pub fn environment_force(&self, position: f64, velocity: f64) -> f64 {
        self.active_spring().map_or(0.0, |spring| spring.force(position, velocity))
            + self.active_wall().map_or(0.0, |wall| wall.force(position, velocity))
    }

    /// Returns the force of hand, spring and wall on the axis, without the inertia of the hand; the spring of the
    /// hand pulls to 0.
    #[must_use]
    pub fn force(&self, position: f64, velocity: f64) -> f64 {
        let springs: f64 = self.springs().map(|spring| spring.force(position, velocity)).sum();
        let hand = self.hand.as_ref().map_or(0.0, |hand| -hand.damping * velocity);
        springs + hand + self.active_wall().map_or(0.0, |wall| wall.force(position, velocity))
    }

    /// Adds the inertia and damping of the hand, without its stiffness.
    #[must_use]
    pub fn without_hand_stiffness(&self) -> Self {
        let hand = self.hand.clone().map(|hand| AxisHand { stiffness: 0.0, ..hand });
        Self { hand, ..self.clone() }
    }

    /// Stiffness of the hand, `N m/rad` or `N/m`; 0 without a hand.
    #[must_use]
    pub fn hand_stiffness(&self) -> f64 {
        self.hand.as_ref().map_or(0.0, |hand| hand.stiffness)
    }

    /// Attaches a further spring-damper.
    pub(super) fn attach(&mut self, stiffness: f64, rest_position: f64, damping: f64) {
        let one = AxisSpring { rest_position, stiffness, damping };
        self.spring = Some(self.spring.take().map_or(one.clone(), |spring| spring.beside(one)));
    }

    /// Stiffness of the hand, and spring-damper of the environment.
    fn springs(&self) -> impl Iterator<Item = AxisSpring> {
        let hand = AxisSpring { rest_position: 0.0, stiffness: self.hand_stiffness(), damping: 0.0 };
        core::iter::once(hand).chain(self.active_spring().cloned())
    }
}

const fn one() -> usize {
    1
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde has it")]
const fn is_one(count: &usize) -> bool {
    *count == 1
}
