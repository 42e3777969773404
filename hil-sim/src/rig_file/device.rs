//! `[[device]]`: axes with their plants, and the frame that a controller exchanges with them.

use std::collections::BTreeMap;

use dimsart_core::AxisKind;
use serde::{Deserialize, Serialize};

use super::{AxisHand, AxisSpring, AxisWall};
use crate::plant::{JointParameters, SensorParameters};
use crate::watch::Ranges;

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
    /// Types that its actuators take.
    #[serde(default = "force")]
    pub takes: Vec<String>,
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
    /// Its axes, 1 to 8.
    #[serde(rename = "axis")]
    pub axes: Vec<AxisSection>,
}

/// `[[device.axis]]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct AxisSection {
    /// Whether it turns or slides.
    #[serde(default)]
    pub unit: AxisUnit,
    /// What moves.
    pub plant: JointParameters,
    /// What is wrong with its sensors, by the type that they show; one that is left out shows the truth.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub sensor: BTreeMap<String, SensorParameters>,
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
}

impl DeviceSection {
    /// What a run of it is broken off by.
    #[must_use]
    pub fn ranges(&self) -> Ranges {
        Ranges { position: self.position_limit, force: self.force_limit, wave: WAVE_LIMIT }
    }
}

/// Beyond which a run is broken off, `sqrt(W)`.
const WAVE_LIMIT: f64 = 1e4;

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
