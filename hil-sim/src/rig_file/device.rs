//! `[[device]]`: axes with their plants, and the signals exchanged with the controller.

use dimsart_core::{AxisKind, limits};
use serde::{Deserialize, Serialize};

use super::{ActuatorSection, AxisSection, AxisUnit};
use crate::observer::watch::Ranges;
use crate::plant::{
    ArmParameters, Cia402Parameters, JointParameters, LinkKind, MoteusParameters, PhantomParameters,
    PhantomPort, SensorParameters,
};

/// `[[device]]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct DeviceSection {
    /// Name, and default name of its controller.
    pub name: String,
    /// Measured signals in the order of the frame: signals with sensors (`POSITION`, `VELOCITY`, `FORCE`) and
    /// references moved by the experiment.
    #[serde(default = "position")]
    pub measures: Vec<String>,
    /// Commanded signals of the actuators; empty for a device that does not move and has references only.
    #[serde(default = "force")]
    pub takes: Vec<String>,
    /// Device that follows its references over links, for a device without actuators.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub leads: Option<String>,
    /// Delay from measurement to force (sampling, computation, PWM), 0 to 3 ticks, also fractional.
    #[serde(default)]
    pub delay_ticks: f64,
    /// Maximum position, ±, `m` or `rad`; the run ends beyond it.
    #[serde(default = "position_limit")]
    pub position_limit: f64,
    /// Maximum force, ±, `N` or `N m`; the run ends beyond it.
    #[serde(default = "force_limit")]
    pub force_limit: f64,
    /// Ranges beyond which a run is unstable, instead of both limits; the limits then apply to the safety stage only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub watch: Option<WatchSection>,
    /// Axes, 1 to 8; optional for coupled axes.
    #[serde(rename = "axis", default)]
    pub axes: Vec<AxisSection>,
    /// Coupled joints of an arm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arm: Option<ArmParameters>,
    /// Axes of a `PHANToM`: tip position relative to its start, or joints.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub phantom: Option<PhantomParameters>,
    /// moteus drives on a CAN FD bus.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub moteus: Option<MoteusParameters>,
    /// CiA 402 drives on a `CANopen` bus.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cia402: Option<Cia402Parameters>,
}

/// `[device.watch]`: ranges of the device's signals, symmetric around 0.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct WatchSection {
    /// Position range, `m` or `rad`.
    pub position: f64,
    /// Force range, `N` or `N m`.
    pub force: f64,
    /// Wave range, `sqrt(W)`.
    #[serde(default = "wave_limit")]
    pub wave: f64,
}

impl DeviceSection {
    /// Whether it has actuators; otherwise it provides references to a coordinator only.
    #[must_use]
    pub fn has_actuators(&self) -> bool {
        !self.takes.is_empty()
    }

    /// Returns the number of coupled axes; `None` if each axis has its own plant.
    #[must_use]
    pub fn coupled_axes(&self) -> Option<usize> {
        self.arm.as_ref().map(|arm| arm.link.len()).or(self.phantom.as_ref().map(|_| PHANTOM_AXES))
    }

    /// Adds missing entries of axes and the units of coupled axes.
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

    /// Returns the axis kind for the controller: rotary if a `PHANToM` is held at its tip, although the rig's axis is
    /// a direction of the tip.
    #[must_use]
    pub fn kind(&self, axis: &AxisSection) -> AxisKind {
        match &self.phantom {
            Some(PhantomParameters { port: PhantomPort::HeldAtTip, .. }) => AxisKind::Rotary,
            _ => axis.unit.kind(),
        }
    }

    /// Returns the start position of an axis.
    #[must_use]
    pub fn start_position(&self, axis: usize) -> f64 {
        let own = || Some(self.axes.get(axis)?.plant.as_ref()?.load.start_position);
        match (&self.arm, &self.phantom) {
            (Some(arm), _) => arm.link.get(axis).map_or(0.0, |link| link.start_position),
            // Cartesian positions start at 0.
            (_, Some(phantom)) if phantom.port == PhantomPort::Joint => {
                phantom.start_position_rad.get(axis).copied().unwrap_or_default()
            }
            (_, Some(_)) => 0.0,
            _ => own().unwrap_or_default(),
        }
    }

    /// Returns the device without known nonlinearities: Coulomb friction, gear losses, backlash, stops and walls,
    /// sensor resolution and noise. In contact, each wall becomes a two-sided spring-damper.
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
            let (wall, spring) = (section.active_wall().cloned(), section.active_spring().cloned());
            (section.environment, section.wall, section.spring) = (None, None, spring);
            if let Some(wall) = wall.filter(|_| in_contact) {
                section.attach(wall.stiffness(), self.start_position(axis), wall.damping);
            }
        }
        linear
    }

    /// Returns the maximum force of an axis after the safety stage, `N` or `N m`: the minimum of the motor's maximum,
    /// `force_limit` and the declared limit.
    #[must_use]
    pub fn max_force(&self, axis: usize) -> f64 {
        let own = || Some(self.axes.get(axis)?.plant.as_ref()?.max_force());
        let motor = match (&self.arm, &self.phantom, &self.moteus, &self.cia402) {
            (Some(arm), ..) => arm.link.get(axis).map(|link| link.effort_limit),
            (_, Some(phantom), ..) => phantom.max_force(axis),
            (.., Some(moteus), _) => Some(moteus.max_torque_nm),
            (.., Some(cia402)) => Some(cia402.max_torque_nm()),
            _ => own(),
        };
        motor.unwrap_or(f64::INFINITY).min(self.force_limit).min(self.actuator(axis).max_force)
    }

    /// Returns the declared range and rate of an axis.
    #[must_use]
    pub fn actuator(&self, axis: usize) -> ActuatorSection {
        self.axes.get(axis).map(|section| section.actuator).unwrap_or_default()
    }

    /// Returns the ranges beyond which the run ends.
    #[must_use]
    pub fn ranges(&self) -> Ranges {
        if let Some(WatchSection { position, force, wave }) = self.watch {
            return Ranges { position, force, max_force: [force; limits::MAX_DOF], wave };
        }
        let max_force = core::array::from_fn(|axis| self.max_force(axis));
        Ranges { position: self.position_limit, force: self.force_limit, max_force, wave: WAVE_LIMIT }
    }
}

/// Axes of a `PHANToM`.
const PHANTOM_AXES: usize = 3;
/// Wave limit beyond which the run ends, `sqrt(W)`.
const WAVE_LIMIT: f64 = 1e4;

fn wave_limit() -> f64 {
    WAVE_LIMIT
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
