//! Geometry of the device of each controller, for pictures.

use serde::Serialize;

use super::{AxisUnit, AxisWall, ControllerAxes, RigFile};
use crate::plant::{ArmParameters, PhantomParameters};

/// Geometry of a controller's device.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Geometry {
    /// Device name. Controllers that share a device have the same name here.
    pub device: String,
    /// Indices of the controller's axes in the device.
    pub axes: Vec<usize>,
    /// All axes of the device.
    pub axis: Vec<AxisGeometry>,
    /// Links of an arm.
    pub arm: Option<ArmParameters>,
    /// Linkage of a `PHANToM`.
    pub phantom: Option<PhantomParameters>,
}

/// Geometry and environment of an axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AxisGeometry {
    /// Unit of its position.
    pub unit: AxisUnit,
    /// Start position.
    pub start_position: f64,
    /// Wall, if active.
    pub wall: Option<AxisWall>,
    /// Whether a hand is attached.
    pub has_hand: bool,
}

impl Geometry {
    /// Returns the geometries of a rig's controllers, in the order of its stations. A device without actuators has none.
    #[must_use]
    pub fn all(file: &RigFile) -> Vec<Option<Self>> {
        ControllerAxes::all(file).iter().map(Self::of_part).collect()
    }

    fn of_part(part: &ControllerAxes<'_>) -> Option<Self> {
        let device = part.device;
        let axis = device.axes.iter().enumerate().map(|(axis, section)| AxisGeometry {
            unit: section.unit,
            start_position: device.start_position(axis),
            wall: section.active_wall().cloned(),
            has_hand: section.hand.is_some(),
        });
        device.has_actuators().then(|| Self {
            device: device.name.clone(),
            axes: part.axes.clone(),
            axis: axis.collect(),
            arm: device.arm.clone(),
            phantom: device.phantom.clone(),
        })
    }
}
