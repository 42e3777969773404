//! Energy that the robots supply to controllers and link, by axis.
//!
//! `E = -∫ sum_sides F v dt`, with the actuator's force `F` on the device and its velocity `v`. A passive two-port
//! never supplies more energy than it received, `E >= 0` (Niemeyer and Slotine, 1991), independent of the
//! [channel](super::channel_energy) energy. A constant force over a tick does exactly `F Δx`; the force of a motor is
//! averaged. If an actuator moves several directions of its device, energy is exchanged between axes, and all axes
//! are summed.

use core::ops::ControlFlow;

use super::Observer;
use crate::outcome::Outcome;
use crate::plant::Actuation;
use crate::rig::{Rig, Station};

/// Sums the energy through the ports, tick by tick.
#[derive(Debug, Default)]
pub struct PortEnergy {
    /// Previous tick of each axis of each station.
    before: Vec<Actuation>,
    now: Vec<Actuation>,
    /// Energy by axis, `J`; the sum in the first entry if axes are summed.
    energy_j: Vec<f64>,
    smallest_j: f64,
}

impl Observer for PortEnergy {
    /// Adds the energy since the last tick.
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
                // An ideal source holds its force; the force of a motor varies.
                let from = if now.is_zero_order_hold { now.force } else { before.force };
                *energy_j -= 0.5 * (from + now.force) * (now.position - before.position);
                are_together |= now.is_coupled;
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

    /// Returns the minimum energy of any axis, `J`, at most 0.
    fn report(&mut self, rig: &Rig, outcome: &mut Outcome) {
        outcome.energy_ports_min_j = (rig.ticks() > 0).then_some(self.smallest_j);
    }
}
