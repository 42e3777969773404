//! `[[device]]`: axes with their plants, and the frame that a controller exchanges with them.

use std::collections::BTreeMap;

use dimsart_core::{AxisKind, limits};
use serde::{Deserialize, Serialize};

use super::{AxisHand, AxisSpring, AxisWall, EnvironmentKind};
use crate::observer::watch::Ranges;
use crate::plant::{
    ArmParameters, Cia402Parameters, JointParameters, LinkKind, MoteusParameters, PhantomParameters,
    PhantomPort, SensorParameters,
};

/// `[[device]]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct DeviceSection {
    /// What it is called; its controller, too.
    pub name: String,
    /// Types of the Data Base that its controller gets of it, in the order of the frame: what it has sensors for
    /// (`POSITION`, `VELOCITY`, `FORCE`), and references that the experiment moves.
    #[serde(default = "position")]
    pub measures: Vec<String>,
    /// Types that its actuators take; none of what does not move, and has references alone.
    #[serde(default = "force")]
    pub takes: Vec<String>,
    /// The device whose axes its references move, over links; of one that takes nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub leads: Option<String>,
    /// From a measurement to the force that comes of it: sampling, computing and PWM, in ticks, 0 to 3; a part of a tick
    /// is allowed.
    #[serde(default)]
    pub delay_ticks: f64,
    /// Position, `m` or `rad`, beyond which a run is broken off, either way.
    #[serde(default = "position_limit")]
    pub position_limit: f64,
    /// Force, `N` or `N m`, beyond which a run is broken off, either way.
    #[serde(default = "force_limit")]
    pub force_limit: f64,
    /// Ranges beyond which a run is not stable, in place of both limits: those are what the safety stage lets through.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub watch: Option<WatchSection>,
    /// Its axes, 1 to 8; those of coupled ones need no entry.
    #[serde(rename = "axis", default)]
    pub axes: Vec<AxisSection>,
    /// Axes that are the joints of one arm, and move each other.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arm: Option<ArmParameters>,
    /// Axes that are those of a `PHANToM`: where its tip is, from where it starts, or its joints.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub phantom: Option<PhantomParameters>,
    /// Drives of mjbots that turn its axes, behind a CAN FD bus.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub moteus: Option<MoteusParameters>,
    /// Drives of CiA 402 that turn its axes, behind a `CANopen` bus.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cia402: Option<Cia402Parameters>,
}

/// `[[device.axis]]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct AxisSection {
    /// How many equal axes it stands for.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub count: usize,
    /// Whether it turns or slides.
    #[serde(default)]
    pub unit: AxisUnit,
    /// What moves; only of an axis that moves by itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plant: Option<JointParameters>,
    /// What is wrong with its sensors, by the type that they show; one that is left out shows the truth.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub sensor: BTreeMap<String, SensorParameters>,
    /// What its controller's safety stage lets through, as a board declares it.
    #[serde(default, skip_serializing_if = "ActuatorSection::is_unlimited")]
    pub actuator: ActuatorSection,
    /// Which of its sections `wall` and `spring` it meets; left out, both.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub environment: Option<EnvironmentKind>,
    /// What it meets on one side; a stop of the `plant` by another name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wall: Option<AxisWall>,
    /// What it is attached to.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spring: Option<AxisSpring>,
    /// Who holds it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hand: Option<AxisHand>,
}

/// `[device.watch]`: ranges of its signals, symmetric around 0.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct WatchSection {
    /// Of positions, `m` or `rad`.
    pub position: f64,
    /// Of forces, `N` or `N m`.
    pub force: f64,
    /// Of waves, `sqrt(W)`.
    #[serde(default = "wave_limit")]
    pub wave: f64,
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
    /// Maximum force either way, `N` or `N m`; `inf` for that of the motor.
    pub max_force: f64,
    /// Maximum change of the force, `N/s` or `N m/s`; `inf` for any.
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

/// What an axis is measured in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
pub enum AxisUnit {
    /// It turns.
    #[default]
    #[serde(rename = "rad")]
    Radian,
    /// It slides.
    #[serde(rename = "m")]
    Metre,
}

impl AxisUnit {
    /// The same for a controller.
    #[must_use]
    pub const fn kind(self) -> AxisKind {
        match self {
            Self::Radian => AxisKind::Rotary,
            Self::Metre => AxisKind::Linear,
        }
    }

    /// Unit of a stiffness along it.
    #[must_use]
    pub const fn stiffness(self) -> &'static str {
        match self {
            Self::Radian => "N m/rad",
            Self::Metre => "N/m",
        }
    }
}

impl DeviceSection {
    /// Whether anything of it moves: one that takes nothing gives references alone, to a coordinator.
    #[must_use]
    pub fn moves(&self) -> bool {
        !self.takes.is_empty()
    }

    /// Number of its coupled axes; none where each has a plant of its own.
    #[must_use]
    pub fn coupled_axes(&self) -> Option<usize> {
        self.arm.as_ref().map(|arm| arm.link.len()).or(self.phantom.as_ref().map(|_| PHANTOM_AXES))
    }

