//! The energy in the channel between two wave transformers, axis by axis.
//!
//! `E[k] = h/2 sum_{j<=k} sum_ports (out[j]² - in[j]²)`: the energy sent into the channel minus the energy received.
//! For any constant delay it is the energy of the waves in flight, `h/2 sum (waves in flight)² >= 0` (Niemeyer and
//! Slotine, 1991). Every axis is a separate channel and must be passive.
//!
//! A received wave is bit-identical to the sent wave. Its power is counted in integer grains, so that it removes
//! exactly the energy that it added, without rounding error at rest.

use core::ops::ControlFlow;

use dimsart_core::types;

use super::Observer;
use crate::outcome::Outcome;
use crate::rig::{Probe, Rig, Station};

/// A grain is 8e-22 `W`, far below any practical wave power; waves up to 1e8 `sqrt(W)` are representable.
const GRAINS_PER_W: f64 = (1_u128 << 70) as f64;

/// Ends of a channel.
const MAX_ENDS: usize = 2;

/// Sums the channel's energy, tick by tick.
#[derive(Debug)]
pub struct ChannelEnergy {
    /// Outgoing and incoming wave of each station.
    ports: Vec<(Probe, Probe)>,
    /// Energy by axis in grains; empty until waves exist.
    grains: Vec<i128>,
    /// Minimum so far, at most 0.
    smallest: i128,
    half_period_s: f64,
}

impl ChannelEnergy {
    /// Creates the channel between all stations of a rig.
    #[must_use]
    pub fn new(rig: &Rig) -> Self {
        let port = || (Probe::new(types::CH1_WAVES.first()), Probe::new(types::CH2_WAVES.first()));
        let ports = rig.stations().iter().map(|_| port()).collect();
        Self { ports, grains: Vec::new(), smallest: 0, half_period_s: 0.5 * rig.period_s() }
    }

    /// Creates the channel between two stations with a wave in each direction, or at one of them. `None` if several
    /// channels would be mixed.
    #[must_use]
    pub fn between_two_stations(rig: &Rig) -> Option<Self> {
        let has_one = |station: &Station| {
            let signals = station.dimsart.engine().data_base().signals();
            signals.filter(|(_, entry)| entry.signal.id == types::CH1_WAVES.id).count() <= 1
        };
        let stations = rig.stations();
        (stations.len() <= MAX_ENDS && stations.iter().all(has_one)).then(|| Self::new(rig))
    }

    /// Adds the present tick of every station, unless a station has no wave signals.
    pub fn add(&mut self, rig: &Rig) {
        let Self { ports, grains: sums, smallest, .. } = self;
        let mut there = ports.iter_mut().zip(rig.stations());
        if !there.all(|((out, into), station)| out.is_present(station) && into.is_present(station)) {
            return;
        }
        for ((outgoing, incoming), station) in ports.iter_mut().zip(rig.stations()) {
            let waves = outgoing.values(station).zip(incoming.values(station));
            sums.resize(sums.len().max(waves.len()), 0);
            for (sum, (sent, received)) in sums.iter_mut().zip(waves) {
                *sum = sum.saturating_add(grains(sent) - grains(received));
            }
        }
        *smallest = sums.iter().copied().fold(*smallest, i128::min);
    }

    /// Returns the energy by axis, `J`; empty before the first tick with waves.
    #[must_use]
    pub fn energy_j(&self) -> Vec<f64> {
        self.grains.iter().map(|grains| self.joules(*grains)).collect()
    }

    /// Returns the minimum energy of any axis, `J`, at most 0; `None` without waves.
    #[must_use]
    pub fn min_j(&self) -> Option<f64> {
        (!self.grains.is_empty()).then(|| self.joules(self.smallest))
    }

    fn joules(&self, grains: i128) -> f64 {
        self.half_period_s * (grains as f64 / GRAINS_PER_W)
    }
}

impl Observer for ChannelEnergy {
    fn observe(&mut self, rig: &Rig) -> ControlFlow<()> {
        self.add(rig);
        ControlFlow::Continue(())
    }

    fn report(&mut self, _rig: &Rig, outcome: &mut Outcome) {
        outcome.energy_min_j = self.min_j();
    }
}

/// Values below this limit fit into native integers.
const FEW_GRAINS: f64 = (1_u64 << 63) as f64;
/// Exponent above which a value has no bits below this limit.
const COARSE: u32 = 11;

#[expect(
    clippy::cast_possible_truncation,
    reason = "whole grains are wanted, and too many of them are as many as fit"
)]
fn grains(wave: f64) -> i128 {
    let grains = wave * wave * GRAINS_PER_W;
    let coarse = grains / f64::from(1 << COARSE);
    match () {
        () if grains < FEW_GRAINS => i128::from(grains as i64),
        () if coarse < FEW_GRAINS => i128::from(coarse as i64) << COARSE,
        () => grains as i128,
    }
}
