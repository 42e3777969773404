//! The energy in the channel between two wave transformers, axis by axis.
//!
//! `E[k] = h/2 sum_{j<=k} sum_ports (out[j]² - in[j]²)`: what was sent in and has not come out. For
//! any constant delay it is the energy of the waves in flight, `h/2 sum (waves in flight)² >= 0`
//! (Niemeyer and Slotine, 1991). Every axis is a channel of its own and has to be passive by itself.
//!
//! A wave that is not lost arrives bit for bit as it left. Its power is counted in whole grains, so that it takes out
//! exactly what it brought in: at rest the account is 0, and not what rounding left.

use core::ops::ControlFlow;

use dimsart_core::types;

use super::Observer;
use crate::outcome::Outcome;
use crate::rig::{Probe, Rig, Station};

/// A grain is 8e-22 `W`: far below what a wave of any use has, and waves of 1e8 `sqrt(W)` still fit.
const GRAINS_PER_W: f64 = (1_u128 << 70) as f64;

/// Ends of a channel.
const MAX_ENDS: usize = 2;

/// Adds up the channel's energy, tick by tick.
#[derive(Debug)]
pub struct ChannelEnergy {
    /// Per station: the wave that leaves and the one that comes in.
    ports: Vec<(Probe, Probe)>,
    /// Sum of squares in the channel by axis; empty until there are waves.
    grains: Vec<i128>,
    /// The smallest one so far, never above the 0 that each starts with.
    smallest: i128,
    half_period_s: f64,
}

impl ChannelEnergy {
    /// The channel between all stations of a rig, empty at first.
    #[must_use]
    pub fn new(rig: &Rig) -> Self {
        let port = || (Probe::new(types::CH1_WAVES.first()), Probe::new(types::CH2_WAVES.first()));
        let ports = rig.stations().iter().map(|_| port()).collect();
        Self { ports, grains: Vec::new(), smallest: 0, half_period_s: 0.5 * rig.period_s() }
    }

    /// The same where there is one channel: between two stations with a wave each way, or at one of them alone. None where
    /// the waves of several channels would be mixed.
    #[must_use]
    pub fn of_one_channel(rig: &Rig) -> Option<Self> {
        let has_one = |station: &Station| {
            let signals = station.dimsart.engine().data_base().signals();
            signals.filter(|(_, entry)| entry.signal.id == types::CH1_WAVES.id).count() <= 1
        };
        let stations = rig.stations();
        (stations.len() <= MAX_ENDS && stations.iter().all(has_one)).then(|| Self::new(rig))
    }

    /// Adds the present tick of every station, unless one of them has no wave signals.
    pub fn add(&mut self, rig: &Rig) {
        let Self { ports, grains: sums, smallest, .. } = self;
        let mut there = ports.iter_mut().zip(rig.stations());
        if !there.all(|((out, into), station)| out.finds(station) && into.finds(station)) {
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

    /// The energy so far by axis, `J`: empty as long as nothing was added.
    #[must_use]
    pub fn energy_j(&self) -> Vec<f64> {
        self.grains.iter().map(|grains| self.joules(*grains)).collect()
    }

    /// Smallest energy of any axis so far, `J`, never above the 0 that each starts with; none when there never were
    /// any waves.
    #[must_use]
    pub fn smallest_j(&self) -> Option<f64> {
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
        outcome.energy_min_j = self.smallest_j();
    }
}

/// Below that, a processor's own integers hold it.
const FEW_GRAINS: f64 = (1_u64 << 63) as f64;
/// From there on it has no bits below this one.
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
