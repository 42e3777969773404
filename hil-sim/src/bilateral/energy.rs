//! The energy in the channel between two wave transformers, axis by axis.
//!
//! `E[k] = h/2 sum_{j<=k} sum_ports (out[j]² - in[j]²)`: what was sent in and has not come out. For
//! any constant delay it is the energy of the waves in flight, `h/2 sum (waves in flight)² >= 0`
//! (Niemeyer and Slotine, 1991). Every axis is a channel of its own and has to be passive by itself.
//!
//! A wave that is not lost arrives bit for bit as it left. Its power is counted in whole grains, so that it takes out
//! exactly what it brought in: at rest the account is 0, and not what rounding left.

use dimsart_core::types;

use crate::rig::{Probe, Rig};

/// A grain is 8e-22 `W`: far below what a wave of any use has, and waves of 1e8 `sqrt(W)` still fit.
const GRAINS_PER_W: f64 = (1_u128 << 70) as f64;

/// Adds up the channel's energy, tick by tick.
#[derive(Debug)]
pub struct ChannelEnergy {
    /// Per station: the wave that leaves and the one that comes in.
    ports: Vec<(Probe, Probe)>,
    /// Sum of squares in the channel by axis; empty until there are waves.
    grains: Vec<i128>,
    /// The same, `J`.
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
            grains: Vec::new(),
            energy_j: Vec::new(),
            smallest_j: None,
        }
    }

    /// Adds the present tick of every station, unless one of them has no wave signals; gives the energy so far by
    /// axis, `J`: empty as long as nothing was added.
    pub fn add(&mut self, rig: &Rig) -> &[f64] {
        let mut ports = self.ports.iter_mut().zip(rig.stations());
        if ports.any(|((out, into), station)| out.words(station).is_empty() || into.words(station).is_empty())
        {
            return &self.energy_j;
        }
        for ((outgoing, incoming), station) in self.ports.iter_mut().zip(rig.stations()) {
            let waves = outgoing.values(station).zip(incoming.values(station));
            for (axis, (sent, received)) in waves.enumerate() {
                if self.grains.len() <= axis {
                    self.grains.push(0);
                    self.energy_j.push(0.0);
                }
                if let Some(sum) = self.grains.get_mut(axis) {
                    *sum = sum.saturating_add(grains(sent)).saturating_sub(grains(received));
                }
            }
        }
        for (energy_j, grains) in self.energy_j.iter_mut().zip(&self.grains) {
            *energy_j = 0.5 * rig.period_s() * (*grains as f64 / GRAINS_PER_W);
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

#[expect(
    clippy::cast_possible_truncation,
    reason = "whole grains are wanted, and too many of them are as many as fit"
)]
fn grains(wave: f64) -> i128 {
    (wave * wave * GRAINS_PER_W) as i128
}
