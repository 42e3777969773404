//! Detects restarts of a peer process and different sample periods.

use core::ops::ControlFlow;

use dimsart_core::types;

use super::Observer;
use crate::outcome::Outcome;
use crate::rig::{Probe, Rig, Station};

/// Relative difference of the packet rate that indicates different sample periods; clock errors are far smaller.
const OTHER_RATE: f64 = 0.1;
/// Silence at the end of a run that is reported, ticks.
const SILENCE_TICKS: u32 = 100;

/// Observes the only station of a rig.
#[derive(Debug)]
pub(crate) struct Peer {
    name: String,
    /// Ticks per packet.
    every_ticks: u32,
    restarts: u32,
    restarts_s: Vec<f64>,
}

impl Peer {
    /// Creates an observer of a peer of this name, which sends a packet every `every_ticks`.
    pub(crate) fn new(rig: &Rig, name: &str, every_ticks: u32) -> Self {
        Self { name: name.to_owned(), every_ticks, restarts: restarts(rig), restarts_s: Vec::new() }
    }
}

impl Observer for Peer {
    fn observe(&mut self, rig: &Rig) -> ControlFlow<()> {
        let restarts = restarts(rig);
        if restarts != self.restarts {
            self.restarts = restarts;
            self.restarts_s.push(rig.time_s());
        }
        ControlFlow::Continue(())
    }

    fn report(&mut self, rig: &Rig, outcome: &mut Outcome) {
        let (other, station) = (&self.name, rig.stations().first());
        let age =
            station.and_then(|station| Probe::new(types::LINK_AGE.first()).words(station).first().copied());
        if let Some(silence_ticks) = age.filter(|ticks| *ticks > SILENCE_TICKS) {
            outcome.faults.push(format!(
                "no packet from the {other} in the last {silence_ticks} ticks: the peer stopped first"
            ));
        }
        for time_s in &self.restarts_s {
            outcome.warnings.push(format!(
                "the {other} restarted at {time_s:.3} s, so the results mix two runs: restart both sides"
            ));
        }
        let per_tick = station.and_then(|station| station.packets_per_tick(0));
        let expected = 1.0 / f64::from(self.every_ticks);
        let is_other = |per_tick: &f64| (per_tick / expected - 1.0).abs() > OTHER_RATE;
        if let Some(per_tick) = per_tick.filter(is_other) {
            let [found, expected] = [per_tick, expected].map(|share| share / rig.period_s());
            outcome.warnings.push(format!(
                "the {other} sends {found:.0} packets/s, expected {expected:.0}: use the same sample_period_s \
                and link.every_ticks on both sides"
            ));
        }
    }
}

fn restarts(rig: &Rig) -> u32 {
    rig.stations().first().map_or(0, Station::restarts)
}
