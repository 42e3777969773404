//! What the hand feels of what the slave meets, measured in the settled contact.
//!
//! What it should be: [`Chain::stiffness_n_per_m`](crate::bilateral::chain::Chain::stiffness_n_per_m).

use dimsart_core::types;

use crate::plant::Obstacle;
use crate::rig::{Probe, Rig};

/// Averages force and depth of the master while the contact is settled.
#[derive(Debug)]
pub struct PerceivedStiffness {
    force: Probe,
    axes: Vec<Sums>,
}

#[derive(Debug, Clone, Default)]
struct Sums {
    /// Where depth begins, `m`; none where nothing stops the slave.
    surface_m: Option<f64>,
    ticks: u32,
    ticks_in_contact: u32,
    force_n: f64,
    depth_m: f64,
}

impl PerceivedStiffness {
    /// For a rig whose first station is the master and whose last one meets these obstacles, by axis.
    #[must_use]
    pub fn new(obstacles: &[Option<Obstacle>]) -> Self {
        let surface_m = |obstacle: &Option<Obstacle>| obstacle.map(|obstacle| obstacle.surface_m);
        let sums = |obstacle| Sums { surface_m: surface_m(obstacle), ..Sums::default() };
        Self { force: Probe::new(types::DES_FORCE.first()), axes: obstacles.iter().map(sums).collect() }
    }

    /// Adds the present tick. `touches` says for an axis whether the slave is pressed against its obstacle.
    pub fn add(&mut self, rig: &Rig, touches: impl Fn(usize) -> bool) {
        let Some(master) = rig.stations().first() else { return };
        let mut forces = self.force.values(master);
        for (axis, sums) in self.axes.iter_mut().enumerate() {
            let (Some(force_n), Some(truth)) = (forces.next(), master.plant.truth(axis)) else { return };
            let Some(surface_m) = sums.surface_m else { continue };
            sums.ticks += 1;
            sums.ticks_in_contact += u32::from(touches(axis));
            // The force on the device pushes back against the hand.
            sums.force_n -= force_n;
            sums.depth_m += truth.position_m - surface_m;
        }
    }

    /// Perceived stiffness per axis, `N/m`; none for an axis that was not in contact all the time, or that
    /// nothing stops.
    #[must_use]
    pub fn per_axis(&self) -> Vec<Option<f64>> {
        let is_settled = |sums: &Sums| sums.ticks > 0 && sums.ticks_in_contact == sums.ticks;
        self.axes.iter().map(|sums| is_settled(sums).then(|| sums.force_n / sums.depth_m)).collect()
    }
}
