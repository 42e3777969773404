//! The energy that the robots gave their controllers, axis by axis: what the whole of controllers and line makes of it.
//!
//! `E = -∫ sum_sides F v dt`, with the actuator's force `F` on the device and its velocity `v`. A passive two-port never
//! gives out more than it got, `E >= 0` (Niemeyer and Slotine, 1991); one that does is active, whatever the energy in the
//! [channel](crate::bilateral::energy) says. A force that is held for a tick does `F Δx`, exactly; a motor's is taken as even.

use crate::rig::Rig;

/// Adds up what goes through the ports, tick by tick.
#[derive(Debug, Default)]
pub struct PortEnergy {
    /// Of each axis of each station, from the tick before: force and position.
    before: Vec<(f64, f64)>,
    /// By axis, `J`.
    energy_j: Vec<f64>,
    smallest_j: f64,
}

impl PortEnergy {
    /// Adds what has happened since the tick before.
    pub fn add(&mut self, rig: &Rig) {
        let mut place = 0;
        for station in rig.stations() {
            self.energy_j.resize(self.energy_j.len().max(station.plant.dof()), 0.0);
            for (axis, energy_j) in self.energy_j.iter_mut().enumerate() {
                let Some(now_n) = station.plant.actuator_force_n(axis) else { continue };
                let now_m = station.plant.position(axis);
                match self.before.get_mut(place) {
                    Some((force_n, position_m)) => {
                        // An ideal source has held its force all the time, a motor's has changed.
                        let from_n = if station.plant.holds_force(axis) { now_n } else { *force_n };
                        *energy_j -= 0.5 * (from_n + now_n) * (now_m - *position_m);
                        (*force_n, *position_m) = (now_n, now_m);
                    }
                    None => self.before.push((now_n, now_m)),
                }
                place += 1;
            }
        }
        self.smallest_j = self.energy_j.iter().copied().fold(self.smallest_j, f64::min);
    }

    /// Smallest energy of any axis so far, `J`, never above the 0 that each starts with.
    #[must_use]
    pub fn smallest_j(&self) -> f64 {
        self.smallest_j
    }
}
