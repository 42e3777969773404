//! The axes of a device that belong to one controller.

use std::collections::BTreeSet;

use super::{AxisSection, ControllerSection, DeviceSection, RigFile};

/// A controller with its axes.
#[derive(Debug, Clone)]
pub struct ControllerAxes<'f> {
    /// Controller.
    pub controller: &'f ControllerSection,
    /// Device.
    pub device: &'f DeviceSection,
    /// Axes of the device.
    pub axes: Vec<usize>,
}

impl<'f> ControllerAxes<'f> {
    /// Returns the parts of all controllers in stepping order: those of the first device first.
    #[must_use]
    pub fn all(file: &'f RigFile) -> Vec<Self> {
        let of_device = |device: &'f DeviceSection| {
            let its = file.controllers.iter().filter(|controller| controller.device == device.name);
            its.map(move |controller| Self { controller, device, axes: controller.axes(device) })
        };
        file.devices.iter().flat_map(of_device).collect()
    }

    /// Returns the controller's name.
    #[must_use]
    pub fn name(&self) -> &'f str {
        self.controller.name()
    }

    /// Returns the number of the first link on which it sends.
    #[must_use]
    pub fn first_send_link(&self, file: &RigFile) -> usize {
        file.links.iter().find(|link| link.from == self.name()).map_or(0, |link| link.from_link.into())
    }

    /// Returns its axes with their index in the device.
    pub fn sections(&self) -> impl Iterator<Item = (usize, &'f AxisSection)> {
        self.axes.iter().filter_map(|axis| Some((*axis, self.device.axes.get(*axis)?)))
    }
}

impl RigFile {
    /// Returns the controllers of the hand's device and of the pressing device.
    #[must_use]
    pub fn press_pair(&self) -> Option<[ControllerAxes<'_>; 2]> {
        let press = self.experiment.press.as_ref()?;
        let parts = ControllerAxes::all(self);
        let hand = parts.iter().find(|part| part.device.name == press.device)?;
        let link = self.links.iter().find(|link| link.from == hand.name())?;
        let other = parts.iter().find(|part| part.name() == link.to)?;
        Some([hand.clone(), other.clone()])
    }
}

/// Returns all controllers connected to a controller by links, directly or indirectly, including itself.
pub(crate) fn linked_with<'f>(file: &'f RigFile, controller: &'f str) -> BTreeSet<&'f str> {
    let mut linked = BTreeSet::from([controller]);
    loop {
        let ends = file.links.iter().map(|link| [link.from.as_str(), link.to.as_str()]);
        let more: Vec<&str> =
            ends.filter(|ends| ends.iter().any(|end| linked.contains(end))).flatten().collect();
        let before = linked.len();
        linked.extend(more);
        if linked.len() == before {
            return linked;
        }
    }
}
