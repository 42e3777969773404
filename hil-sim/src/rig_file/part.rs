//! The axes of a device that one controller has.

use std::collections::BTreeSet;

use super::{AxisSection, ControllerSection, DeviceSection, RigFile};

/// A controller, and what it controls.
#[derive(Debug, Clone)]
pub struct Part<'f> {
    /// The controller.
    pub controller: &'f ControllerSection,
    /// What it controls.
    pub device: &'f DeviceSection,
    /// Which of the device's axes.
    pub axes: Vec<usize>,
}

impl<'f> Part<'f> {
    /// Of every controller of a file, those of the first device first: as they are stepped.
    #[must_use]
    pub fn of_all(file: &'f RigFile) -> Vec<Self> {
        let of_device = |device: &'f DeviceSection| {
            let its = file.controllers.iter().filter(|controller| controller.device == device.name);
            its.map(move |controller| Self { controller, device, axes: controller.axes(device) })
        };
        file.devices.iter().flat_map(of_device).collect()
    }

    /// The controller's name.
    #[must_use]
    pub fn name(&self) -> &'f str {
        self.controller.name()
    }

    /// Number of the link that it sends over first.
    #[must_use]
    pub fn link_out(&self, file: &RigFile) -> usize {
        file.links.iter().find(|link| link.from == self.name()).map_or(0, |link| link.from_link.into())
    }

    /// Its axes in the file, by their place in the device.
    pub fn sections(&self) -> impl Iterator<Item = (usize, &'f AxisSection)> {
        self.axes.iter().filter_map(|axis| Some((*axis, self.device.axes.get(*axis)?)))
    }
}

impl RigFile {
    /// The controllers of the hand and of what it presses with, of an experiment that presses.
    #[must_use]
    pub fn pressed(&self) -> Option<[Part<'_>; 2]> {
        let press = self.experiment.press.as_ref()?;
        let parts = Part::of_all(self);
        let hand = parts.iter().find(|part| part.device.name == press.device)?;
        let link = self.links.iter().find(|link| link.from == hand.name())?;
        let other = parts.iter().find(|part| part.name() == link.to)?;
        Some([hand.clone(), other.clone()])
    }
}

/// All controllers that links lead to from one, either way and over others; with itself.
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
