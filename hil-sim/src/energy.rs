//! The energy in the channel between two wave transformers.
//!
//! `E[k] = h/2 sum_{j<=k} sum_ports (out[j]² - in[j]²)`: what was sent in and has not come out. For
//! any constant delay it is the energy of the waves in flight, `h/2 sum (waves in flight)² >= 0`
//! (Niemeyer and Slotine, 1991).

use dimsart_core::types;

use crate::rig::{Probe, Rig};

/// Adds up the channel's energy, tick by tick.
#[derive(Debug)]
pub struct ChannelEnergy {
    /// Per station: the wave that leaves and the one that comes in.
    ports: Vec<(Probe, Probe)>,
    energy_j: f64,
    smallest_j: f64,
}

impl ChannelEnergy {
    /// The channel between all stations of a rig, empty at first.
    #[must_use]
    pub fn new(rig: &Rig) -> Self {
        let port = || (Probe::new(types::CH1_WAVES.first()), Probe::new(types::CH2_WAVES.first()));
        Self { ports: rig.stations().iter().map(|_| port()).collect(), energy_j: 0.0, smallest_j: 0.0 }
    }

    /// Adds the present tick of every station; gives the energy so far, `J`.
    pub fn add(&mut self, rig: &Rig) -> f64 {
        let mut power_w = 0.0;
        for ((outgoing, incoming), station) in self.ports.iter_mut().zip(rig.stations()) {
            let square = |wave: f64| wave * wave;
            power_w += 0.5 * outgoing.values(station).map(square).sum::<f64>();
            power_w -= 0.5 * incoming.values(station).map(square).sum::<f64>();
        }
        self.energy_j += rig.period_s() * power_w;
        self.smallest_j = self.smallest_j.min(self.energy_j);
        self.energy_j
    }

    /// Smallest energy so far, `J`; never above the 0 it starts with.
    #[must_use]
    pub fn smallest_j(&self) -> f64 {
        self.smallest_j
    }
}
