//! The energy that the robots gave their controllers, axis by axis: what the whole of controllers and line makes of it.
//!
//! `E = -∫ sum_sides F v dt`, with the actuator's force `F` on the device and its velocity `v`. A passive two-port never
//! gives out more than it got, `E >= 0` (Niemeyer and Slotine, 1991); one that does is active, whatever the energy in the
//! [channel](super::channel_energy) says. A force that is held for a tick does `F Δx`, exactly; a motor's is taken as even.
//! Where an actuator moves several directions of its device, controllers move energy from axis to axis: all axes count
//! together then.

use core::ops::ControlFlow;

use super::Observer;
use crate::outcome::Outcome;
use crate::plant::Actuation;
use crate::rig::{Rig, Station};

/// Adds up what goes through the ports, tick by tick.
#[derive(Debug, Default)]
pub struct PortEnergy {
    /// Of each axis of each station, from the tick before.
    before: Vec<Actuation>,
    now: Vec<Actuation>,
    /// By axis, `J`; of all together in the first one, where they count so.
    energy_j: Vec<f64>,
    smallest_j: f64,
}

impl Observer for PortEnergy {
    /// Adds what has happened since the tick before.
    fn observe(&mut self, rig: &Rig) -> ControlFlow<()> {
        let Self { before, now, energy_j, smallest_j } = self;
        now.clear();
        let mut are_together = false;
        for Station { plant, .. } in rig.stations() {
            let first = now.len();
            plant.add_actuations(now);
            let (before, now) = (before.iter().skip(first), now.iter().skip(first));
            if energy_j.len() < now.len() {
                energy_j.resize(now.len(), 0.0);
            }
            for (energy_j, (before, now)) in energy_j.iter_mut().zip(before.zip(now)) {
                // An ideal source has held its force all the time, a motor's has changed.
                let from = if now.is_held { now.force } else { before.force };
                *energy_j -= 0.5 * (from + now.force) * (now.position - before.position);
                are_together |= now.moves_several;
            }
        }
        if are_together {
            let sum_j = energy_j.iter().sum();
            energy_j.fill(0.0);
            energy_j.iter_mut().take(1).for_each(|first| *first = sum_j);
        }
        core::mem::swap(before, now);
        *smallest_j = energy_j.iter().copied().fold(*smallest_j, f64::min);
        ControlFlow::Continue(())
    }

    /// The minimum energy of any axis, `J`, never above the 0 that each starts with.
    fn report(&mut self, rig: &Rig, outcome: &mut Outcome) {
        outcome.energy_ports_min_j = (rig.ticks() > 0).then_some(self.smallest_j);
    }
}