    /// Gives every axis an entry, and coupled ones their unit.
    pub(super) fn complete(&mut self) {
        let equal = |axis: AxisSection| {
            let most = axis.count.min(limits::MAX_DOF + 1);
            core::iter::repeat_n(AxisSection { count: 1, ..axis }, most)
        };
        self.axes = core::mem::take(&mut self.axes).into_iter().flat_map(equal).collect();
        let Some(count) = self.coupled_axes() else { return };
        if self.axes.len() < count {
            self.axes.resize(count, AxisSection::default());
        }
        let units = |axis: usize| match (&self.arm, &self.phantom) {
            (Some(arm), _) => match arm.link.get(axis).map(|link| link.kind) {
                Some(LinkKind::Prismatic) => AxisUnit::Metre,
                _ => AxisUnit::Radian,
            },
            (_, Some(phantom)) if phantom.port.is_held_at_tip() => AxisUnit::Metre,
            _ => AxisUnit::Radian,
        };
        let units: Vec<AxisUnit> = (0..self.axes.len()).map(units).collect();
        for (axis, unit) in self.axes.iter_mut().zip(units) {
            axis.unit = unit;
        }
    }

    /// What an axis is for its controller: a joint that turns, though its directions are those of the tip, where a
    /// `PHANToM` is held there.
    #[must_use]
    pub fn kind(&self, axis: &AxisSection) -> AxisKind {
        match &self.phantom {
            Some(PhantomParameters { port: PhantomPort::HeldAtTip, .. }) => AxisKind::Rotary,
            _ => axis.unit.kind(),
        }
    }

    /// Where an axis stands at the start.
    #[must_use]
    pub fn start_position(&self, axis: usize) -> f64 {
        let own = || Some(self.axes.get(axis)?.plant.as_ref()?.load.start_position);
        match (&self.arm, &self.phantom) {
            (Some(arm), _) => arm.link.get(axis).map_or(0.0, |link| link.start_position),
            // Cartesian positions begin at 0 where it stands.
            (_, Some(phantom)) if phantom.port == PhantomPort::Joint => {
                phantom.start_position_rad.get(axis).copied().unwrap_or_default()
            }
            (_, Some(_)) => 0.0,
            _ => own().unwrap_or_default(),
        }
    }

    /// The same without what is known not to be linear: dry friction, a gear's losses, backlash, stops and walls, a
    /// sensor's steps and noise. In contact, every axis with a wall is held by it from both sides.
    #[must_use]
    pub fn linear(&self, in_contact: bool) -> Self {
        let mut linear = self.clone();
        linear.arm = self.arm.as_ref().map(ArmParameters::linear);
        linear.phantom = self.phantom.as_ref().map(PhantomParameters::linear);
        for (axis, section) in linear.axes.iter_mut().enumerate() {
            for sensor in section.sensor.values_mut() {
                *sensor = SensorParameters { gain: sensor.gain, ..SensorParameters::default() };
            }
            section.plant = section.plant.as_ref().map(JointParameters::linear);
            let (wall, spring) = (section.met_wall().cloned(), section.met_spring().cloned());
            (section.environment, section.wall, section.spring) = (None, None, spring);
            if let Some(wall) = wall.filter(|_| in_contact) {
                section.attach(wall.stiffness(), self.start_position(axis), wall.damping);
            }
        }
        linear
    }

    /// Maximum force of an axis that its controller's safety stage lets through, `N` or `N m`: that of its motor, at most
    /// `force_limit` and the declared one.
    #[must_use]
    pub fn max_force(&self, axis: usize) -> f64 {
        let own = || Some(self.axes.get(axis)?.plant.as_ref()?.max_force());
        let motor = match (&self.arm, &self.phantom, &self.moteus, &self.cia402) {
            (Some(arm), ..) => arm.link.get(axis).map(|link| link.effort_limit),
            (_, Some(phantom), ..) => phantom.max_force(axis),
            (.., Some(moteus), _) => Some(moteus.most_torque_nm),
            (.., Some(cia402)) => Some(cia402.max_torque_nm()),
            _ => own(),
        };
        motor.unwrap_or(f64::INFINITY).min(self.force_limit).min(self.actuator(axis).max_force)
    }

    /// Range and rate of an axis as they are declared.
    #[must_use]
    pub fn actuator(&self, axis: usize) -> ActuatorSection {
        self.axes.get(axis).map(|section| section.actuator).unwrap_or_default()
    }

    /// What a run of it is broken off by.
    #[must_use]
    pub fn ranges(&self) -> Ranges {
        if let Some(WatchSection { position, force, wave }) = self.watch {
            return Ranges { position, force, max_force: [force; limits::MAX_DOF], wave };
        }
        let max_force = core::array::from_fn(|axis| self.max_force(axis));
        Ranges { position: self.position_limit, force: self.force_limit, max_force, wave: WAVE_LIMIT }
    }
}

/// Of a `PHANToM`.
const PHANTOM_AXES: usize = 3;
/// Beyond which a run is broken off, `sqrt(W)`.
const WAVE_LIMIT: f64 = 1e4;

fn wave_limit() -> f64 {
    WAVE_LIMIT
}

const fn one() -> usize {
    1
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde has it")]
const fn is_one(count: &usize) -> bool {
    *count == 1
}

fn position_limit() -> f64 {
    1e3
}

fn force_limit() -> f64 {
    1e4
}

fn position() -> Vec<String> {
    vec!["POSITION".to_owned()]
}

fn force() -> Vec<String> {
    vec!["DES_FORCE".to_owned()]
}
