//! The energy in the channel between two wave transformers, axis by axis.
//!
//! `E[k] = h/2 sum_{j<=k} sum_ports (out[j]² - in[j]²)`: what was sent in and has not come out. For
//! any constant delay it is the energy of the waves in flight, `h/2 sum (waves in flight)² >= 0`
//! (Niemeyer and Slotine, 1991). Every axis is a channel of its own and has to be passive by itself.

use dimsart_core::types;

use crate::rig::{Probe, Rig};

/// Adds up the channel's energy, tick by tick.
#[derive(Debug)]
pub struct ChannelEnergy {
    /// Per station: the wave that leaves and the one that comes in.
    ports: Vec<(Probe, Probe)>,
    /// By axis, `J`; empty until there are waves.
    energy_j: Vec<f64>,
    smallest_j: Option<f64>,
}

impl ChannelEnergy {
    /// The channel between all stations of a rig, empty at first.
    #[must_use]
    pub fn new(rig: &Rig) -> Self {
        let port = || (Probe::new(types::CH1_WAVES.first()), Probe::new(types::CH2_WAVES.first()));
        Self {
            ports: rig.stations().iter().map(|_| port()).collect(),
            energy_j: Vec::new(),
            smallest_j: None,
        }
    }

    /// Adds the present tick of every station; gives the energy so far by axis, `J`: empty as long as no station's
    /// scheme has had wave signals.
    pub fn add(&mut self, rig: &Rig) -> &[f64] {
        for ((outgoing, incoming), station) in self.ports.iter_mut().zip(rig.stations()) {
            let waves = outgoing.values(station).zip(incoming.values(station));
            for (axis, (sent, received)) in waves.enumerate() {
                if self.energy_j.len() <= axis {
                    self.energy_j.push(0.0);
                }
                if let Some(energy_j) = self.energy_j.get_mut(axis) {
                    *energy_j += 0.5 * rig.period_s() * (sent * sent - received * received);
                }
            }
        }
        if let Some(least_j) = self.energy_j.iter().copied().reduce(f64::min) {
            self.smallest_j = Some(self.smallest_j.unwrap_or(0.0).min(least_j));
        }
        &self.energy_j
    }

    /// Smallest energy of any axis so far, `J`, never above the 0 that each starts with; none when there never were
    /// any waves.
    #[must_use]
    pub fn smallest_j(&self) -> Option<f64> {
        self.smallest_j
    }
}
