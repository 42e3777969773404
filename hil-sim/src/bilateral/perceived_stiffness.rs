//! What the hand feels of what the slave meets, measured in the settled contact.
//!
//! What it should be: [`Chain::stiffness_n_per_m`](crate::bilateral::chain::Chain::stiffness_n_per_m).

use std::ops::Range;

use dimsart_core::types;

use crate::plant::Obstacle;
use crate::rig::{Probe, Rig};
use crate::settled_contact::SettledContact;

/// Averages force and depth of the master while the contact is settled.
#[derive(Debug)]
pub struct PerceivedStiffness {
    force: Probe,
    /// When it is looked at, `s`.
    watched_s: Range<f64>,
    axes: Vec<Axis>,
}

#[derive(Debug)]
struct Axis {
    /// Where depth begins, `m`; none where nothing stops the slave.
    surface_m: Option<f64>,
    contact: SettledContact,
}

impl PerceivedStiffness {
    /// For a rig whose first station is the master and whose last one meets these obstacles, by axis.
    #[must_use]
    pub fn new(obstacles: &[Option<Obstacle>], watched_s: Range<f64>) -> Self {
        let surface_m = |obstacle: &Option<Obstacle>| obstacle.map(|obstacle| obstacle.surface_m);
        let axis = |obstacle| Axis { surface_m: surface_m(obstacle), contact: SettledContact::default() };
        let axes = obstacles.iter().map(axis).collect();
        Self { force: Probe::new(types::DES_FORCE.first()), watched_s, axes }
    }

    /// Adds the present tick. `touches` says for an axis whether the slave is pressed against its obstacle.
    pub fn add(&mut self, rig: &Rig, touches: impl Fn(usize) -> bool) {
        let Some(master) = rig.stations().first() else { return };
        let share = (rig.time_s() - self.watched_s.start) / (self.watched_s.end - self.watched_s.start);
        for (place, (axis, force_n)) in self.axes.iter_mut().zip(self.force.values(master)).enumerate() {
            let Some(surface_m) = axis.surface_m else { continue };
            // The force on the device pushes back against the hand.
            axis.contact.add(share, touches(place), -force_n, master.plant.position(place) - surface_m);
        }
    }

    /// Perceived stiffness per axis, `N/m`; none for an axis that was not in contact all the time, or that
    /// nothing stops.
    #[must_use]
    pub fn per_axis(&self) -> Vec<Option<f64>> {
        self.axes.iter().map(|axis| axis.contact.stiffness()).collect()
    }

    /// Axes whose perceived stiffness was still on its way by more than a thousandth of it, in words.
    pub(super) fn unsettled(&self) -> impl Iterator<Item = String> {
        self.axes.iter().enumerate().filter_map(|(axis, of)| {
            let how = of.contact.unsettled()?;
            Some(format!(
                "the perceived stiffness of axis {axis} has not settled: {how}; a longer run (duration_s) or more damping \
                 lets it"
            ))
        })
    }
}
